"""Rules that tie several keys of a configuration together, but for those of the sweeps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from typing import TYPE_CHECKING, TypeAlias

from gearchaos.configuration.messages import ABSENT, Fault
from gearchaos.configuration.physical_tables import TrapezoidStiffness
from gearchaos.configuration.run_tables import Start

if TYPE_CHECKING:
    from gearchaos.configuration.models import Configuration

Rule: TypeAlias = "Callable[[Configuration], Iterator[Fault]]"

RULES: list[tuple[frozenset[str], Rule]] = []
"""Each rule with the tables that it needs free of faults of their own."""


def reads(*tables: str) -> Callable[[Rule], Rule]:
    """Make a function a rule that reads these tables beside the sweeps that are readable."""

    def listed(check: Rule) -> Rule:
        RULES.append((frozenset(tables), check))
        return check

    return listed


@reads("mesh")
def _one_damping(config: Configuration) -> Iterator[Fault]:
    swept = [sweep.parameter for sweep in config.sweeps.values()]
    ratio, damping = ("mesh.damping_ratio", "mesh.damping_N_s_per_m")
    values = config.physical()
    if all(path in swept or values[path] is not None for path in (ratio, damping)):
        given = f"{ratio} = {values[ratio]} is given" if ratio not in swept else f"{ratio} is swept"
        shown = ABSENT if values[damping] is None else values[damping]
        yield Fault(damping, f"{given} as well", "keep one of the two", shown)


@reads("mesh")
def _length_scale_is_known(config: Configuration) -> Iterator[Fault]:
    mesh = config.mesh
    swept = {sweep.parameter: f"{name}.parameter" for name, sweep in config.sweeps.items()}
    if mesh is None or mesh.length_scale_um is not None or "mesh.length_scale_um" in swept:
        return
    if mesh.half_backlash_um == 0:
        yield Fault(
            "mesh.half_backlash_um",
            "cannot be the length scale when it is 0",
            "give mesh.length_scale_um",
            mesh.half_backlash_um,
        )
    if "mesh.half_backlash_um" in swept:
        yield Fault(
            swept["mesh.half_backlash_um"],
            "is also the length scale, so that sweeping it would change the unit of every length",
            "give mesh.length_scale_um",
            "mesh.half_backlash_um",
        )


@reads("mesh")
def _shares_fill_the_period(config: Configuration) -> Iterator[Fault]:
    stiffness = config.mesh.stiffness if config.mesh else None
    if not isinstance(stiffness, TrapezoidStiffness):
        return
    shares = _shares(stiffness)
    if 0 < len(shares) < 4:
        yield Fault(
            "mesh.stiffness",
            f"gives {len(shares)} of the four shares rise, top, fall, bottom",
            "give all four, or none to take them from the contact ratio of [pair]",
        )
    elif shares and not math.isclose(sum(shares), 1.0, abs_tol=1e-9):
        yield Fault(
            "mesh.stiffness",
            f"rise + top + fall + bottom = {sum(shares):.12g}, must be 1",
            "the four are shares of one mesh period",
        )
    if (stiffness.half_height is None) == bool(shares):
        yield Fault(
            "mesh.stiffness.half_height",
            "must be given with the four shares, and only with them",
            "without both the contact ratio of [pair] decides",
            ABSENT if stiffness.half_height is None else stiffness.half_height,
        )


@reads("mesh", "pair")
def _contact_ratio_is_known(config: Configuration) -> Iterator[Fault]:
    stiffness = config.mesh.stiffness if config.mesh else None
    if config.pair is None and isinstance(stiffness, TrapezoidStiffness) and not _shares(stiffness):
        yield Fault(
            "mesh.stiffness",
            "a trapezoid without shares takes its shape from the contact ratio of [pair]",
            "give [pair], or rise, top, fall, bottom and half_height",
        )


def _shares(stiffness: TrapezoidStiffness) -> list[float]:
    shares = (stiffness.rise, stiffness.top, stiffness.fall, stiffness.bottom)
    return [share for share in shares if share is not None]


@reads("scene")
def _effects_are_named_once(config: Configuration) -> Iterator[Fault]:
    yield from _duplicates("scene.effects", config.scene.effects)


@reads("outputs")
def _section_states_are_named_once(config: Configuration) -> Iterator[Fault]:
    yield from _duplicates("outputs.section", config.outputs.section)


def _duplicates(key: str, names: tuple[str, ...]) -> Iterator[Fault]:
    for name, times in Counter(names).items():
        if times > 1:
            yield Fault(key, f"names `{name}` {times} times", "name it once", names)


@reads("scene", "outputs")
def _section_states_exist(config: Configuration) -> Iterator[Fault]:
    yield from _foreign("outputs.section", config.outputs.section, config)


@reads("scene", "start")
def _start_states_exist(config: Configuration) -> Iterator[Fault]:
    yield from _foreign("start.state", config.start.state, config)


def _foreign(key: str, names: Collection[str], config: Configuration) -> Iterator[Fault]:
    for name in dict.fromkeys(names):
        if name not in config.scene.states:
            effect = "transverse" if name.startswith(("delta_1", "delta_2")) else "axial"
            yield Fault(
                key,
                f"the scene has no state `{name}`",
                f'add "{effect}" to scene.effects, which now give {", ".join(config.scene.states)}',
                tuple(names),
            )


@reads("start")
def _start_keys_belong_to_the_kind(config: Configuration) -> Iterator[Fault]:
    start, default = config.start, Start()
    if start.kind == "given" and not start.state:
        remedy = "such as state = { delta_5 = 1.0 }"
        yield Fault("start.state", 'is missing with kind = "given"', remedy)
    homes = {"state": "given", "spread": "random", "seed": "random", "count": "random"}
    for name, kind in homes.items():
        value = getattr(start, name)
        if start.kind != kind and value != getattr(default, name):
            rule = f'has no meaning with start.kind = "{start.kind}"'
            yield Fault(f"start.{name}", rule, f'it goes with kind = "{kind}"', value)


@reads("outputs", "integration")
def _section_points_are_recorded(config: Configuration) -> Iterator[Fault]:
    points, periods = config.outputs.section_points, config.integration.recorded_periods
    if points > periods:
        rule = f"must be at most integration.recorded_periods = {periods}"
        remedy = "record more periods or keep fewer points"
        yield Fault("outputs.section_points", rule, remedy, points)


@reads("outputs", "start")
def _exponents_are_not_carried(config: Configuration) -> Iterator[Fault]:
    if config.outputs.exponents and config.start.carry != "none":
        yield Fault(
            "outputs.exponents",
            f'cannot be computed with start.carry = "{config.start.carry}"',
            'set start.carry = "none", or compute the exponents in a sweep of its own',
            config.outputs.exponents,
        )


@reads("outputs", "integration")
def _errors_are_measured_on_a_section(config: Configuration) -> Iterator[Fault]:
    if config.outputs.section:
        return
    for name in ("tolerance", "error_check"):
        if value := getattr(config.integration, name):
            remedy = 'keep a state in outputs.section, such as "delta_5"'
            yield Fault(
                f"integration.{name}", "needs a section to measure errors on", remedy, value
            )
