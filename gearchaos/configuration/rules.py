"""Rules between keys of a configuration, for any model."""

import math
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from gearchaos.configuration.messages import Fault
from gearchaos.configuration.methods import DEFAULT, METHODS
from gearchaos.configuration.ranges import LARGEST_VALUE
from gearchaos.configuration.run_tables import MOST_RUN_LANES, Start
from gearchaos.configuration.tables import Tables

Rule: TypeAlias = Callable[[Any], Iterator[Fault]]


class Rules(list[tuple[frozenset[str], Rule]]):
    """Rules, each with the tables that must be free of faults before it is checked."""

    def reads(self, *tables: str) -> Callable[[Rule], Rule]:
        """Register a function as a rule that reads these tables and all readable sweeps."""

        def listed(check: Rule) -> Rule:
            self.append((frozenset(tables), check))
            return check

        return listed


GENERIC_RULES = Rules()


@GENERIC_RULES.reads("start")
def _start_keys_belong_to_the_kind(config: Tables) -> Iterator[Fault]:
    """Keys of [start] suit its kind, and ranges are in order and not given twice."""
    start, default = config.start, Start[str]()
    kind, boxed = start.kind, " and a box" if start.box else ""
    needed = {"given": ("state", "delta_5 = 1.0"), "grid": ("box", "delta_5 = [-2.0, 2.0]")}
    name, example = needed.get(kind, ("kind", ""))
    if not getattr(start, name):
        remedy = f"such as {name} = {{ {example} }}"
        yield Fault(f"start.{name}", f'is missing with kind = "{kind}"', remedy)
    drawn, grid = kind == "random", kind == "grid"
    homes = {
        "state": (kind == "given" or boxed, 'kind = "given" or a box'),
        "box": (grid or drawn, 'kind = "grid" or "random"'),
        "drawn": (grid, 'kind = "grid"'),
        "count": (grid or drawn, 'kind = "grid" or "random"'),
        "spread": (drawn and not boxed, 'kind = "random" without a box'),
        "seed": (drawn or bool(start.drawn), 'kind = "random" or states that are drawn'),
    }
    for name, (at_home, home) in homes.items():
        value = getattr(start, name)
        if not at_home and value != getattr(default, name):
            rule = f'has no meaning with start.kind = "{kind}"{boxed}'
            yield Fault(f"start.{name}", rule, f"it goes with {home}", value)
    for key, box in (("box", start.box), ("drawn", start.drawn)):
        for name, bounds in box.items():
            if not bounds[0] < bounds[1]:
                rule = "must be the lowest value and the highest one"
                yield Fault(f"start.{key}.{name}", rule, "exchange or widen them", bounds)
            other = "state" if name in start.state else "box"
            if name in start.state or (key == "drawn" and name in start.box):
                rule = f"start.{other} has a value of it as well"
                yield Fault(f"start.{key}.{name}", rule, "keep one of the two", bounds)


@GENERIC_RULES.reads("outputs", "integration")
def _section_points_are_recorded(config: Tables) -> Iterator[Fault]:
    """The kept section points are at most the recorded periods."""
    points, periods = config.outputs.section_points, config.integration.recorded_periods
    if points > periods:
        rule = f"must be at most integration.recorded_periods = {periods}"
        remedy = "record more periods or keep fewer points"
        yield Fault("outputs.section_points", rule, remedy, points)


@GENERIC_RULES.reads("outputs", "start")
def _exponents_are_not_carried(config: Tables) -> Iterator[Fault]:
    """All exponents are only computed without carried starts."""
    if config.outputs.exponents and config.start.carry != "none":
        rule = f'cannot be computed with start.carry = "{config.start.carry}"'
        remedy = 'set start.carry = "none", or compute the exponents in a sweep of its own'
        yield Fault("outputs.exponents", rule, remedy, True)


@GENERIC_RULES.reads("integration")
def _plain_steps_need_a_method_with_a_choice(config: Tables) -> Iterator[Fault]:
    """Plain steps need a method that does not resolve every crossing."""
    method = config.integration.method
    if METHODS[method].always_resolved and config.integration.crossings == "plain":
        rule = f'has no meaning with integration.method = "{method}", which resolves every crossing'
        yield Fault(
            "integration.crossings", rule, f'it goes with method = "{DEFAULT.name}"', "plain"
        )


@GENERIC_RULES.reads("scene", "integration")
def _maps_know_the_effects(config: Tables) -> Iterator[Fault]:
    """A method with maps can compute all effects of the scene."""
    effect, method = config.scene.refuses_maps(), config.integration.method
    if effect and METHODS[method].shares_maps:
        rule = f'"{effect}" cannot be computed with integration.method = "{method}"'
        remedy = f'set integration.method = "{DEFAULT.name}"'
        yield Fault("scene.effects", rule, remedy, config.scene.effects)


@GENERIC_RULES.reads("outputs", "integration")
def _errors_are_measured_on_a_section(config: Tables) -> Iterator[Fault]:
    """A tolerance or an error check needs a section."""
    if config.outputs.section:
        return
    for name in ("tolerance", "error_check"):
        if value := getattr(config.integration, name):
            rule = "needs a section to measure errors on"
            yield Fault(f"integration.{name}", rule, "keep a state in outputs.section", value)


def unknown_parameter(config: Tables, key: str, parameter: str) -> Iterator[Fault]:
    """Yield the fault of a parameter that cannot be swept; ``key`` has its name."""
    if parameter not in config.parameters:
        remedy = config.parameter_remedy(parameter)
        yield Fault(key, "is not a parameter that can be swept", remedy, parameter)


@GENERIC_RULES.reads()
def _parameter_is_known(config: Tables) -> Iterator[Fault]:
    """Every swept parameter exists."""
    for table, sweep in config.sweeps.items():
        yield from unknown_parameter(config, f"{table}.parameter", sweep.parameter)


@GENERIC_RULES.reads()
def _parameters_differ(config: Tables) -> Iterator[Fault]:
    """The two sweeps have different parameters."""
    parameters = [sweep.parameter for sweep in config.sweeps.values()]
    if len(set(parameters)) < len(parameters):
        remedy = "sweep another parameter, or drop [second_sweep]"
        rule = "is what [sweep] sweeps already"
        yield Fault("second_sweep.parameter", rule, remedy, parameters[0])


@GENERIC_RULES.reads()
def _values_are_in_range(config: Tables) -> Iterator[Fault]:
    """All swept values are within the range of their parameter."""
    for table, sweep in config.sweeps.items():
        known = config.parameters.get(sweep.parameter)
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


@GENERIC_RULES.reads("start")
def _lanes_are_not_too_many(config: Tables) -> Iterator[Fault]:
    """The product of all axes is at most `MOST_RUN_LANES`."""
    counts = {f"values of [{table}]": sweep.size for table, sweep in config.sweeps.items()}
    counts[config.realisation_words] = config.realisations.size
    counts["starts"] = config.start.size
    counts["directions"] = 2 if config.start.carry == "both" else 1
    lanes = math.prod(counts.values())
    if lanes > MOST_RUN_LANES:
        product = " x ".join(f"{count} {name}" for name, count in counts.items() if count > 1)
        rule = f"{product} make {lanes} lanes, must be at most {MOST_RUN_LANES}"
        yield Fault(list(config.sweeps)[-1], rule, "lower a count, or split it into several runs")
