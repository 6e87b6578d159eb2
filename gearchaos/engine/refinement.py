"""Boundaries between the stages of a sweep, located more precisely than by its lanes."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numba
import numpy as np
from gearchaos_kernels import LaneSystem, integrate

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.dynamics.following import Followed, follow
from gearchaos.dynamics.labelling import LONGER_RECORDS, labels_of
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.stability_loss import STABILITY_LOSS_TEXTS, StabilityLoss
from gearchaos.engine.computing import block_lanes
from gearchaos.engine.lanes import start_states
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.interrupts import check
from gearchaos.models import Configuration, swept_values
from gearchaos.models.registry import system_of
from gearchaos.outputs.names import LABELS, WAYS
from gearchaos.records.label import MOTION_MEANINGS
from gearchaos.records.period import TOLERANCE
from gearchaos.results.reading.jumps import Apart, directions_of
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import Stage, label_text

FOLLOWED_WIDTH = 2.0**-16
"""Share of the way to which the end of an orbit is located.

Next to a fold, a multiplier approaches +1 like the square root of the distance. A coarser end would
not identify the loss of stability.
"""

NO_LOSS = (StabilityLoss.STAYS_STABLE, StabilityLoss.UNCONFIRMED, StabilityLoss.NOT_FOLLOWED)
"""Results without a loss of stability of the followed orbit."""


class Boundary(NamedTuple):
    """The boundary between two stages.

    Attributes
    ----------
    below, above : float
        Values of the swept parameter on both sides.
    label_below, label_above : str
        Labels there.
    loss : str
        How the periodic orbit next to the boundary loses stability, empty without one.
    multiplier : complex
        Floquet multiplier at the loss, NaN without one.
    direction : str
        Direction in which a carried sweep jumps at the boundary, otherwise empty.
    lost_at : float
        Value of the parameter at which the orbit loses stability; NaN where it does not, or where
        this is the boundary itself.
    """

    below: float
    above: float
    label_below: str
    label_above: str
    loss: str = ""
    multiplier: complex = complex("nan")
    direction: str = ""
    lost_at: float = math.nan

    @property
    def elsewhere(self) -> bool:
        """Whether the orbit next to the boundary is lost elsewhere, so that the motion jumps."""
        width = self.above - self.below
        return abs(self.lost_at - (self.below + self.above) / 2.0) > 1.5 * width


def refined_boundaries(
    config: Configuration, result: Result, stages: list[Stage], width: float
) -> list[Boundary]:
    """Bisect every boundary between two stages, and follow the orbits next to it.

    All boundaries are bisected together until the lanes on both sides are at most ``width`` apart.
    A boundary is the end of the label below: any other label counts as the upper side. ``config``:
    from `refinable`; ``stages``: of this result.
    """
    if len(stages) < 2:
        return []
    run, every = plan_run(config), _edges_of(result)
    below = every[[stage.last for stage in stages[:-1]]]
    above = every[[stage.first for stage in stages[1:]]]
    spacing = above["value"] - below["value"]
    while (wide := _wide(below, above, width)).size:
        low, high = below["value"][wide], above["value"][wide]
        middle = (low + high) / 2.0
        # Two halvings in one batch: longer records of few lanes take as long as those of many.
        trials = np.concatenate([(low + middle) / 2.0, middle, (middle + high) / 2.0])
        tried = _computed(run, {config.sweep.parameter: trials}).reshape(3, wide.size)
        same = tried["label"] == below["label"][wide]
        below[wide[same[1]]], above[wide[~same[1]]] = tried[1, same[1]], tried[1, ~same[1]]
        again = np.isin(wide, _wide(below, above, width))
        for number, half in (0, ~same[1]), (2, same[1]):
            up, down = again & half & same[number], again & half & ~same[number]
            below[wide[up]], above[wide[down]] = tried[number, up], tried[number, down]
    losses = _losses(config, below, above, spacing)
    return [
        Boundary(float(one["value"]), float(other["value"]), one["label"], other["label"], **loss)
        for one, other, loss in zip(below, above, losses, strict=True)
    ]


def _wide(below: Array, above: Array, width: float) -> Integers:
    """Return the numbers of the boundaries that are bisected further."""
    low, high = below["value"], above["value"]
    middle = (low + high) / 2.0
    return np.flatnonzero((low < middle) & (middle < high) & (high - low > width))


def refined_map(
    config: Configuration, result: Result, width: float
) -> tuple[dict[float, list[Boundary]], int]:
    """Find the boundaries in all rows of a map to a width, without following orbits.

    Each round halves the stretches between two lanes of a row with different labels. It also halves
    stretches with a different label next to them in the row above or below, which finds islands and
    windows between the lanes of a row. Returns the boundaries by value of the second parameter, and
    the number of computed lanes. ``config``: from `refinable`, with two sweeps.
    """
    run = plan_run(config)
    first, second = (sweep.parameter for sweep in config.sweeps.values())
    values, rows = result[result.axis].tolist(), result[result.axes[0]]
    labels = _edges_of(result)["label"].reshape(rows.size, -1).tolist()
    lanes = [zip(values, row, strict=True) for row in labels]
    stretches = {
        (r, n): ends for r, row in enumerate(lanes) for n, ends in enumerate(pairwise(row))
    }
    found: dict[float, list[Boundary]] = {}
    computed = 0
    while stretches:
        halved = {}
        for (row, n), ((low, below), (high, above)) in stretches.items():
            beside = (stretches.get((row + step, n), ()) for step in (-1, 0, 1))
            middle = (low + high) / 2.0
            if high - low <= width or not low < middle < high:
                if below != above:
                    boundary = Boundary(low, high, below, above)
                    found.setdefault(float(rows[row]), []).append(boundary)
            elif len({label for ends in beside for _, label in ends}) > 1:
                halved[row, n] = middle
        if not halved:
            break
        places = {first: np.array([*halved.values()]), second: rows[[row for row, _ in halved]]}
        tried = _computed(run, places)[["value", "label"]].tolist()
        computed += len(tried)
        last, stretches = stretches, {}
        for (row, n), half in zip(halved, tried, strict=True):
            lower, upper = last[row, n]
            stretches |= {(row, 2 * n): (lower, half), (row, 2 * n + 1): (half, upper)}
    return {row: sorted(found[row]) for row in sorted(found)}, computed


def refined_jumps(
    config: Configuration, result: Result, stretches: list[Apart], width: float
) -> list[Boundary]:
    """Follow the motions of both directions to their ends, where the sweep jumps.

    ``config``: from `computable`; ``stretches``: of this result, where the directions differ.
    Without an orbit, or if the orbit continues, a jump is located between two lanes; otherwise to
    ``width``. The label of a motion is that of the lane whose orbit is followed. Where the orbit
    continues with the same label, the direction does not jump.
    """
    found: list[Boundary] = []
    outermost = np.array([(one.first, one.last) for one in stretches], np.intp).reshape(-1, 2).T
    ways = zip(WAYS, directions_of(result), outermost[::-1], (1, -1), strict=True)
    for way, one_way, end, step in ways:
        edges = _edges_of(one_way)
        there = (end + step >= 0) & (end + step < edges.size)
        last, beyond = edges[end[there]], edges[end[there] + step]
        if not last.size:
            continue
        # The last lane may still be in its transient: take the orbit of the lane before it.
        inner = edges[np.clip(end - step, *outermost)[there]]
        on_its_way = last["far"] | (inner["label"] == last["label"])
        edge = np.where(on_its_way, inner, last)
        further = 2.0 * beyond["value"] - last["value"]
        followed = _followed(config, edge, further, width)
        continues = np.isin(followed.loss, NO_LOSS)
        stable = np.where(continues, last["value"], followed.stable_value)
        lost = np.where(continues, beyond["value"], followed.beyond_value)
        for n, kind in enumerate(followed.loss):
            alike = edge["label"][n] == beyond["label"][n]
            if alike and kind == StabilityLoss.STAYS_STABLE:
                # The motion continues: it is the other direction that jumps here.
                continue
            loss = STABILITY_LOSS_TEXTS[kind] if edge["period"][n] else ""
            sides = (float(stable[n]), edge["label"][n]), (float(lost[n]), beyond["label"][n])
            (below, one), (above, other) = sides[::step]
            multiplier = complex(followed.multiplier[n])
            found.append(Boundary(below, above, one, other, loss, multiplier, way))
    return sorted(found, key=lambda boundary: boundary.below)


def _edges_of(result: Result) -> Array:
    """Return the lanes of a result with labels as edges, in their order."""
    columns = [result.lanes(name) for name in (*LABELS, "end_state")]
    edges = _edges(result.along(result.axis), result.variables["motion"].flags, *columns)
    if "return_distance" in result:
        distance = result.lanes("return_distance")
        edges["far"] = (edges["period"] > 0) & ~(distance <= TOLERANCE)
    return edges


def _edges(
    values: Floats, flags: Sequence[str], motion: Array, period: Array, state: Floats
) -> Array:
    """Return value, label, period, state, and whether the state is far from its orbit, per lane."""
    fields = [("value", "f8"), ("label", object), ("period", "i4"), ("far", "?")]
    edges = np.zeros(values.size, [*fields, ("state", "f8", state.shape[1:])])
    edges["value"], edges["period"], edges["state"] = values, period, state
    kinds = zip(motion.tolist(), period.tolist(), strict=True)
    edges["label"] = [label_text(flags[m], n) for m, n in kinds]
    return edges


def _computed(run: RunPlan, values: Mapping[str, Floats]) -> Array:
    """Compute lanes at values of the swept parameters (lanes,), with the start of the sweep."""
    config, plan = run.config, run.recording
    (axis, *_), found = values.values(), []
    size = block_lanes(run, numba.get_num_threads())
    for first in range(0, axis.size, size):
        check()
        some = {name: value[first : first + size] for name, value in values.items()}
        system = system_of(config, some, run.lanes.effects)
        start = start_states(config, system, np.zeros(system.lanes, dtype=np.intp))
        labels, state = labels_of(system, integrate(system, start, plan), plan)
        found.append((labels.motion, labels.period, state))
    return _edges(axis, MOTION_MEANINGS, *map(np.concatenate, zip(*found, strict=True)))


def _losses(
    config: Configuration, below: Array, above: Array, spacing: Floats
) -> list[dict[str, Any]]:
    """Follow the orbits below each boundary upwards and those above it downwards.

    Returns how, with which multiplier and where one of them is lost, by the fields of `Boundary`.
    """
    # Labels change slightly before or after a bifurcation: follow one lane further.
    ends = above["value"] + spacing, below["value"] - spacing
    edges = np.concatenate([below, above])
    # Both ways side by side: few lanes take as long as many.
    followed = _followed(config, edges, np.concatenate(ends))
    places = (followed.stable_value + followed.beyond_value) / 2.0
    losses: list[dict[str, Any]] = []
    for number in range(spacing.size):
        sides = [n for n in (number, spacing.size + number) if edges["period"][n] > 0]
        losses.append({})
        if sides:
            lane = min(sides, key=lambda side: int(followed.loss[side]))
            kind = followed.loss[lane]
            losses[-1]["loss"] = STABILITY_LOSS_TEXTS[kind]
            losses[-1]["multiplier"] = complex(followed.multiplier[lane])
            if kind not in NO_LOSS:
                losses[-1]["lost_at"] = float(places[lane])
    return losses


def _followed(config: Configuration, edge: Array, last: Floats, width: float = np.inf) -> Followed:
    """Follow the orbits of edges (lanes,) to the values ``last`` (lanes,)."""

    def system(values: Floats) -> LaneSystem:
        return system_of(config, {config.sweep.parameter: values}, config.needed_effects)

    first, state = edge["value"], edge["state"].copy()
    lanes = np.flatnonzero(edge["far"])
    if lanes.size:
        # If a longer record was labelled, the end of the first record may be far from the orbit.
        longer = sum(LONGER_RECORDS) * config.integration.recorded_periods
        further = plan_of(config, transient_periods=longer, recorded_periods=0, tangent=True)
        state[lanes] = integrate(system(first[lanes]), state[lanes], further).end_state
    lowest, highest = swept_values(config.sweep)[[0, -1]]
    return follow(
        system,
        state,
        edge["period"],
        first,
        np.clip(last, lowest, highest),
        min(width, float(np.min(np.abs(last - first))) * FOLLOWED_WIDTH),
        plan_of(config),
    )
