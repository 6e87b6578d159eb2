"""Remarks for the user about a gear pair before its sweep runs."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from gearchaos_kernels import GearPairs, Teeth

from gearchaos.arrays import Floats
from gearchaos.iso1328 import cumulative_pitch_um as cumulative_um
from gearchaos.iso1328 import single_pitch_um
from gearchaos.models.gear_pair.derivation import LENGTH, Quantities
from gearchaos.models.gear_pair.physical_tables import Pair, TeethError
from gearchaos.models.gear_pair.tables import GearPairTables, physical_at
from gearchaos.models.gear_pair.tooth_deviations import counted_deviations
from gearchaos.models.stiffness_table import note_of, tables_in

MOST_MODULES = 100.0
"""Largest usual face width in modules."""

MOST_DISCS = 20.0
"""Largest usual mass or inertia over that of a solid disc, and of the disc over it."""

OF_DISCS = {"masses_kg": "kg", "inertias_kg_m2": "kg m^2"}
"""Keys of [pair] that replace a quantity of solid discs, and their units."""

FINEST_UM = 0.1
"""Largest single deviation, in um, below that of every gear that can be made."""

IN_MM = "; no gear is as fine, so they were probably given in mm: multiply them by 1000"


def remarks(
    config: GearPairTables, system: GearPairs, parameters: Mapping[str, Floats]
) -> Iterator[str]:
    """Yield the remarks; an empty text is none.

    ``system``: lanes spread over the sweep; ``parameters``: values of the groups and scales by
    name, as a result keeps them.
    """
    yield from _inspected(config)
    if system.repeats_after > 1:
        yield _parting_pairs(system, parameters.get(LENGTH))
        yield _printed_gaps(config)
    for path, table in tables_in(config.mesh, "mesh"):
        yield note_of(path, table)
    yield _negative_stiffness(system)
    yield _mistaken_units(config, system.repeats_after > 1, parameters)


def _inspected(config: GearPairTables) -> Iterator[str]:
    """Yield what was understood of the measured deviations of each gear."""
    error, pair = config.pitch_error, config.pair
    if not isinstance(error, TeethError) or pair is None:
        return
    for name, teeth in zip(("driving", "driven"), pair.teeth, strict=True):
        gear = getattr(error, name)
        if gear is None:
            continue
        found = counted_deviations(gear)
        single = float(np.abs(found - np.roll(found, 1)).max())
        spread = float(np.ptp(found))
        source = f" of {gear.file}, column {gear.column}" if gear.file else ""
        holds = "single" if gear.cumulative_um is None else "cumulative"
        grade = _grade_of(single, spread, pair, teeth)
        yield (
            f"{name} gear: {teeth} teeth{source}, {holds} deviations; their range is "
            f"{spread:.4g} um and the largest single deviation {single:.4g} um: {grade}"
            f"{IN_MM if 0.0 < single < FINEST_UM else ''}"
        )


def _grade_of(single: float, spread: float, pair: Pair, teeth: int) -> str:
    """Return the best accuracy grade of ISO 1328-1:1995 that a gear passes, in words."""
    module = pair.normal_module_mm
    diameter = teeth * module / math.cos(math.radians(pair.helix_angle_deg))
    try:
        for grade in range(13):
            limits = (limit(grade, module, diameter) for limit in (single_pitch_um, cumulative_um))
            if all(one <= most for one, most in zip((single, spread), limits, strict=True)):
                return f"grade {grade} of ISO 1328-1:1995"
    except ValueError:
        return "outside the ranges of ISO 1328-1:1995"
    return "worse than grade 12 of ISO 1328-1:1995"


def _printed_gaps(config: GearPairTables) -> str:
    """Return what the equations as printed make of errors that differ from tooth to tooth."""
    if config.formulation != "published":
        return ""
    return (
        'formulation = "published" enters the mean of the errors of teeth into the equations as '
        "they are printed: in the gaps it counts cos(beta_b) times, and the mesh damping acts on "
        'its rate, so that forces grow as pitch_error.smoothing is made smaller; "physical" is '
        "free of both"
    )


def _parting_pairs(system: GearPairs, length_um: Floats | None) -> str:
    """Return where tooth pairs in mesh together differ by more than the load bends them.

    ``length_um``: the length scale b' of a physical pair, one or that of each lane.
    """
    if system.teeth is None:
        return ""
    groups, cosine = system.groups, np.cos(system.groups.base_helix_angle)
    # Along the transverse line of action, in which gaps of the published form have cos(beta_b) e.
    projection = 1.0 if system.physical else cosine
    spread = _largest_spread(system.teeth)[system.teeth.profile]
    apart = np.abs(groups.error_amplitude) * projection * spread
    bent = np.abs(groups.load) / cosine
    parting = apart > bent
    if not parting.any():
        return ""
    scale, unit = (1.0, "b'") if length_um is None else (length_um, "um")
    worst, below = (
        np.max(apart * scale),
        np.min(np.broadcast_to(bent * scale, apart.shape)[parting]),
    )
    return (
        f"in {parting.mean():.0%} of the lanes tooth pairs that share the load differ by up to "
        f"{worst:.3g} {unit}, and the static deflection there is {below:.3g} {unit} at the least; "
        "a pair may then part while others carry, which the model leaves out: do not rely on the "
        "loads of these lanes; a high enough operation.torque_Nm or groups.load, or gears of a "
        "finer grade, would keep all pairs together"
    )


def _largest_spread(teeth: Teeth) -> Floats:
    """Return by how much errors of pairs in mesh together differ at most, shape (profiles,)."""
    gears = teeth.driving, teeth.driven
    pairs = np.arange(math.lcm(*(gear.shape[1] for gear in gears)))
    driving, driven = (gear[:, pairs % gear.shape[1]] for gear in gears)
    errors = driven - driving
    later = range(1, teeth.most_at_once)
    apart = [np.abs(errors - np.roll(errors, -n, axis=1)).max(axis=1) for n in later]
    spread: Floats = np.max([np.zeros(len(errors)), *apart], axis=0)
    return spread


def _mistaken_units(config: GearPairTables, teeth: bool, parameters: Mapping[str, Floats]) -> str:
    """Return which lengths do not suit the module, as those in another unit do not."""
    pair, found = config.pair, []
    meant = "pair.normal_module_mm" in config.unusual
    if pair is None or not pair.normal_module_mm or meant:
        return ""
    error = () if teeth else ("pitch_error", "pitch_error_amplitude", LENGTH)
    bending = ("load", LENGTH, "base_helix_angle_deg")
    for what, names in {"static deflection": bending, "pitch error": error}.items():
        if names and {*names} <= {*parameters}:
            um = math.prod(_largest_factor(name, parameters[name]) for name in names)
            found += [f"{what} {um:.4g} um"] if um > 100.0 * pair.normal_module_mm else []
    module, width = pair.normal_module_mm, pair.face_width_mm
    wide = "pair.face_width_mm" in config.unusual
    if width and not wide and not module <= width <= MOST_MODULES * module:
        found.append(f"face width {width:g} mm")
    found += _large_backlash(config, parameters)
    found += _unlike_discs(config)
    rule = f"unlikely at a normal module of {pair.normal_module_mm:g} mm; are the units those of"
    return f"{', '.join(found)}: {rule} the keys?" if found else ""


def _large_backlash(config: GearPairTables, parameters: Mapping[str, Floats]) -> Iterator[str]:
    """Yield the half backlash if it exceeds a quarter of the module: teeth have no such gaps."""
    names = ("half_backlash", LENGTH)
    if config.pair is not None and {*names} <= {*parameters}:
        um = math.prod(_largest_factor(name, parameters[name]) for name in names)
        meant = any("backlash" in path for path in config.unusual)
        if um > 250.0 * config.pair.normal_module_mm and not meant:
            yield f"half backlash {um:.4g} um"


def _unlike_discs(config: GearPairTables) -> Iterator[str]:
    """Yield given masses and inertias that are far from those of solid discs."""
    if config.pair is None:
        return
    physical = physical_at(config, {})
    discs = Quantities(physical | {f"pair.{name}": None for name in OF_DISCS}).pair
    for name, units in OF_DISCS.items():
        given = getattr(config.pair, name)
        if given is None or f"pair.{name}" in config.unusual:
            continue
        solid = getattr(discs, name.partition("_")[0])
        ratios = [float(one / np.asarray(disc)) for one, disc in zip(given, solid, strict=True)]
        if not all(1.0 / MOST_DISCS <= ratio <= MOST_DISCS for ratio in ratios):
            words = f"{name.partition('_')[0]} {given[0]:g} and {given[1]:g} {units}"
            yield f"{words} ({ratios[0]:.2g} and {ratios[1]:.2g} times those of solid discs)"


def _largest_factor(name: str, value: Floats) -> float:
    """Return the largest size of a group; a static deflection has 1 / cos(beta_b) as a factor."""
    values = np.asarray(value)
    if name == "base_helix_angle_deg":
        values = 1.0 / np.cos(np.radians(values))
    return float(np.abs(values).max())


def _negative_stiffness(system: GearPairs) -> str:
    """Return where the variation of the mesh stiffness exceeds its mean."""
    # The first lane and the last one are those of the ends of its scale, if that is swept.
    lowest = np.min(system.branch_stiffnesses())
    if lowest >= 0.0:
        return ""
    return (
        f"the mesh stiffness falls to {lowest:.2g} of its mean within a mesh period, below "
        "zero; groups.stiffness_variation_scale is too large for these harmonics"
    )
