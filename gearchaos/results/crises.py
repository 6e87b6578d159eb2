"""Crises of a sweep: where the extent of chaotic sections grows at once between two lanes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.records.crisis import BESIDE, grows_at
from gearchaos.results.result import Result, section_variables
from gearchaos.results.stage_table import labelled_lanes


class Crisis(NamedTuple):
    """Two neighbouring values of the swept parameter between which chaos grows or shrinks at once.

    ``section`` is the variable in which it does so most; the four others are the smallest and
    largest value that it takes on the eight lanes below and above.
    """

    below: float
    above: float
    section: str
    lowest_below: float
    highest_below: float
    lowest_above: float
    highest_above: float


def crises(result: Result) -> list[Crisis]:
    """Find where a sweep has a crisis, see `grows_at`, with the parameter growing or falling.

    The result has one axis and labels; without a section nothing is found.
    """
    lanes = labelled_lanes(result)
    chaotic = lanes.labels == "chaotic"
    found: dict[int, tuple[float, Crisis]] = {}
    for name in section_variables(result):
        lowest, highest = np.min(result[name], axis=1), np.max(result[name], axis=1)
        extent = highest - lowest
        upwards = grows_at(extent, chaotic)
        downwards = extent.size - grows_at(extent[::-1], chaotic[::-1])
        for lane in (*upwards.tolist(), *downwards.tolist()):
            below, above = slice(max(0, lane - BESIDE), lane), slice(lane, lane + BESIDE)
            sides = [(np.nanmin(lowest[side]), np.nanmax(highest[side])) for side in (below, above)]
            one, other = (high - low for low, high in sides)
            growth = max(one / other, other / one)
            crisis = Crisis(
                float(lanes.values[lane - 1]),
                float(lanes.values[lane]),
                name,
                *(float(end) for side in sides for end in side),
            )
            if lane not in found or growth > found[lane][0]:
                found[lane] = (growth, crisis)
    return [found[lane][1] for lane in sorted(found)]
