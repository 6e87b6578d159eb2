"""The boundaries between the stages of a sweep, found more exactly than its lanes lie."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from operator import itemgetter
from typing import NamedTuple

import numba
import numpy as np
from gearchaos_kernels import LaneSystem, integrate

from gearchaos.arrays import Array, Floats
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
"""Share of its way to which the end of an orbit is located: next to a fold a multiplier nears +1
like the root of the distance, so that a coarse end tells nothing."""

NO_LOSS = (StabilityLoss.STAYS_STABLE, StabilityLoss.UNCONFIRMED, StabilityLoss.NOT_FOLLOWED)


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
    loss: str = ""
    multiplier: complex = complex("nan")
    direction: str = ""


def refined_boundaries(
    config: Configuration, result: Result, stages: list[Stage], width: float
) -> list[Boundary]:
    """Bisect every boundary between two stages, and tell what the orbits beside it do.

    All boundaries are bisected side by side, with one batch of lanes per round, until the two lanes
    on either side are no farther apart than ``width``. A boundary is where the label of the lane
    below ends: where bisection meets a third motion, that counts as the other side. ``config`` is
    from `refinable`, the stages are those of this result.
    """
    if len(stages) < 2:
        return []
    run, every = plan_run(config), _edges_of(result)
    below = every[[stage.last for stage in stages[:-1]]]
    above = every[[stage.first for stage in stages[1:]]]
    spacing = above["value"] - below["value"]
    while True:
        middle = (below["value"] + above["value"]) / 2.0
        wide = (below["value"] < middle) & (middle < above["value"])
        wide = np.flatnonzero(wide & (above["value"] - below["value"] > width))
        if not wide.size:
            break
        tried = _computed(run, {config.sweep.parameter: middle[wide]})
        same = tried["label"] == below["label"][wide]
        below[wide[same]], above[wide[~same]] = tried[same], tried[~same]
    losses = _losses(config, below, above, spacing)
    return [
        Boundary(float(one["value"]), float(other["value"]), one["label"], other["label"], *loss)
        for one, other, loss in zip(below, above, losses, strict=True)
    ]


def refined_map(
    config: Configuration, result: Result, width: float
) -> tuple[dict[float, list[Boundary]], int]:
    """Find the boundaries in all rows of a map to this width, without a look at orbits.

    Halved, round by round, are the stretches of a row between two lanes that move differently, and
    those beside which, in the row above or below, a lane moves differently: so islands and windows
    are found that no lane of their own row shows. Returns the boundaries of each value of the
    second parameter that has any, and the number of lanes that this takes. ``config`` is from
    `refinable`, the axes of the result are its two sweeps.
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
    """Follow the motions of both directions to where they end and the sweep jumps.

    ``config`` is from `computable`, the stretches, in which directions differ, are those of this
    result. Where a motion has no orbit, or it goes on, a jump lies between two lanes; elsewhere its
    place is known to the width.
    """
    found: list[Boundary] = []
    outermost = np.array([(one.first, one.last) for one in stretches], np.intp).reshape(-1, 2).T
    ways = zip(WAYS, directions_of(result), outermost[::-1], (1, -1), strict=True)
    for way, one_way, end, step in ways:
        edges = _edges_of(one_way)
        # Next to its end a lane may still be on its way: the orbit is that of the lane before.
        inner = np.clip(end - step, *outermost)
        there = (end + step >= 0) & (end + step < edges.size)
        last, beyond = edges[end[there]], edges[end[there] + step]
        if not last.size:
            continue
        further = 2.0 * beyond["value"] - last["value"]
        followed = _followed(config, edges[inner[there]], further, width)
        continues = np.isin(followed.loss, NO_LOSS)
        stable = np.where(continues, last["value"], followed.stable_value)
        lost = np.where(continues, beyond["value"], followed.beyond_value)
        for n, kind in enumerate(followed.loss):
            loss = STABILITY_LOSS_TEXTS[kind] if last["period"][n] else ""
            sides = (float(stable[n]), last["label"][n]), (float(lost[n]), beyond["label"][n])
            (below, one), (above, other) = sides[::step]
            multiplier = complex(followed.multiplier[n])
            found.append(Boundary(below, above, one, other, loss, multiplier, way))
    return sorted(found, key=lambda boundary: boundary.below)


def _edges_of(result: Result) -> Array:
    """Return the edges that the lanes of a result with labels are, in their order."""
    columns = [result.lanes(name) for name in (*LABELS, "end_state")]
    edges = _edges(result.along(result.axis), result.variables["motion"].flags, *columns)
    if "return_distance" in result:
        distance = result.lanes("return_distance")
        edges["far"] = (edges["period"] > 0) & ~(distance <= TOLERANCE)
    return edges


def _edges(
    values: Floats, flags: Sequence[str], motion: Array, period: Array, state: Floats
) -> Array:
    """Return of each lane value, label, period, state, and whether that is far from its orbit."""
    fields = [("value", "f8"), ("label", object), ("period", "i4"), ("far", "?")]
    edges = np.zeros(values.size, [*fields, ("state", "f8", state.shape[1:])])
    edges["value"], edges["period"], edges["state"] = values, period, state
    kinds = zip(motion.tolist(), period.tolist(), strict=True)
    edges["label"] = [label_text(flags[m], n) for m, n in kinds]
    return edges


def _computed(run: RunPlan, values: Mapping[str, Floats]) -> Array:
    """Compute lanes at values of the swept parameters, the first one first, as the sweep would."""
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
) -> list[tuple[str, complex]]:
    """Follow the orbits below a boundary upwards, and those above it downwards."""
    # Close to a bifurcation the label changes a little before or after it: one lane further.
    upwards = _followed(config, below, above["value"] + spacing)
    downwards = _followed(config, above, below["value"] - spacing)
    losses = []
    for number in range(spacing.size):
        sides = [
            (followed.loss[number], complex(followed.multiplier[number]))
            for followed, edge in ((upwards, below), (downwards, above))
            if edge["period"][number] > 0
        ]
        loss, multiplier = min(sides, key=itemgetter(0), default=(None, complex("nan")))
        losses.append(("" if loss is None else STABILITY_LOSS_TEXTS[loss], multiplier))
    return losses


def _followed(config: Configuration, edge: Array, last: Floats, width: float = np.inf) -> Followed:
    def system(values: Floats) -> LaneSystem:
        return system_of(config, {config.sweep.parameter: values}, config.needed_effects)

    first, state = edge["value"], edge["state"].copy()
    lanes = np.flatnonzero(edge["far"])
    if lanes.size:
        # Where a longer look told the orbit, the end of the record may be far away.
        longer = sum(LONGER_RECORDS) * config.integration.recorded_periods
        further = plan_of(config, transient_periods=longer, recorded_periods=0)
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
