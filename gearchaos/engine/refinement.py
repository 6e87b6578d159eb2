"""The boundaries between the stages of a sweep, found more exactly than its lanes lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.configuration import Configuration, swept_values
from gearchaos.dynamics.following import (
    STABILITY_LOSS_TEXTS,
    Losses,
    StabilityLoss,
    follow,
    loss_of_stability,
)
from gearchaos.dynamics.systems import system_of
from gearchaos.engine.running import run
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.results.result import Result
from gearchaos.results.stage_table import Stage, labelled_lanes
from gearchaos.results.variables import axis_name

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
    none; ``multiplier``: the Floquet multiplier that tells, NaN where none does.
    """

    below: float
    above: float
    label_below: str
    label_above: str
    loss: str
    multiplier: complex


class _Edges(NamedTuple):
    """Lanes: their value, label, period and end state (lanes, states)."""

    values: Floats
    labels: NDArray[np.str_]
    period: NDArray[np.int32]
    states: Floats

    def at(self, lanes: Sequence[int] | NDArray[np.intp]) -> _Edges:
        return _Edges(
            self.values[lanes], self.labels[lanes], self.period[lanes], self.states[lanes]
        )

    def moved(self, chosen: NDArray[np.bool_], to: _Edges) -> _Edges:
        return _Edges(
            np.where(chosen, to.values, self.values),
            np.where(chosen, to.labels, self.labels),
            np.where(chosen, to.period, self.period),
            np.where(chosen[:, np.newaxis], to.states, self.states),
        )


def refinable(result: Result, name: str) -> Configuration:
    """Return the configuration with which single lanes of a result can be computed again.

    Parameters
    ----------
    result : Result
    name : str
        What messages call the result.

    Raises
    ------
    FileError
        If the result does not hold its configuration.
    ConfigurationError
        If its lanes do not stand for themselves.
    """
    text = str(result.metadata.get("configuration_resolved", ""))
    if not text:
        raise FileError(f"{name}: holds no configuration; run the sweep again")
    config = Configuration.from_toml(text, f"{name} (configuration_resolved)")
    if config.start.carry != "none":
        raise ConfigurationError(
            f'{name}: start.carry = "{config.start.carry}": a lane between two others has no start '
            'of its own; refine a sweep with start.carry = "none"'
        )
    if config.start.kind == "random":
        raise ConfigurationError(
            f'{name}: start.kind = "random": a lane between two others has no start of its own; '
            "refine a sweep that starts otherwise"
        )
    steps = int(result.metadata.get("steps_per_period", config.integration.steps_per_period))
    parameters = (sweep.parameter for sweep in config.sweeps.values())
    fixed = {p: result.fixed[axis_name(p)] for p in parameters if axis_name(p) in result.fixed}
    if fixed:
        config = config.at(fixed)
    for key, value in {
        # The steps that were taken, not those from which they were chosen or raised.
        "integration.steps_per_period": steps,
        "integration.tolerance": None,
        "integration.error_check": 0.0,
        "outputs.exponents": False,
        "outputs.motion": True,
    }.items():
        config = config.replace(key, value)
    return config


def refined_boundaries(
    config: Configuration,
    result: Result,
    stages: list[Stage],
    width: float,
    threads: int | None = None,
) -> list[Boundary]:
    """Bisect every boundary between two stages, and tell what the orbits beside it do.

    All boundaries are bisected side by side, with one batch of lanes per round. A boundary is
    where the label of the lane below ends: where bisection meets a third motion, that counts as
    the other side.

    Parameters
    ----------
    config : Configuration
        From `refinable`.
    result : Result
    stages : list of Stage
        From `stage_table` of the lanes of this result.
    width : float
        Wanted distance of the two lanes on either side of a boundary.
    threads : int, optional
        Threads to use; by default all that there are.
    """
    if len(stages) < 2:
        return []
    every = _edges(result)
    below = every.at([stage.last for stage in stages[:-1]])
    above = every.at([stage.first for stage in stages[1:]])
    spacing = above.values - below.values
    for _ in range(MOST_ROUNDS):
        middle = (below.values + above.values) / 2.0
        wide = above.values - below.values > width
        wide &= (below.values < middle) & (middle < above.values)
        if not wide.any():
            break
        found = run(
            config.replace(
                "sweep", {"parameter": config.sweep.parameter, "values": middle[wide].tolist()}
            ),
            threads,
        )
        # Lanes that are not wide any more are filled with any other.
        tried = _edges(found).at(np.maximum(np.cumsum(wide) - 1, 0))
        same = tried.labels == below.labels
        below, above = below.moved(wide & same, tried), above.moved(wide & ~same, tried)
    losses = _losses(config, below, above, spacing)
    return [
        Boundary(
            float(below.values[number]),
            float(above.values[number]),
            str(below.labels[number]),
            str(above.labels[number]),
            *losses[number],
        )
        for number in range(spacing.size)
    ]


def _edges(result: Result) -> _Edges:
    lanes = labelled_lanes(result)
    return _Edges(lanes.values, lanes.labels, lanes.period, result["end_state"])


def _losses(
    config: Configuration, below: _Edges, above: _Edges, spacing: Floats
) -> list[tuple[str, complex]]:
    """Follow the orbits below a boundary upwards, and those above it downwards."""
    # Close to a bifurcation the label changes a little before or after it: one lane further.
    upwards = _followed(config, below, above.values + spacing)
    downwards = _followed(config, above, below.values - spacing)
    told = []
    for number in range(spacing.size):
        sides = [
            (_TELLING.index(StabilityLoss(int(losses.kind[number]))), losses.multiplier[number])
            for losses, edge in ((upwards, below), (downwards, above))
            if edge.period[number] > 0
        ]
        if sides:
            rank, multiplier = min(sides, key=lambda side: side[0])
            told.append((STABILITY_LOSS_TEXTS[_TELLING[rank]], complex(multiplier)))
        else:
            told.append(("", complex("nan")))
    return told


def _followed(config: Configuration, edge: _Edges, last: Floats) -> Losses:
    first, parameter = edge.values, config.sweep.parameter
    lowest, highest = swept_values(config.sweep)[[0, -1]]
    followed = follow(
        lambda values: system_of(config, {parameter: values}, config.needed_effects),
        edge.states,
        edge.period,
        first,
        np.clip(last, lowest, highest),
        float(np.min(np.abs(last - first))) * FOLLOWED_WIDTH,
        config.integration.steps_per_period,
    )
    return loss_of_stability(followed.stable.multipliers, followed.beyond.multipliers)
