"""Rules of the sweep, and of the groups that every lane has to know."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gearchaos.configuration.keys import suggestion
from gearchaos.configuration.messages import Fault
from gearchaos.configuration.physical_tables import PHYSICAL_TABLES
from gearchaos.configuration.rules import Rule
from gearchaos.configuration.sweep_values import (
    SWEEPABLE_GROUPS,
    SWEEPABLE_KEYS,
    groups_at,
    groups_moved_by,
    swept_values,
)
from gearchaos.errors import ConfigurationError
from gearchaos.gear.group_table import GROUP_TABLE, GROUPS_BY_NAME, GroupRow
from gearchaos.gear.groups import Groups

if TYPE_CHECKING:
    from gearchaos.configuration.models import Configuration


def _parameter_is_known(config: Configuration) -> Iterator[Fault]:
    parameter = config.sweep.parameter
    if parameter in SWEEPABLE_GROUPS or parameter in SWEEPABLE_KEYS:
        return
    near = suggestion(parameter, [*SWEEPABLE_GROUPS, *SWEEPABLE_KEYS])
    if parameter in GROUPS_BY_NAME:
        near, rule = "sweep stiffness_variation_scale", "a list of harmonics cannot be swept"
    elif parameter.startswith("bearings."):
        near, rule = f"sweep {_bearing_group(parameter)}", "holds two values, so it cannot be swept"
    else:
        rule = "is not a parameter that can be swept"
    remedy = near or (
        f"groups: {', '.join(SWEEPABLE_GROUPS)}; physical keys: {', '.join(SWEEPABLE_KEYS)}"
    )
    yield Fault("sweep.parameter", rule, remedy, parameter)


def _bearing_group(path: str) -> str:
    kind = "_".join(path.removeprefix("bearings.").split("_")[:2])
    return f"{kind}_p or {kind}_g"


def _values_or_span(config: Configuration) -> Iterator[Fault]:
    sweep = config.sweep
    span = {"from": sweep.from_, "to": sweep.to, "count": sweep.count}
    if sweep.values is not None:
        for name, value in span.items():
            if value is not None:
                remedy = "keep either `values` or `from`, `to` and `count`"
                yield Fault(f"sweep.{name}", "sweep.values is given as well", remedy, value)
        return
    for name, value in span.items():
        if value is None and not (name == "to" and sweep.count == 1):
            remedy = "give `from`, `to` and `count`, or `values`"
            yield Fault(f"sweep.{name}", "is missing", remedy)


def _values_are_distinct(config: Configuration) -> Iterator[Fault]:
    sweep = config.sweep
    if sweep.values is not None:
        values = np.sort(sweep.values)
        for value in np.unique(values[1:][values[1:] == values[:-1]]):
            yield Fault("sweep.values", f"lists {value:.12g} twice", "list it once", sweep.values)
    elif sweep.from_ is not None and sweep.to is not None and (sweep.count or 0) > 1:
        if sweep.to <= sweep.from_:
            remedy = "exchange the two; start.carry says in which direction a sweep runs"
            rule = f"must be greater than sweep.from = {sweep.from_}"
            yield Fault("sweep.to", rule, remedy, sweep.to)
        elif not math.isfinite((sweep.to - sweep.from_) * (sweep.count or 1)):
            yield Fault("sweep.to", "is too far from sweep.from", "narrow the sweep", sweep.to)
        elif (sweep.to - sweep.from_) / (sweep.count or 1) < 2 * np.spacing(abs(sweep.to)):
            remedy = "lower the count or widen the sweep"
            rule = "so many values between sweep.from and sweep.to would coincide"
            yield Fault("sweep.count", rule, remedy, sweep.count)


def _values_are_in_range(config: Configuration) -> Iterator[Fault]:
    sweep = config.sweep
    group = SWEEPABLE_GROUPS.get(sweep.parameter)
    key = SWEEPABLE_KEYS.get(sweep.parameter)
    named = [("from", sweep.from_), ("to", sweep.to)]
    if sweep.values is not None:
        named = [("values", min(sweep.values)), ("values", max(sweep.values))]
    for name, value in named:
        if value is None or (name == "to" and sweep.count == 1):
            continue
        if group is not None and not group.admits(value):
            rule = f"{group.name} must be {group.rule}"
        elif key is not None and not key.admits(value):
            rule = f"{key.path} must be {key.bounds}"
        else:
            continue
        yield Fault(f"sweep.{name}", rule, "sweep inside that range", value)


def _swept_effect_is_on(config: Configuration) -> Iterator[Fault]:
    row = SWEEPABLE_GROUPS.get(config.sweep.parameter)
    if row is not None and not row.needed_by(config.scene.effects):
        effects = " or ".join(f'"{name}"' for name in sorted(row.effects))
        yield Fault(
            "sweep.parameter",
            "belongs to an effect that is off, so sweeping it changes nothing",
            f"add {effects} to scene.effects",
            row.name,
        )


def _swept_effect_is_kept(config: Configuration) -> Iterator[Fault]:
    row = SWEEPABLE_GROUPS.get(config.sweep.parameter)
    unused = set(config.scene.effects) - set(config.needed_effects)
    if row is not None and row.effects and row.effects <= unused:
        yield Fault(
            "sweep.parameter",
            "acts on the axial pair only, and nothing that is kept depends on that",
            "add an axial state such as delta_3 to outputs.section, or set outputs.lyapunov = true",
            row.name,
        )


def _groups_are_known_and_move(config: Configuration) -> Iterator[Fault]:
    values = swept_values(config)
    # The groups are smooth in every parameter: both ends of the sweep and a value between them
    # stand for millions of lanes.
    some = np.unique(values[[0, values.size // 2, -1]])
    try:
        with np.errstate(all="ignore"):
            groups = groups_at(config, some)
            moved = _moved(config, groups, some)
    except ConfigurationError as error:
        yield from (
            Fault("sweep.parameter", text, "", config.sweep.parameter) for text in error.problems
        )
        return
    except (ArithmeticError, ValueError) as error:
        remedy = "check the magnitudes in [pair], [mesh], [operation], [pitch_error], [bearings]"
        yield Fault("groups", f"cannot be derived from the physical tables ({error})", remedy)
        return
    missing = groups.missing(config.scene.effects)
    yield from (_missing(config, row) for row in missing)
    yield from _out_of_range(groups)
    yield from _decoupled(config, groups)
    if not missing and not moved and config.sweep.parameter in SWEEPABLE_KEYS:
        yield _without_effect(config, some)


def _moved(config: Configuration, groups: Groups, values: npt.NDArray[np.float64]) -> bool:
    needed = [row for row in GROUP_TABLE if row.needed_by(config.scene.effects) and row.sweepable]
    found = [getattr(groups, row.name) for row in needed]
    return any(
        np.ndim(value) > 0 and (values.size == 1 or not np.allclose(value, value[0], 1e-12, 0.0))
        for value in found
        if value is not None
    )


def _without_effect(config: Configuration, values: npt.NDArray[np.float64]) -> Fault:
    parameter = config.sweep.parameter
    names = groups_moved_by(config, parameter, values)
    given = [name for name in names if name in config.groups.given()]
    off = [name for name in names if not GROUPS_BY_NAME[name].needed_by(config.scene.effects)]
    if given:
        remedy = f"remove {', '.join(given)} from [groups], where a group wins over a derived one"
    elif off:
        effects = sorted(set().union(*(GROUPS_BY_NAME[name].effects for name in off)))
        remedy = f"add {' or '.join(effects)} to scene.effects: it acts on {', '.join(off)} only"
    else:
        remedy = "no group follows from it with the tables given; sweep a group instead"
    return Fault("sweep.parameter", "changes nothing in this scene", remedy, parameter)


def _missing(config: Configuration, row: GroupRow) -> Fault:
    effects = [f'"{name}"' for name in config.scene.effects if name in row.effects]
    because = f" for {' and '.join(effects)}" if effects else ""
    lacking = [entry for entry in row.derived_from if not _is_present(config, entry)]
    otherwise = f", or derive it by giving {', '.join(lacking)} as well" if lacking else ""
    return Fault(
        f"groups.{row.name}",
        f"the {row.long_name} ({row.symbol}) is needed{because} and neither given nor derivable",
        f"give {row.name} in [groups]{otherwise}",
    )


def _is_present(config: Configuration, entry: str) -> bool:
    for path in re.findall(r"[A-Za-z_][\w.]+", entry):
        table, _, name = path.partition(".")
        if table not in PHYSICAL_TABLES:
            continue
        model = getattr(config, table)
        if path == config.sweep.parameter or (
            model is not None and (not name or getattr(model, name) is not None)
        ):
            return True
    return False


def _out_of_range(groups: Groups) -> Iterator[Fault]:
    for row in GROUP_TABLE:
        value = getattr(groups, row.name)
        if groups.origin.get(row.name) == "derived" and not row.admits(value):
            worst = np.ravel(value)[np.argmin([row.admits(entry) for entry in np.ravel(value)])]
            yield Fault(
                f"groups.{row.name}",
                f"derived from {', '.join(row.derived_from)}, must be {row.rule}",
                "check the magnitudes of those keys",
                float(worst),
            )


def _decoupled(config: Configuration, groups: Groups) -> Iterator[Fault]:
    angle = groups.base_helix_angle_deg
    if "axial" in config.scene.effects and angle is not None and np.all(np.equal(angle, 0.0)):
        yield Fault(
            "scene.effects",
            '"axial" needs a helix angle: in a spur pair nothing drives the axial motion',
            'drop "axial", or give pair.helix_angle_deg or groups.base_helix_angle_deg',
            config.scene.effects,
        )


SWEEP_RULES: tuple[tuple[frozenset[str], Rule], ...] = (
    (frozenset({"sweep"}), _parameter_is_known),
    (frozenset({"sweep"}), _values_or_span),
    (frozenset({"sweep"}), _values_are_distinct),
    (frozenset({"sweep"}), _values_are_in_range),
    (frozenset({"sweep", "scene"}), _swept_effect_is_on),
    (frozenset({"sweep", "scene", "outputs"}), _swept_effect_is_kept),
)
"""Each rule with the tables it reads, as in `gearchaos.configuration.rules`."""

LANE_RULES: tuple[tuple[frozenset[str], Rule], ...] = (
    (frozenset({"sweep", "scene", "groups", *PHYSICAL_TABLES}), _groups_are_known_and_move),
)
"""Rules that derive the groups, for tables that break none of the other rules."""
