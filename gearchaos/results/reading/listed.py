"""Stages, jumps, shares and basins of a result as tables: headings with units, and rows."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from gearchaos.outputs.names import LARGEST_EXPONENT
from gearchaos.results.reading.ensembles import Basins, Counted, MotionShares
from gearchaos.results.reading.jumps import Apart, Jump
from gearchaos.results.reading.stage_table import Stage
from gearchaos.results.reading.tables import unit_text

if TYPE_CHECKING:
    from gearchaos.results.reading.result import Result


class Listed(NamedTuple):
    """A table. Each heading ends with the unit in brackets, ``[1]`` for a pure number."""

    headings: list[str]
    rows: list[list[Any]]


def unit_of_axis(result: "Result", name: str) -> str:
    """Return the unit of a swept parameter as plain text, also if `Result.sel` has fixed it."""
    known = result.variables | result.fixed_axes
    return unit_text(known[name]) if name in known else "1"


def list_stages(result: "Result", stages: Sequence[Stage]) -> Listed:
    """List stages: ends, motion, period, lanes, range of the exponent, most bands."""
    unit = unit_of_axis(result, result.axis)
    rate = unit_text(result.variables[LARGEST_EXPONENT]) if LARGEST_EXPONENT in result else "1"
    headings = [f"from [{unit}]", f"to [{unit}]", "motion", "period [1]", "lanes [1]"]
    headings += [f"lowest exponent [{rate}]", f"highest exponent [{rate}]", "most bands [1]"]
    rows = [
        [
            *(one.start, one.end, one.label, one.period, one.lanes),
            *(one.lowest_exponent, one.highest_exponent, max(one.bands, default=0)),
        ]
        for one in stages
    ]
    return Listed(headings, rows)


def list_jumps(result: "Result", jumping: Sequence[Jump]) -> Listed:
    """List jumps: the two values between which the motion jumps, and its label at both."""
    unit = unit_of_axis(result, result.axis)
    rows = [[one.below, one.above, one.label] for one in jumping]
    return Listed([f"from [{unit}]", f"to [{unit}]", "motion"], rows)


def list_apart(result: "Result", stretches: Sequence[Apart]) -> Listed:
    """List the intervals where the upward and the downward sweep differ, and both motions."""
    unit = unit_of_axis(result, result.axis)
    rows = [[one.start, one.end, one.motion_upwards, one.motion_downwards] for one in stretches]
    headings = [f"from [{unit}]", f"to [{unit}]", "motion upwards", "motion downwards"]
    return Listed(headings, rows)


def list_shares(result: "Result", counted: MotionShares) -> Listed:
    """List the shares of motions at each value, with their confidence intervals of 95 %."""
    headings = [f"{result.axis} [{unit_of_axis(result, result.axis)}]", "lanes [1]"]
    for words in ("period 1", "other motion", "keeps contact"):
        headings += [f"{words} [1]", f"{words}, 95 % from [1]", f"{words}, 95 % to [1]"]
    headings += [f"lanes with {motion} [1]" for motion in counted.motions]
    rows = []
    for at, value in enumerate(counted.values.tolist()):
        share, low, high = share_and_interval(counted.other, at)
        apart = share_and_interval(counted.apart, at)
        # The share of a complement has the complements of the bounds.
        smooth = 1.0 - share, 1.0 - high, 1.0 - low
        kept = 1.0 - apart[0], 1.0 - apart[2], 1.0 - apart[1]
        lanes, counts = int(counted.other.lanes[at]), counted.counts[at].tolist()
        rows.append([value, lanes, *smooth, share, low, high, *kept, *counts])
    return Listed(headings, rows)


def share_and_interval(counted: Counted | None, at: int) -> tuple[float, float, float]:
    """Return share, lower and upper bound of one value; NaN where nothing was counted."""
    if counted is None:
        return math.nan, math.nan, math.nan
    low, high = counted.intervals[at].tolist()
    return float(counted.shares[at]), low, high


def list_basins(found: Basins) -> Listed:
    """List the basins of all values: number, motion, multiplier, exponent, share with interval."""
    headings = [f"{found.parameter} [{unit_of_axis(found.result, found.parameter)}]"]
    headings += ["number", "motion", "period [1]", "multiplier [1]"]
    headings += [f"exponent [{found.units.get(LARGEST_EXPONENT, '1')}]"]
    headings += ["starts [1]", "share [1]", "share, 95 % from [1]", "share, 95 % to [1]"]
    rows = [
        [
            *(one.value, one.number if one.number > 0 else "", one.motion, one.period),
            *(one.multiplier, one.exponent, one.starts, one.share, *one.share_95_percent),
        ]
        for one in found.basins
    ]
    return Listed(headings, rows)
