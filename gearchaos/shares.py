"""Print which share of drawn gear pairs or random starts moves in which way, at each swept value.

The shares are those of motions that are smooth, which means that they repeat with the excitation
(period 1), of all other motions, and of motions that lose contact. Each has its 95 % confidence
interval (Wilson 1927). python -m gearchaos.plot --shares draws them.

The table goes to stdout, everything else to stderr.
"""

import json
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import (
    AsCsv,
    Option,
    Place,
    ResultFile,
    one_format,
    placed_coordinates,
)

if TYPE_CHECKING:
    from gearchaos.results.reading.ensembles import Counted, MotionShares
    from gearchaos.results.reading.result import Result


class SharesOptions(NamedTuple):
    """Options of ``gearchaos shares``."""

    result: ResultFile
    at: Annotated[
        tuple[Place, ...],
        Option("use the nearest value of this axis; may be repeated", "NAME=VALUE"),
    ] = ()
    json: Annotated[bool, Option("print JSON instead of a table")] = False
    csv: AsCsv = False


def _shares(options: SharesOptions) -> None:
    from gearchaos.results.reading.ensembles import motion_shares
    from gearchaos.results.reading.listed import list_shares
    from gearchaos.results.reading.overview import json_values, slice_lines
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.stage_table import slice_facts
    from gearchaos.results.reading.tables import csv_text

    one_format(options.json, options.csv)
    whole = open_result(options.result, rows=False)
    result = whole.sel("within", **placed_coordinates(options.at, whole.axes, whole.axis))
    counted, where = motion_shares(result), slice_facts(whole, result)
    if options.json:
        print(json.dumps(json_values(_facts(result, counted, where)), indent=1))
    elif options.csv:
        print(csv_text(*list_shares(result, counted)))
    else:
        print("\n".join([*_table(result, counted, slice_lines(where))]))


def _facts(result: "Result", counted: "MotionShares", where: "dict[str, float]") -> dict[str, Any]:
    """Return what --json prints."""
    from gearchaos.results.reading.listed import share_and_interval, unit_of_axis

    values = []
    for at, value in enumerate(counted.values.tolist()):
        facts: dict[str, Any] = {"value": value, "lanes": int(counted.other.lanes[at])}
        for name, found in {"not_period_1": counted.other, "loses_contact": counted.apart}.items():
            share, low, high = share_and_interval(found, at)
            facts[name] = {"share": share, "share_95_percent": [low, high]}
        every = zip(counted.motions, counted.counts[at].tolist(), strict=True)
        values.append({**facts, "lanes_by_motion": dict(every)})
    return {
        "parameter": result.axis,
        "unit": unit_of_axis(result, result.axis),
        "slice": where,
        "values": values,
    }


def _table(result: "Result", counted: "MotionShares", where: list[str]) -> Iterator[str]:
    """Return the shares as lines of a table, each of at most 80 characters."""
    from gearchaos.results.reading.listed import unit_of_axis

    unit = unit_of_axis(result, result.axis)
    yield f"shares over {result.axis}" + (f" [{unit}]" if unit != "1" else "")
    yield from where
    yield "period 1: the motion repeats with the excitation; in brackets: 95 % confidence"
    yield f"{'value':>10}  {'lanes':>6}  {'period 1':>24}  {'keeps contact':>24}"
    for at, value in enumerate(counted.values.tolist()):
        cells = (_percent(1.0, found, at) for found in (counted.other, counted.apart))
        smooth, kept = cells
        yield f"{value:10.6g}  {counted.other.lanes[at]:6d}  {smooth:>24}  {kept:>24}".rstrip()


def _percent(whole: float, counted: "Counted | None", at: int) -> str:
    """Word the share of lanes that do not have a property, with its interval."""
    from gearchaos.results.reading.listed import share_and_interval

    share, low, high = (whole - bound for bound in share_and_interval(counted, at))
    return "" if math.isnan(share) else f"{share:.1%} ({high:.1%} to {low:.1%})"


main = Command("shares", __doc__, SharesOptions, _shares).start(__name__)
