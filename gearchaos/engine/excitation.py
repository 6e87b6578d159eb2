"""What the excitation of a sweep asks for: whole periods of it, and remarks before it begins."""

import math
from collections.abc import Mapping

import numpy as np
from gearchaos_kernels import Teeth

from gearchaos.arrays import Floats
from gearchaos.configuration.run_tables import DEFAULT_STEPS
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.steps import PILOT_LANES
from gearchaos.errors import ConfigurationError
from gearchaos.gear.derivation import LENGTH
from gearchaos.records.period import LONGEST_PERIOD, RETURNS
from gearchaos.results.variables import Variable

LONGEST_EXCITATION = 50_000
"""Mesh periods after which pitch errors repeat, at most: a record holds some of them."""


def whole_lengths(lanes: Lanes) -> dict[str, int]:
    """Return transient and record in whole excitation periods, enough of them to tell a period.

    In mesh periods, by the names of their keys. Raises ConfigurationError if the excitation repeats
    too late, or the record does not suit an order of which amplitudes are told.
    """
    integration, repeats = lanes.config.integration, lanes.repeats_after
    if repeats > LONGEST_EXCITATION:
        raise ConfigurationError(
            f"{lanes.config.source}: the pitch errors repeat after {repeats} mesh periods only, "
            f"more than {LONGEST_EXCITATION}; give one gear deviations, or other teeth"
        )
    least = {"transient_periods": 0, "recorded_periods": 1 if repeats == 1 else RETURNS}
    lengths = {
        name: repeats * max(math.ceil(getattr(integration, name) / repeats), count)
        for name, count in least.items()
    }
    orders, record = lanes.config.outputs.mesh_orders, lengths["recorded_periods"]
    # A choice has no fewer steps.
    most = (integration.steps_per_period or DEFAULT_STEPS) / 2
    if unfit := [str(one) for one in orders if record % one.denominator or one >= most]:
        whole = math.lcm(repeats, *(order.denominator for order in orders))
        raise ConfigurationError(
            f"{lanes.config.source}: outputs.orders: {', '.join(unfit)}: must have whole cycles in "
            f"the record of {record} mesh periods and more than two steps in each; set "
            f"integration.recorded_periods to a multiple of {whole}, such as "
            f"{whole * math.ceil(record / whole)}, and keep to orders below {most:g}"
        )
    return lengths


def remarks(lanes: Lanes, lengths: Mapping[str, int]) -> list[str]:
    """Return what a user should know of the excitation; ``lengths`` from `whole_lengths`."""
    teeth = []
    if lanes.repeats_after > 1:
        teeth = [_longer(lanes, lengths), _parting_pairs(lanes), _printed_gaps(lanes)]
    return [*teeth, _negative_stiffness(lanes), _mistaken_units(lanes)]


def _longer(lanes: Lanes, lengths: Mapping[str, int]) -> str:
    """Tell by how much the teeth make transient and record longer than they are configured."""
    repeats = lanes.repeats_after
    changed = [
        f"integration.{name} raised from {asked} to {length}"
        for name, length in lengths.items()
        if length != (asked := getattr(lanes.config.integration, name))
    ]
    told = min(lengths["recorded_periods"] // (RETURNS * repeats), LONGEST_PERIOD)
    text = (
        f"the pitch errors repeat after {repeats} mesh periods, the excitation period; the "
        f"record is long enough to tell period {told}{' and shorter ones' if told > 1 else ''}"
    )
    return f"{text}; {', '.join(changed)}, whole ones of it" if changed else text


def _printed_gaps(lanes: Lanes) -> str:
    """Tell what the equations as printed make of errors that differ from tooth to tooth."""
    if lanes.config.formulation != "published":
        return ""
    return (
        'formulation = "published" enters the mean of the errors of teeth into the equations as '
        "they are printed: in the gaps it counts cos(beta_b) times, and the mesh damping acts on "
        'its rate, so that forces grow as pitch_error.smoothing is made smaller; "physical" is '
        "free of both"
    )


def _parting_pairs(lanes: Lanes) -> str:
    """Tell where tooth pairs in mesh together differ by more than the load bends them."""
    system = lanes.system_of(lanes.spread(PILOT_LANES))
    if system.teeth is None:
        return ""
    groups, cosine = system.groups, np.cos(system.groups.base_helix_angle)
    # Along the transverse line of action, in which gaps of the published form have cos(beta_b) e.
    projection = 1.0 if system.physical else cosine
    spread = _largest_spread(system.teeth)[system.teeth.profile]
    apart = np.abs(groups.error_amplitude) * projection * spread
    parting = np.mean(apart > np.abs(groups.load) / cosine)
    if parting == 0.0:
        return ""
    return (
        f"in {parting:.0%} of the lanes tooth pairs that share the load differ by up to "
        f"{apart.max():.2g} b', more than the static deflection there; single pairs may then part "
        "while the others carry, which the model leaves out"
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


def _mistaken_units(lanes: Lanes) -> str:
    """Tell which lengths do not suit the module, as those in another unit do not."""
    pair, groups, found = lanes.config.pair, lanes.parameters, []
    if pair is None or not pair.normal_module_mm:
        return ""
    error = () if lanes.repeats_after > 1 else ("pitch_error", "pitch_error_amplitude", LENGTH)
    bending = ("load", LENGTH, "base_helix_angle_deg")
    for what, names in {"static deflection": bending, "pitch error": error}.items():
        if names and {*names} <= {*groups}:
            um = math.prod(_largest_factor(groups[name]) for name in names)
            found += [f"{what} {um:.4g} um"] if um > 100.0 * pair.normal_module_mm else []
    if (pair.face_width_mm or math.inf) < pair.normal_module_mm:
        found.append(f"face width {pair.face_width_mm:g} mm")
    rule = f"unlikely at a normal module of {pair.normal_module_mm:g} mm; are the units those of"
    return f"{', '.join(found)}: {rule} the keys?" if found else ""


def _largest_factor(group: Variable) -> float:
    """Return the largest size of a group; a static deflection has 1 / cos(beta_b) as a factor."""
    values = np.asarray(group.values)
    if group.name == "base_helix_angle_deg":
        values = 1.0 / np.cos(np.radians(values))
    return float(np.abs(values).max())


def _negative_stiffness(lanes: Lanes) -> str:
    """Tell where the variation of the mesh stiffness exceeds its mean."""
    # The first lane and the last one are those of the ends of its scale, if that is swept.
    lowest = np.min(lanes.system_of(lanes.spread(PILOT_LANES)).branch_stiffnesses())
    if lowest >= 0.0:
        return ""
    return (
        f"the mesh stiffness falls to {lowest:.2g} of its mean within a mesh period, below "
        "zero; groups.stiffness_variation_scale is too large for these harmonics"
    )
