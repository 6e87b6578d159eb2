"""Rules between keys of a configuration, for any model."""

import math
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from gearchaos.configuration.messages import Fault
from gearchaos.configuration.methods import DEFAULT, METHODS
from gearchaos.configuration.ranges import LARGEST_VALUE
from gearchaos.configuration.run_tables import MOST_RUN_LANES, Control, Start
from gearchaos.configuration.tables import (
    OF_CONTROLLERS,
    Tables,
    of_the_machine,
    swept_values,
)
from gearchaos.records.control import LIMITS

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
        rule = "is already swept by [sweep]"
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


@GENERIC_RULES.reads("control")
def _a_swept_controller_exists(config: Tables) -> Iterator[Fault]:
    """A key of [control] is swept only with a controller that depends on it."""
    control = config.control
    for table, sweep in config.sweeps.items():
        if sweep.parameter not in OF_CONTROLLERS:
            continue
        name = sweep.parameter.rpartition(".")[2]
        if control is None:
            rule, remedy = "belongs to a table that is missing", "add [control]"
            yield Fault(f"{table}.parameter", rule, remedy, sweep.parameter)
        elif control.gain == "placement" and name.endswith("_weight"):
            rule = 'has no meaning with control.gain = "placement"'
            yield Fault(f"{table}.parameter", rule, 'set gain = "lqr"', sweep.parameter)


@GENERIC_RULES.reads("control")
def _the_input_can_be_changed(config: Tables) -> Iterator[Fault]:
    """A controller changes an input that the model has, by a limit in one unit."""
    control = config.control
    if control is None:
        return
    fault = config.input_fault(control.actuator)
    if fault:
        where = "control.actuator" if config.actuators else "control"
        yield Fault(where, *fault, config.actuator_of(control.actuator) or None)
    yield from _limit_faults(config, control)


def _limit_faults(config: Tables, control: Control[str]) -> Iterator[Fault]:
    """The limit is given once, in a unit that the input has."""
    absolute = config.absolute_limit
    given = [
        name
        for name in LIMITS
        if getattr(control, name) is not None or f"control.{name}" in config.swept
    ]
    if len(given) != 1:
        rule = "is given in two units" if given else "is missing"
        remedy = f"give limit, a share, or {absolute}, or sweep one of them"
        yield Fault("control.limit", rule, remedy)
    elif given[0] not in ("limit", absolute):
        rule = "is in a unit that the input does not have"
        yield Fault(f"control.{given[0]}", rule, f"give limit, a share, or {absolute}")
    elif given[0] == "limit" and config.is_idle(config.actuator_of(control.actuator)):
        rule = "is a share of the steady input, which is 0"
        yield Fault("control.limit", rule, f"give {absolute} instead")


@GENERIC_RULES.reads("control", "scene")
def _measured_states_exist(config: Tables) -> Iterator[Fault]:
    """Measured states are states of the scene."""
    for name in config.control.measured if config.control else ():
        if name not in config.states:
            remedy = f"states: {', '.join(config.states)}"
            yield Fault("control.measured", "is no state of this scene", remedy, name)


@GENERIC_RULES.reads("control", "integration", "outputs")
def _controllers_go_with_the_rest(config: Tables) -> Iterator[Fault]:
    """Errors, plain steps and some exponents cannot be computed with a controller."""
    control = config.control
    if control is None:
        return
    if share := config.integration.error_check:
        rule = "cannot be combined with [control], which is designed for one number of steps"
        remedy = "leave it out; the same sweep without [control] shows the errors"
        yield Fault("integration.error_check", rule, remedy, share)
    if config.integration.crossings == "plain":
        rule = "cannot be combined with [control], whose orbits need resolved crossings"
        yield Fault("integration.crossings", rule, 'set crossings = "resolved"', "plain")
    if config.outputs.exponents and (control.measured or control.gain == "delayed"):
        rule = "cannot be computed with an estimate or a delay, which have states of their own"
        yield Fault("outputs.exponents", rule, "set outputs.exponents = false", True)


@GENERIC_RULES.reads("control")
def _the_orbit_can_be_followed(config: Tables) -> Iterator[Fault]:
    """The orbit of a controller is followed along at most one parameter of the machine."""
    control, sweeps = config.control, of_the_machine(config)
    if control is None:
        return
    if len(sweeps) > 1:
        rule = "is a second parameter of the machine, and an orbit is followed along one of them"
        remedy = f"sweep a key of [control] instead, such as {next(iter(OF_CONTROLLERS))}"
        yield Fault("second_sweep.parameter", rule, remedy, config.sweeps["second_sweep"].parameter)
    if config.realisations.size > 1:
        rule = f"cannot be combined with several {config.realisation_words}"
        yield Fault("control", rule, "compute one of them, or leave out [control]")
    at = control.found_at
    for table, sweep in sweeps.items():
        if sweep.parameter not in config.parameters:
            continue
        if sweep.parameter in config.discrete_parameters and sweep.size > 1:
            rule = "has no values between two of its own, along which an orbit could be followed"
            yield Fault(f"{table}.parameter", rule, "sweep another one", sweep.parameter)
        low, high = swept_values(sweep)[[0, -1]].tolist()
        if at is not None and not low <= at <= high:
            rule = f"must be between {low:g} and {high:g}, the swept values of {sweep.parameter}"
            yield Fault("control.found_at", rule, "choose a value of the sweep", at)
    if at is not None and not sweeps:
        rule = "has no meaning, because no parameter of the machine is swept"
        yield Fault("control.found_at", rule, "leave it out", at)
