"""The boundaries between the stages of a sweep, found more exactly than its lanes lie."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from gearchaos_kernels import System, integrate
from numpy.typing import NDArray

from gearchaos.configuration import Configuration, swept_values
from gearchaos.dynamics.following import (
    STABILITY_LOSS_TEXTS,
    Followed,
    Losses,
    StabilityLoss,
    follow,
    loss_of_stability,
)
from gearchaos.dynamics.labelling import LOOKS
from gearchaos.dynamics.systems import plan_of, system_of
from gearchaos.engine.running import choose_threads, run
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.gear.tooth_deviations import REALISATION
from gearchaos.records.period import TOLERANCE
from gearchaos.results.jumps import Apart, directions_of
from gearchaos.results.result import Result
from gearchaos.results.stage_table import Stage, labelled_lanes
from gearchaos.results.variables import WAYS, axis_name

Floats = NDArray[np.float64]

MOST_ROUNDS = 60
"""Bisections after which two different numbers are neighbours."""

FOLLOWED_WIDTH = 1.0 / 1024.0
"""Share of its way to which the end of an orbit is located: next to a fold a multiplier nears +1
like the root of the distance, so that a coarse end tells nothing."""

_TELLING = (
    StabilityLoss.PERIOD_DOUBLING,
    StabilityLoss.NEIMARK_SACKER,
    StabilityLoss.FOLD,
    StabilityLoss.STAYS_STABLE,
    StabilityLoss.NOT_FOLLOWED,
)
"""Of what an orbit below and one above a boundary do, the earlier one here tells more."""


class Boundary(NamedTuple):
    """Where one stage ends, between two computed lanes.

    ``below``, ``above``: values of the swept parameter; ``label_below``, ``label_above``: the
    labels there; ``loss``: how the periodic orbit beside it loses stability, empty where there is
    none; ``multiplier``: the Floquet multiplier that tells, NaN where none does; ``direction``: in
    which a carried sweep jumps there.
    """

    below: float
    above: float
    label_below: str
    label_above: str
    loss: str
    multiplier: complex
    direction: str = ""


def computable(result: Result, name: str) -> Configuration:
    """Return the configuration with which lanes of a result can be computed again, or go on.

    Messages call the result ``name``. Raises FileError if it does not hold its configuration.
    """
    text = str(result.metadata.get("configuration_resolved", ""))
    if not text:
        raise FileError(f"{name}: holds no configuration; run the sweep again")
    config = Configuration.from_toml(text, f"{name} (configuration_resolved)")
    parameters = [REALISATION, *(sweep.parameter for sweep in config.sweeps.values())]
    fixed = {p: result.fixed[axis_name(p)] for p in parameters if axis_name(p) in result.fixed}
    if fixed:
        config = config.at(fixed)
    # The steps and periods that were taken, not those from which they were chosen or raised.
    for name in ("steps_per_period", "transient_periods", "recorded_periods"):
        taken = int(result.metadata.get(name, getattr(config.integration, name)))
        config = config.replace(f"integration.{name}", taken)
    for key, value in {
        "integration.tolerance": None,
        "integration.error_check": 0.0,
        "outputs.exponents": False,
        "outputs.motion": True,
    }.items():
        config = config.replace(key, value)
    return config


def refinable(result: Result, name: str) -> Configuration:
    """Return the configuration with which lanes between those of a result can be computed.

    As `computable`, and raises ConfigurationError if its lanes do not stand for themselves.
    """
    config = computable(result, name)
    if config.sweep.parameter == "pitch_error.grade":
        raise ConfigurationError(
            f"{name}: pitch_error.grade: nothing lies between two grades; refine a sweep of "
            "another parameter, such as pitch_error"
        )
    unfit = remedy = ""
    if config.start.carry != "none":
        unfit, remedy = f'carry = "{config.start.carry}"', 'with start.carry = "none"'
    elif config.start.kind == "random":
        unfit, remedy = 'kind = "random"', "that starts otherwise"
    elif config.start.kind == "grid":
        state = zip(result.variables["state"].flags, result["start_state"][0].tolist(), strict=True)
        config = config.replace("start", {"kind": "given", "state": dict(state)})
    if unfit:
        raise ConfigurationError(
            f"{name}: start.{unfit}: a lane between two others has no start of its own; refine a "
            f"sweep {remedy}"
        )
    return config


def refined_boundaries(
    config: Configuration,
    result: Result,
    stages: list[Stage],
    width: float,
    threads: int | None = None,
) -> list[Boundary]:
    """Bisect every boundary between two stages, and tell what the orbits beside it do.

    All boundaries are bisected side by side, with one batch of lanes per round, until the two lanes
    on either side are no farther apart than ``width``. A boundary is where the label of the lane
    below ends: where bisection meets a third motion, that counts as the other side. ``config`` is
    from `refinable`, the stages are those of this result.
    """
    if len(stages) < 2:
        return []
    every = _edges(result)
    below = every[[stage.last for stage in stages[:-1]]]
    above = every[[stage.first for stage in stages[1:]]]
    spacing = above["value"] - below["value"]

    def between(middle: Floats, _: NDArray[np.intp]) -> NDArray[Any]:
        values = {"parameter": config.sweep.parameter, "values": middle.tolist()}
        return _edges(run(config.replace("sweep", values), threads))

    bisect(below, above, width, between)
    losses = _losses(config, below, above, spacing)
    return [
        Boundary(float(one["value"]), float(other["value"]), one["label"], other["label"], *loss)
        for one, other, loss in zip(below, above, losses, strict=True)
    ]


def bisect(
    below: NDArray[Any],
    above: NDArray[Any],
    width: float,
    between: Callable[[Floats, NDArray[np.intp]], NDArray[Any]],
) -> None:
    """Move the ends of boundaries towards each other, in place, until none is wider than that.

    ``below``, ``above``: arrays with fields ``value`` and ``label``; ``between`` gives the same
    at values in the middle of boundaries, and of these numbers.
    """
    for _ in range(MOST_ROUNDS):
        middle = (below["value"] + above["value"]) / 2.0
        wide = above["value"] - below["value"] > width
        wide &= (below["value"] < middle) & (middle < above["value"])
        if not wide.any():
            break
        numbers = np.flatnonzero(wide)
        tried = between(middle[wide], numbers)
        same = tried["label"] == below["label"][wide]
        below[numbers[same]], above[numbers[~same]] = tried[same], tried[~same]


def refined_jumps(
    config: Configuration,
    result: Result,
    stretches: list[Apart],
    width: float,
    threads: int | None = None,
) -> list[Boundary]:
    """Follow the motions of both directions to where they end and the sweep jumps.

    ``config`` is from `computable`, the stretches, in which directions differ, are those of this
    result. Where a motion has no orbit, or it goes on, a jump lies between two lanes; elsewhere its
    place is known to the width.
    """
    choose_threads(threads)
    found: list[Boundary] = []
    outermost = np.array([(one.first, one.last) for one in stretches]).reshape(-1, 2).T
    ways = zip(WAYS, directions_of(result), outermost[::-1], (1, -1), strict=True)
    for way, one_way, end, step in ways:
        edges = _edges(one_way)
        # Next to its end a lane may still be on its way: the orbit is that of the lane before.
        inner = np.clip(end - step, *outermost)
        there = (end + step >= 0) & (end + step < edges.size)
        last, beyond = edges[end[there]], edges[end[there] + step]
        if not last.size:
            continue
        further = 2.0 * beyond["value"] - last["value"]
        followed, losses = _followed(config, edges[inner[there]], further, width)
        goes_on = np.isin(losses.kind, (StabilityLoss.STAYS_STABLE, StabilityLoss.NOT_FOLLOWED))
        stable = np.where(goes_on, last["value"], followed.stable_value)
        lost = np.where(goes_on, beyond["value"], followed.beyond_value)
        for n, kind in enumerate(losses.kind):
            told = STABILITY_LOSS_TEXTS[StabilityLoss(kind)] if last["period"][n] else ""
            sides = (float(stable[n]), last["label"][n]), (float(lost[n]), beyond["label"][n])
            (below, one), (above, other) = sides[::step]
            multiplier = complex(losses.multiplier[n])
            found.append(Boundary(below, above, one, other, told, multiplier, way))
    return sorted(found, key=lambda boundary: boundary.below)


def _edges(result: Result) -> NDArray[Any]:
    """Return of each lane value, label, period, end state, and if that is far from its orbit."""
    lanes, states = labelled_lanes(result), result["end_state"]
    fields = [("value", "f8"), ("label", object), ("period", "i4"), ("far", "?")]
    edges = np.empty(lanes.values.size, [*fields, ("state", "f8", states.shape[1:])])
    edges["value"], edges["label"], edges["period"] = lanes.values, lanes.labels, lanes.period
    edges["state"], edges["far"] = states, False
    if "return_distance" in result:
        edges["far"] = (lanes.period > 0) & ~(result["return_distance"] <= TOLERANCE)
    return edges


def _losses(
    config: Configuration, below: NDArray[Any], above: NDArray[Any], spacing: Floats
) -> list[tuple[str, complex]]:
    """Follow the orbits below a boundary upwards, and those above it downwards."""
    # Close to a bifurcation the label changes a little before or after it: one lane further.
    _, upwards = _followed(config, below, above["value"] + spacing)
    _, downwards = _followed(config, above, below["value"] - spacing)
    told = []
    for number in range(spacing.size):
        sides = [
            (StabilityLoss(losses.kind[number]), complex(losses.multiplier[number]))
            for losses, edge in ((upwards, below), (downwards, above))
            if edge["period"][number] > 0
        ]
        tells, multiplier = min(
            sides, key=lambda side: _TELLING.index(side[0]), default=(None, complex("nan"))
        )
        told.append((STABILITY_LOSS_TEXTS[tells] if tells is not None else "", multiplier))
    return told


def _followed(
    config: Configuration, edge: NDArray[Any], last: Floats, width: float = np.inf
) -> tuple[Followed, Losses]:
    def system(values: Floats) -> System:
        return system_of(config, {config.sweep.parameter: values}, config.needed_effects)

    first, state = edge["value"], edge["state"].copy()
    lanes = np.flatnonzero(edge["far"])
    if lanes.size:
        # Where a longer look told the orbit, the end of the record may be far away.
        longer = sum(LOOKS) * config.integration.recorded_periods
        further = plan_of(config, transient_periods=longer, recorded_periods=0)
        state[lanes] = integrate(system(first[lanes]), state[lanes], further).end_state
    lowest, highest = swept_values(config.sweep)[[0, -1]]
    followed = follow(
        system,
        state,
        edge["period"],
        first,
        np.clip(last, lowest, highest),
        min(width, float(np.min(np.abs(last - first))) * FOLLOWED_WIDTH),
        plan_of(config),
    )
    return followed, loss_of_stability(followed.stable.multipliers, followed.beyond.multipliers)
