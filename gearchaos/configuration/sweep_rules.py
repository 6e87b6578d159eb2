"""Rules of each sweep: its parameter and its values."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from gearchaos.configuration.messages import Fault, suggestion
from gearchaos.configuration.rules import reads
from gearchaos.configuration.run_tables import MOST_LANES, Sweep
from gearchaos.configuration.sweep_values import SWEEPABLE_GROUPS, SWEEPABLE_KEYS
from gearchaos.gear.group_table import GROUPS_BY_NAME

if TYPE_CHECKING:
    from gearchaos.configuration.models import Configuration

SweepRule: TypeAlias = "Callable[[str, Sweep, Configuration], Iterator[Fault]]"


def _of_each_sweep(*tables: str) -> Callable[[SweepRule], SweepRule]:
    """Make a function of table name, sweep and configuration a rule of every sweep."""

    def listed(check: SweepRule) -> SweepRule:
        @reads(*tables)
        def _every(config: Configuration) -> Iterator[Fault]:
            for name, sweep in config.sweeps.items():
                yield from check(name, sweep, config)

        return check

    return listed


def unknown_parameter(key: str, parameter: str) -> Iterator[Fault]:
    """Yield the fault of a parameter, given under some key, that cannot be swept."""
    if parameter in SWEEPABLE_GROUPS or parameter in SWEEPABLE_KEYS:
        return
    rule = "is not a parameter that can be swept"
    remedy = suggestion(parameter, [*SWEEPABLE_GROUPS, *SWEEPABLE_KEYS]) or (
        f"groups: {', '.join(SWEEPABLE_GROUPS)}; physical keys: {', '.join(SWEEPABLE_KEYS)}"
    )
    if parameter in GROUPS_BY_NAME:
        rule, remedy = "a list of harmonics cannot be swept", "sweep stiffness_variation_scale"
    elif parameter.startswith("bearings."):
        group = "_".join(parameter.removeprefix("bearings.").split("_")[:2])
        rule = "holds two values, so it cannot be swept"
        remedy = f"sweep {group}_p or {group}_g"
    yield Fault(key, rule, remedy, parameter)


@_of_each_sweep()
def _parameter_is_known(table: str, sweep: Sweep, _: Configuration) -> Iterator[Fault]:
    yield from unknown_parameter(f"{table}.parameter", sweep.parameter)


@reads()
def _parameters_differ(config: Configuration) -> Iterator[Fault]:
    parameters = [sweep.parameter for sweep in config.sweeps.values()]
    if len(set(parameters)) < len(parameters):
        remedy = "sweep another parameter, or drop [second_sweep]"
        yield Fault(
            "second_sweep.parameter", "is what [sweep] sweeps already", remedy, parameters[0]
        )


@_of_each_sweep()
def _values_or_span(table: str, sweep: Sweep, _: Configuration) -> Iterator[Fault]:
    span = {"from": sweep.from_, "to": sweep.to, "count": sweep.count}
    for name, value in span.items():
        if sweep.values is not None and value is not None:
            remedy = "keep either `values` or `from`, `to` and `count`"
            yield Fault(f"{table}.{name}", f"{table}.values is given as well", remedy, value)
        elif sweep.values is None and value is None and not (name == "to" and sweep.count == 1):
            remedy = "give `from`, `to` and `count`, or `values`"
            yield Fault(f"{table}.{name}", "is missing", remedy)


@_of_each_sweep()
def _values_are_distinct(table: str, sweep: Sweep, _: Configuration) -> Iterator[Fault]:
    first, last, count = sweep.from_, sweep.to, sweep.count or 0
    if sweep.values is not None:
        values = np.sort(sweep.values)
        for value in np.unique(values[1:][values[1:] == values[:-1]]):
            yield Fault(
                f"{table}.values", f"lists {value:.12g} twice", "list it once", sweep.values
            )
    elif first is not None and last is not None and count > 1:
        if last <= first:
            remedy = "exchange the two; start.carry says in which direction a sweep runs"
            yield Fault(f"{table}.to", f"must be greater than {table}.from = {first}", remedy, last)
        elif not math.isfinite((last - first) * count):
            yield Fault(f"{table}.to", f"is too far from {table}.from", "narrow the sweep", last)
        elif (last - first) / count < 2 * np.spacing(abs(last)):
            rule = f"so many values between {table}.from and {table}.to would coincide"
            remedy = "lower the count or widen the sweep"
            yield Fault(f"{table}.count", rule, remedy, count)


@_of_each_sweep()
def _values_are_in_range(table: str, sweep: Sweep, _: Configuration) -> Iterator[Fault]:
    known = SWEEPABLE_GROUPS.get(sweep.parameter) or SWEEPABLE_KEYS.get(sweep.parameter)
    named = [("from", sweep.from_), ("to", None if sweep.count == 1 else sweep.to)]
    if sweep.values is not None:
        named = [("values", min(sweep.values)), ("values", max(sweep.values))]
    for name, value in named:
        if known is not None and value is not None and not known.valid.admits(value):
            rule = f"{sweep.parameter} must be {known.valid.rule}"
            yield Fault(f"{table}.{name}", rule, "sweep inside that range", value)


@_of_each_sweep("scene")
def _swept_effect_is_on(table: str, sweep: Sweep, config: Configuration) -> Iterator[Fault]:
    row = SWEEPABLE_GROUPS.get(sweep.parameter)
    if row is not None and not row.needed_by(config.scene.effects):
        effects = " or ".join(f'"{name}"' for name in sorted(row.effects))
        yield Fault(
            f"{table}.parameter",
            "belongs to an effect that is off, so sweeping it changes nothing",
            f"add {effects} to scene.effects",
            row.name,
        )


@_of_each_sweep("scene", "outputs")
def _swept_effect_is_kept(table: str, sweep: Sweep, config: Configuration) -> Iterator[Fault]:
    row = SWEEPABLE_GROUPS.get(sweep.parameter)
    unused = set(config.scene.effects) - set(config.needed_effects)
    if row is not None and row.effects and row.effects <= unused:
        yield Fault(
            f"{table}.parameter",
            "acts on the axial pair only, and nothing that is kept depends on that",
            "add an axial state such as delta_3 to outputs.section, or set outputs.lyapunov = true",
            row.name,
        )


@reads("start")
def _lanes_are_not_too_many(config: Configuration) -> Iterator[Fault]:
    counts = {f"{name}.count": sweep.size for name, sweep in config.sweeps.items()}
    counts["start.count"] = config.start.count
    lanes = math.prod(counts.values())
    if lanes > MOST_LANES:
        product = " x ".join(f"{count} ({key})" for key, count in counts.items() if count > 1)
        rule = f"{product} make {lanes} lanes, must be at most {MOST_LANES}"
        yield Fault(list(config.sweeps)[-1], rule, "lower a count, or split it into several runs")
