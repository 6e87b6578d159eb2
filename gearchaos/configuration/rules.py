"""Rules that tie several keys of a configuration together, but for those of the sweeps."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeAlias

from gearchaos.configuration.messages import Fault
from gearchaos.configuration.run_tables import Start
from gearchaos.configuration.tables import Tables
from gearchaos.gear.derivation import BACKLASHES

Rule: TypeAlias = Callable[[Tables], Iterator[Fault]]

ANGLES = {"pair.normal_pressure_angle_deg", "pair.helix_angle_deg"}
"""Paths of the angles by which a backlash is converted from one plane to another."""

RULES: list[tuple[frozenset[str], Rule]] = []
"""Each rule with the tables that it needs free of faults of their own."""


def reads(*tables: str) -> Callable[[Rule], Rule]:
    """Make a function a rule that reads these tables beside the sweeps that are readable."""

    def listed(check: Rule) -> Rule:
        RULES.append((frozenset(tables), check))
        return check

    return listed


@reads("mesh")
def _one_damping(config: Tables) -> Iterator[Fault]:
    ratio, damping = "mesh.damping_ratio", "mesh.damping_N_s_per_m"
    swept, given = config.swept, config.physical()
    if all(path in swept or given[path] is not None for path in (ratio, damping)):
        rule = f"{ratio} is swept" if ratio in swept else f"{ratio} = {given[ratio]} is given"
        yield Fault(damping, f"{rule} as well", "keep one of the two", given[damping])


@reads("mesh")
def _length_scale_is_known(config: Tables) -> Iterator[Fault]:
    scale, swept, given = "mesh.length_scale_um", config.swept, config.physical()
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


@reads("mesh")
def _one_backlash(config: Tables) -> Iterator[Fault]:
    swept, given = config.swept, config.physical()
    first, *others = [path for path in BACKLASHES if path in swept or given[path] is not None] or [
        ""
    ]
    for path in others:
        rule = f"{first} is swept" if first in swept else f"{first} = {given[first]} is given"
        yield Fault(path, f"{rule} as well", "keep one of them", given[path])


@reads("mesh", "pair")
def _backlash_can_be_converted(config: Tables) -> Iterator[Fault]:
    for path in BACKLASHES[1:]:
        if config.pair is None and (path in config.swept or config.physical()[path] is not None):
            rule = "is converted by the angles of [pair], which is missing"
            yield Fault(path, rule, f"give [pair], or {BACKLASHES[0]}", config.physical()[path])


@reads("mesh", "pair")
def _contact_ratio_is_known(config: Tables) -> Iterator[Fault]:
    if config.pair is None and config.physical()["mesh.stiffness.shape"] == "trapezoid":
        rule = "a trapezoid takes its shape from the contact ratio of [pair]"
        yield Fault("mesh.stiffness", rule, 'give [pair], or shape = "fourier"')


def _states_exist(table: str, key: str, config: Tables) -> Iterator[Fault]:
    names, states = getattr(getattr(config, table), key), config.scene.states
    for name in dict.fromkeys(names):
        if name not in states:
            effect = "transverse" if name.startswith(("delta_1", "delta_2")) else "axial"
            remedy = f'add "{effect}" to scene.effects, which now give {", ".join(states)}'
            rule = f"the scene has no state `{name}`"
            yield Fault(f"{table}.{key}", rule, remedy, tuple(names))


for _table, _keys in (("outputs", ("section", "states")), ("start", ("state", "box", "drawn"))):
    for _key in _keys:
        reads("scene", _table)(partial(_states_exist, _table, _key))


@reads("start")
def _start_keys_belong_to_the_kind(config: Tables) -> Iterator[Fault]:
    start, default = config.start, Start()
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


@reads("outputs", "integration")
def _section_points_are_recorded(config: Tables) -> Iterator[Fault]:
    points, periods = config.outputs.section_points, config.integration.recorded_periods
    if points > periods:
        rule = f"must be at most integration.recorded_periods = {periods}"
        remedy = "record more periods or keep fewer points"
        yield Fault("outputs.section_points", rule, remedy, points)


@reads("outputs", "start")
def _exponents_are_not_carried(config: Tables) -> Iterator[Fault]:
    if config.outputs.exponents and config.start.carry != "none":
        rule = f'cannot be computed with start.carry = "{config.start.carry}"'
        remedy = 'set start.carry = "none", or compute the exponents in a sweep of its own'
        yield Fault("outputs.exponents", rule, remedy, True)


@reads("integration")
def _plain_steps_are_those_of_rk4(config: Tables) -> Iterator[Fault]:
    if config.integration.method == "flow_map" and config.integration.crossings == "plain":
        rule = 'has no meaning with integration.method = "flow_map", which resolves every crossing'
        yield Fault("integration.crossings", rule, 'it goes with method = "rk4"', "plain")


@reads("outputs", "scene", "integration")
def _contact_is_told_by_crossings(config: Tables) -> Iterator[Fault]:
    crosses = "backlash" in config.scene.effects and config.integration.crossings == "resolved"
    if config.outputs.contact and not crosses:
        rule = "is told by the crossings of clearance boundaries, and there are none"
        remedy = 'add "backlash" to scene.effects and set integration.crossings = "resolved"'
        yield Fault("outputs.contact", rule, remedy, True)


@reads("outputs", "integration")
def _errors_are_measured_on_a_section(config: Tables) -> Iterator[Fault]:
    if config.outputs.section:
        return
    for name in ("tolerance", "error_check"):
        if value := getattr(config.integration, name):
            rule = "needs a section to measure errors on"
            remedy = 'keep a state in outputs.section, such as "delta_5"'
            yield Fault(f"integration.{name}", rule, remedy, value)
