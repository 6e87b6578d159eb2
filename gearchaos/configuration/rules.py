"""Rules that tie several keys of a configuration together."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeAlias

from gearchaos.configuration.messages import Fault
from gearchaos.configuration.physical_tables import TrapezoidStiffness
from gearchaos.configuration.run_tables import Start

if TYPE_CHECKING:
    from gearchaos.configuration.models import Configuration

Rule: TypeAlias = "Callable[[Configuration], Iterator[Fault]]"


def _one_damping(config: Configuration) -> Iterator[Fault]:
    mesh = config.mesh
    if mesh and mesh.damping_ratio is not None and mesh.damping_N_s_per_m is not None:
        yield Fault(
            "mesh.damping_N_s_per_m",
            f"mesh.damping_ratio = {mesh.damping_ratio} is given as well",
            "keep one of the two",
            mesh.damping_N_s_per_m,
        )


def _length_scale_is_known(config: Configuration) -> Iterator[Fault]:
    mesh = config.mesh
    if mesh and mesh.length_scale_um is None and mesh.half_backlash_um == 0:
        yield Fault(
            "mesh.half_backlash_um",
            "cannot be the length scale when it is 0",
            "give mesh.length_scale_um",
            mesh.half_backlash_um,
        )
    if mesh and mesh.length_scale_um is None and config.sweep.parameter == "mesh.half_backlash_um":
        yield Fault(
            "sweep.parameter",
            "is also the length scale, so that sweeping it would change the unit of every length",
            "give mesh.length_scale_um",
            config.sweep.parameter,
        )


def _shares_fill_the_period(config: Configuration) -> Iterator[Fault]:
    stiffness = config.mesh.stiffness if config.mesh else None
    if not isinstance(stiffness, TrapezoidStiffness):
        return
    shares = [share for share in stiffness.shares if share is not None]
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
            *(() if stiffness.half_height is None else (stiffness.half_height,)),
        )


def _contact_ratio_is_known(config: Configuration) -> Iterator[Fault]:
    stiffness = config.mesh.stiffness if config.mesh else None
    if (
        isinstance(stiffness, TrapezoidStiffness)
        and config.pair is None
        and not any(share is not None for share in stiffness.shares)
    ):
        yield Fault(
            "mesh.stiffness",
            "a trapezoid without shares takes its shape from the contact ratio of [pair]",
            "give [pair], or rise, top, fall, bottom and half_height",
        )


def _effects_are_named_once(config: Configuration) -> Iterator[Fault]:
    yield from _duplicates("scene.effects", config.scene.effects)


def _section_states_are_named_once(config: Configuration) -> Iterator[Fault]:
    yield from _duplicates("outputs.section", config.outputs.section)


def _duplicates(key: str, names: tuple[str, ...]) -> Iterator[Fault]:
    for name, times in Counter(names).items():
        if times > 1:
            yield Fault(key, f"names `{name}` {times} times", "name it once", names)


def _section_states_exist(config: Configuration) -> Iterator[Fault]:
    yield from _foreign("outputs.section", config.outputs.section, config)


def _start_states_exist(config: Configuration) -> Iterator[Fault]:
    yield from _foreign("start.state", tuple(config.start.state), config)


def _foreign(key: str, names: tuple[str, ...], config: Configuration) -> Iterator[Fault]:
    for name in dict.fromkeys(names):
        if name not in config.scene.states:
            effect = "transverse" if name.startswith(("delta_1", "delta_2")) else "axial"
            yield Fault(
                key,
                f"the scene has no state `{name}`",
                f'add "{effect}" to scene.effects, which now give {", ".join(config.scene.states)}',
                names,
            )


def _start_keys_belong_to_the_kind(config: Configuration) -> Iterator[Fault]:
    start, default = config.start, Start()
    if start.kind == "given" and not start.state:
        yield Fault(
            "start.state", 'is missing with kind = "given"', "such as state = { delta_5 = 1.0 }"
        )
    for name, kind in {
        "state": "given",
        "spread": "random",
        "seed": "random",
        "count": "random",
    }.items():
        value = getattr(start, name)
        if start.kind != kind and value != getattr(default, name):
            yield Fault(
                f"start.{name}",
                f'has no meaning with start.kind = "{start.kind}"',
                f'it goes with kind = "{kind}"',
                value,
            )


def _section_points_are_recorded(config: Configuration) -> Iterator[Fault]:
    points, periods = config.outputs.section_points, config.integration.recorded_periods
    if points > periods:
        yield Fault(
            "outputs.section_points",
            f"must be at most integration.recorded_periods = {periods}",
            "record more periods or keep fewer points",
            points,
        )


def _errors_are_measured_on_a_section(config: Configuration) -> Iterator[Fault]:
    integration = config.integration
    for name, value in {
        "tolerance": integration.tolerance,
        "error_check": integration.error_check or None,
    }.items():
        if value is not None and not config.outputs.section:
            yield Fault(
                f"integration.{name}",
                "needs a section to measure errors on",
                'keep a state in outputs.section, such as "delta_5"',
                value,
            )


def _spectrum_is_not_carried(config: Configuration) -> Iterator[Fault]:
    if config.outputs.spectrum and config.start.carry != "none":
        yield Fault(
            "outputs.spectrum",
            f'cannot be computed with start.carry = "{config.start.carry}"',
            'set start.carry = "none", or compute the spectrum in a sweep of its own',
            config.outputs.spectrum,
        )


RULES: tuple[tuple[frozenset[str], Rule], ...] = (
    (frozenset({"mesh"}), _one_damping),
    (frozenset({"mesh", "sweep"}), _length_scale_is_known),
    (frozenset({"mesh"}), _shares_fill_the_period),
    (frozenset({"mesh", "pair"}), _contact_ratio_is_known),
    (frozenset({"scene"}), _effects_are_named_once),
    (frozenset({"outputs"}), _section_states_are_named_once),
    (frozenset({"scene", "outputs"}), _section_states_exist),
    (frozenset({"scene", "start"}), _start_states_exist),
    (frozenset({"start"}), _start_keys_belong_to_the_kind),
    (frozenset({"outputs", "integration"}), _section_points_are_recorded),
    (frozenset({"outputs", "start"}), _spectrum_is_not_carried),
    (frozenset({"outputs", "integration"}), _errors_are_measured_on_a_section),
)
"""Each rule with the tables it reads; it needs them free of faults of their own."""
