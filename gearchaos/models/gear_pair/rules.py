"""Rules between several keys of a gear pair, except those of its lanes."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from gearchaos.configuration.messages import Fault
from gearchaos.configuration.methods import DEFAULT, EXACT, METHODS
from gearchaos.configuration.rules import Rules
from gearchaos.models.gear_pair.derivation import BACKLASHES, Quantities
from gearchaos.models.gear_pair.geometry_faults import geometry_faults
from gearchaos.models.gear_pair.tables import GearPairTables
from gearchaos.models.stiffness_table import IN_N_PER_UM, PER_WIDTH

ANGLES = {"pair.normal_pressure_angle_deg", "pair.helix_angle_deg"}
"""Paths of the angles by which a backlash is converted from one plane to another."""

GEOMETRY = ("profile_shift", "centre_distance_mm", "tip_diameters_mm", "contact_ratio")
"""Keys of [pair] that describe gears other than standard ones."""

RULES = Rules()


@RULES.reads("integration", "scene")
def _series_are_for_machines(config: GearPairTables) -> Iterator[Fault]:
    method = config.integration.method
    if METHODS[method].for_machines:
        rule = 'is for machines: model.kind = "linear" or "train"'
        known = DEFAULT if "friction" in config.scene.effects else EXACT
        yield Fault("integration.method", rule, f'set it to "{known.name}"', method)


@RULES.reads("mesh")
def _one_damping(config: GearPairTables) -> Iterator[Fault]:
    ratio, damping = "mesh.damping_ratio", "mesh.damping_N_s_per_m"
    swept, given = config.swept, config.physical
    if all(path in swept or given[path] is not None for path in (ratio, damping)):
        rule = f"{ratio} is swept" if ratio in swept else f"{ratio} = {given[ratio]} is given"
        yield Fault(damping, f"{rule} as well", "keep one of the two", given[damping])


@RULES.reads("mesh")
def _length_scale_is_known(config: GearPairTables) -> Iterator[Fault]:
    scale, swept, given = "mesh.length_scale_um", config.swept, config.physical
    if given[scale] is not None or scale in swept:
        return
    rule = "is also the length scale, so that sweeping it would change the unit of every length"
    for backlash in BACKLASHES:
        if given[backlash] == 0:
            yield Fault(backlash, "cannot be the length scale when it is 0", f"give {scale}", 0.0)
        if config.mesh and backlash in swept:
            yield Fault(swept[backlash], rule, f"give {scale}", backlash)
    rule = "changes the half backlash, which is also the length scale, the unit of every length"
    for path in ANGLES & swept.keys():
        if any(given[backlash] is not None for backlash in BACKLASHES[1:]):
            yield Fault(swept[path], rule, f"give {scale}", path)


@RULES.reads("mesh")
def _one_backlash(config: GearPairTables) -> Iterator[Fault]:
    swept, given = config.swept, config.physical
    first, *others = [path for path in BACKLASHES if path in swept or given[path] is not None] or [
        ""
    ]
    for path in others:
        rule = f"{first} is swept" if first in swept else f"{first} = {given[first]} is given"
        yield Fault(path, f"{rule} as well", "keep one of them", given[path])


@RULES.reads("mesh", "pair")
def _backlash_can_be_converted(config: GearPairTables) -> Iterator[Fault]:
    for path in BACKLASHES[1:]:
        if config.pair is None and (path in config.swept or config.physical[path] is not None):
            rule = "is converted by the angles of [pair], which is missing"
            yield Fault(path, rule, f"give [pair], or {BACKLASHES[0]}", config.physical[path])


@RULES.reads("mesh")
def _one_mean_stiffness(config: GearPairTables) -> Iterator[Fault]:
    path, given = "mesh.mean_stiffness_N_per_um_mm", config.physical
    unit = given["mesh.stiffness.unit"]
    if given["mesh.stiffness.shape"] != "table":
        return
    if unit is None:
        rule = f"is missing, must be one of {', '.join(IN_N_PER_UM)}, {PER_WIDTH}, 1"
        remedy = 'name it in the heading of the column, or give unit; "1" is relative to the mean'
        yield Fault("mesh.stiffness.unit", rule, remedy)
    elif unit != "1" and (given[path] is not None or path in config.swept):
        rule = f"is given or swept beside a table of the stiffness in {unit}, which has its mean"
        remedy = 'keep one of the two; with unit = "1" the table gives the shape alone'
        yield Fault(path, rule, remedy, given[path])


@RULES.reads("mesh", "pair")
def _contact_ratio_is_known(config: GearPairTables) -> Iterator[Fault]:
    if config.pair is None and config.physical["mesh.stiffness.shape"] == "trapezoid":
        rule = "a trapezoid takes its shape from the contact ratio of [pair]"
        yield Fault("mesh.stiffness", rule, 'give [pair], or shape = "fourier"')


@RULES.reads("pair")
def _geometry_is_possible(config: GearPairTables) -> Iterator[Fault]:
    pair = config.pair
    if pair is None or all(getattr(pair, name) is None for name in GEOMETRY):
        return
    if "pair.centre_distance_mm" in config.swept and pair.profile_shift is not None:
        rule = "is given, and the centre distance that belongs to it is swept"
        remedy = "leave it out, and give tip_diameters_mm or contact_ratio"
        yield Fault("pair.profile_shift", rule, remedy, pair.profile_shift)
        return
    names = ("centre_distance", "contact_ratio", "tip_diameters")
    paths = {name: next(p for p in GEOMETRY if p.startswith(name)) for name in names}
    paths = {name: f"pair.{path}" for name, path in paths.items()}
    with np.errstate(all="ignore"):
        yield from geometry_faults(Quantities(config.physical).pair, paths)


def _states_exist(table: str, key: str, config: GearPairTables) -> Iterator[Fault]:
    names, states = getattr(getattr(config, table), key), config.scene.states
    for name in dict.fromkeys(names):
        if name not in states:
            effect = "transverse" if name.startswith(("delta_1", "delta_2")) else "axial"
            remedy = f'add "{effect}" to scene.effects, which now give {", ".join(states)}'
            rule = f"the scene has no state `{name}`"
            yield Fault(f"{table}.{key}", rule, remedy, tuple(names))


for _table, _keys in (("outputs", ("section", "states")), ("start", ("state", "box", "drawn"))):
    for _key in _keys:
        RULES.reads("scene", _table)(partial(_states_exist, _table, _key))


@RULES.reads("outputs", "scene", "integration")
def _contact_follows_from_crossings(config: GearPairTables) -> Iterator[Fault]:
    crosses = "backlash" in config.scene.effects and config.integration.crossings == "resolved"
    if config.outputs.contact and not crosses:
        rule = "follows from the crossings of clearance boundaries, and there are none"
        remedy = 'add "backlash" to scene.effects and set integration.crossings = "resolved"'
        yield Fault("outputs.contact", rule, remedy, True)
