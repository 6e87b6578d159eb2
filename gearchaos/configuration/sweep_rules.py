"""Rules of each sweep: its parameter and its values."""

import math
from collections.abc import Iterator

import numpy as np

from gearchaos.configuration.messages import Fault, suggestion
from gearchaos.configuration.rules import reads
from gearchaos.configuration.run_tables import MOST_LANES
from gearchaos.configuration.sweep_values import SWEEPABLE_GROUPS, SWEEPABLE_KEYS
from gearchaos.configuration.tables import Tables
from gearchaos.gear.groups import GROUPS_BY_NAME, LARGEST_VALUE


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


@reads()
def _parameter_is_known(config: Tables) -> Iterator[Fault]:
    for table, sweep in config.sweeps.items():
        yield from unknown_parameter(f"{table}.parameter", sweep.parameter)


@reads()
def _parameters_differ(config: Tables) -> Iterator[Fault]:
    parameters = [sweep.parameter for sweep in config.sweeps.values()]
    if len(set(parameters)) < len(parameters):
        remedy = "sweep another parameter, or drop [second_sweep]"
        rule = "is what [sweep] sweeps already"
        yield Fault("second_sweep.parameter", rule, remedy, parameters[0])


@reads()
def _values_or_span(config: Tables) -> Iterator[Fault]:
    for table, sweep in config.sweeps.items():
        span = {"from": sweep.from_, "to": sweep.to, "count": sweep.count}
        for name, value in span.items():
            if sweep.values is not None and value is not None:
                remedy = "keep either `values` or `from`, `to` and `count`"
                yield Fault(f"{table}.{name}", f"{table}.values is given as well", remedy, value)
            elif sweep.values is None and value is None and not (name == "to" and sweep.count == 1):
                remedy = "give `from`, `to` and `count`, or `values`"
                yield Fault(f"{table}.{name}", "is missing", remedy)


@reads()
def _values_are_distinct(config: Tables) -> Iterator[Fault]:
    for table, sweep in config.sweeps.items():
        first, last, count = sweep.from_, sweep.to, sweep.count or 0
        if sweep.values is not None:
            values = np.sort(sweep.values)
            for value in np.unique(values[1:][values[1:] == values[:-1]]):
                rule = f"lists {value:.12g} twice"
                yield Fault(f"{table}.values", rule, "list it once", sweep.values)
        elif first is not None and last is not None and count > 1:
            if last <= first:
                rule = f"must be greater than {table}.from = {first}"
                remedy = "exchange the two; start.carry says in which direction a sweep runs"
                yield Fault(f"{table}.to", rule, remedy, last)
            elif (last - first) / count < 2 * np.spacing(abs(last)):
                rule = f"so many values between {table}.from and {table}.to would coincide"
                remedy = "lower the count or widen the sweep"
                yield Fault(f"{table}.count", rule, remedy, count)


@reads()
def _values_are_in_range(config: Tables) -> Iterator[Fault]:
    for table, sweep in config.sweeps.items():
        known = SWEEPABLE_GROUPS.get(sweep.parameter) or SWEEPABLE_KEYS.get(sweep.parameter)
        named = [("from", sweep.from_), ("to", None if sweep.count == 1 else sweep.to)]
        if sweep.values is not None:
            named = [("values", min(sweep.values)), ("values", max(sweep.values))]
        for name, value in named:
            if known is None or value is None:
                continue
            if not known.valid.admits(value) or abs(value) > LARGEST_VALUE:
                within = f"{known.valid.rule}, and at most {LARGEST_VALUE:g} in size"
                rule = f"{sweep.parameter} must be {within}"
                yield Fault(f"{table}.{name}", rule, "sweep inside that range", value)


@reads("start", "pitch_error")
def _lanes_are_not_too_many(config: Tables) -> Iterator[Fault]:
    counts = {f"values of [{table}]": sweep.size for table, sweep in config.sweeps.items()}
    counts["drawn gear pairs"] = getattr(config.pitch_error, "realisations", 1)
    counts["starts"] = config.start.size
    counts["directions"] = 2 if config.start.carry == "both" else 1
    lanes = math.prod(counts.values())
    if lanes > MOST_LANES:
        product = " x ".join(f"{count} {name}" for name, count in counts.items() if count > 1)
        rule = f"{product} make {lanes} lanes, must be at most {MOST_LANES}"
        yield Fault(list(config.sweeps)[-1], rule, "lower a count, or split it into several runs")
