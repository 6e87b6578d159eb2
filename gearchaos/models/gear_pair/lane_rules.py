"""Rules of the lanes of gear pairs: that their groups are known, in range, and moved by a sweep."""

from collections.abc import Iterator

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.configuration.messages import Fault
from gearchaos.configuration.run_tables import Sweep
from gearchaos.configuration.tables import OF_CONTROLLERS, swept_values
from gearchaos.models.gear_pair.derivation import derive_groups, paths_behind
from gearchaos.models.gear_pair.group_table import (
    GROUPS_BY_NAME,
    HARMONICS,
    SWEEPABLE_GROUPS,
    GroupRow,
)
from gearchaos.models.gear_pair.groups import ResolvedGroups
from gearchaos.models.gear_pair.pitch_errors import OF_DRAWN_GEARS, grade_faults
from gearchaos.models.gear_pair.tables import PHYSICAL_KEYS, GearPairTables, groups_at

MOST_OWN_HARMONICS = 40
"""Largest number of harmonics that differ between lanes: each is a term of compiled formulas."""


def lane_faults(config: GearPairTables) -> Iterator[Fault]:
    """Yield the faults of the groups of the lanes, if every single table is sound."""
    sweeps = config.sweeps
    # The groups are smooth in every parameter: both ends of a sweep and a value between them
    # represent millions of lanes. The axes are in the order of `axis_values`.
    by_parameter = {one.parameter: _some_values(one) for one in reversed(sweeps.values())}
    some = dict(zip(by_parameter, np.ix_(*by_parameter.values()), strict=True))
    try:
        groups = groups_at(config, some)
    except (ArithmeticError, ValueError) as error:
        remedy = "check the magnitudes in [pair], [mesh], [operation], [pitch_error], [bearings]"
        yield Fault("groups", f"cannot be derived from the physical tables ({error})", remedy)
        return
    missing = groups.missing(config.scene.effects)
    yield from grade_faults(config, by_parameter)
    yield from (_missing(config, row) for row in missing)
    yield from _out_of_range(config, groups)
    yield from _decoupled(config, groups)
    yield from _too_many_harmonics(config, groups)
    for axis, (table, sweep) in enumerate(reversed(sweeps.items())):
        drawn = sweep.parameter in OF_DRAWN_GEARS and "pitch_error" in config.scene.effects
        known = sweep.parameter in SWEEPABLE_GROUPS or not missing
        own = sweep.parameter in OF_CONTROLLERS
        if known and not drawn and not own and not _moved(config, groups, axis, sweep.size):
            yield _without_effect(config, table, some[sweep.parameter])


def _some_values(sweep: Sweep) -> Floats:
    """Return the ends of a sweep and a value between them; a value that is alone comes twice."""
    values = swept_values(sweep)
    some = values[[0, values.size // 2, -1]]
    return np.unique(some) if values.size > 1 else some[:2]


def _moved(config: GearPairTables, groups: ResolvedGroups, axis: int, count: int) -> bool:
    """Whether a sweep, along this axis, changes a group on which what is kept depends."""
    for name, value in groups.values.items():
        row = GROUPS_BY_NAME[name]
        if np.ndim(value) > row.is_list and row.needed_by(config.needed_effects):
            along = np.moveaxis(np.asarray(value), axis, 0)
            if len(along) > 1 and (count == 1 or not np.allclose(along, along[:1], 1e-12, 0.0)):
                return True
    return False


def _without_effect(config: GearPairTables, table: str, values: Floats) -> Fault:
    parameter, swept = config.sweeps[table].parameter, config.swept
    derived = derive_groups({**config.physical, parameter: values})
    names = [
        name for name, value in derived.items() if np.ndim(value) > GROUPS_BY_NAME[name].is_list
    ]
    stronger = [name for name in names if name in swept or name in config.groups.given()]
    rows = [GROUPS_BY_NAME[name] for name in names or [parameter] if name in GROUPS_BY_NAME]
    off = [row for row in rows if not row.needed_by(config.scene.effects)]
    rule = "changes nothing in this scene"
    if stronger:
        rule += ", where a group that is given or swept wins over a derived one"
        remedy = f"leave out {', '.join(stronger)}, or sweep another parameter"
    elif off:
        effects = [f'"{name}"' for name in sorted(set().union(*(row.effects for row in off)))]
        rule += ", for it acts on an effect that is off"
        remedy = f"add {' or '.join(effects)} to scene.effects"
    elif rows and not any(row.needed_by(config.needed_effects) for row in rows):
        rule = "acts on the axial pair only, and nothing that is kept depends on that"
        remedy = "keep delta_3 or the like in outputs.section, or set outputs.lyapunov = true"
    else:
        remedy = "no group follows from it with the tables given; sweep a group instead"
    return Fault(f"{table}.parameter", rule, remedy, parameter)


def _missing(config: GearPairTables, row: GroupRow) -> Fault:
    effects = [f'"{name}"' for name in config.scene.effects if name in row.effects]
    because = f" for {' and '.join(effects)}" if effects else ""
    lacking = [
        path for path in paths_behind(row.name, config.physical) if _is_unknown(config, path)
    ]
    otherwise = f", or derive it by giving {', '.join(lacking)} as well" if lacking else ""
    name = f"the {row.long_name} ({row.symbol})"
    rule = f"{name} is needed{because} and neither given nor derivable"
    return Fault(f"groups.{row.name}", rule, f"give {row.name} in [groups]{otherwise}")


def _is_unknown(config: GearPairTables, path: str) -> bool:
    """Whether a physical key is neither given nor swept, and has no default either."""
    field, value = PHYSICAL_KEYS[path].field, config.physical[path]
    has_default = not field.is_required() and field.default is not None
    return value is None and path not in config.swept and not has_default


def _out_of_range(config: GearPairTables, groups: ResolvedGroups) -> Iterator[Fault]:
    for name, value in groups.values.items():
        row = GROUPS_BY_NAME[name]
        if groups.origin[name] == "derived" and not row.valid.admits(value):
            worst = next(entry for entry in np.ravel(value) if not row.valid.admits(entry))
            paths = ", ".join(paths_behind(name, config.physical))
            rule = f"derived from {paths}, must be {row.valid.rule}"
            remedy = "check the magnitudes of those keys"
            yield Fault(f"groups.{name}", rule, remedy, float(worst))


def _too_many_harmonics(config: GearPairTables, groups: ResolvedGroups) -> Iterator[Fault]:
    waves = groups.values.get(HARMONICS[0], 0.0)
    if np.ndim(waves) < 2 or np.shape(waves)[-1] <= MOST_OWN_HARMONICS:
        return
    key = "harmonics" if config.physical["mesh.stiffness.harmonics"] else "cosine_N_per_um_mm"
    swept = " or ".join(config.swept)
    rule = f"gives more than {MOST_OWN_HARMONICS} harmonics, and {swept} changes them in each lane"
    remedy = f"keep at most {MOST_OWN_HARMONICS}, or sweep another parameter"
    yield Fault(f"mesh.stiffness.{key}", rule, remedy, int(np.shape(waves)[-1]))


def _decoupled(config: GearPairTables, groups: ResolvedGroups) -> Iterator[Fault]:
    effects, angle = config.scene.effects, groups.base_helix_angle_deg
    if "axial" in effects and angle is not None and np.all(np.equal(angle, 0.0)):
        rule = '"axial" needs a helix angle: in a spur pair nothing drives the axial motion'
        remedy = 'drop "axial", or give pair.helix_angle_deg or groups.base_helix_angle_deg'
        yield Fault("scene.effects", rule, remedy, effects)
