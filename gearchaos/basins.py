"""Find the attractors of a sweep from many starts, and which share of the starts leads to each.

A periodic attractor is a polished orbit, any other the section of a long record; they keep their
numbers along the sweep. The table goes to stdout, everything else to stderr. Exit codes: 0 done, 2
the command line asks for what cannot be, 4 a file cannot be read or written or holds no labels.
"""

import argparse
import json
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.command_line import OK, Command, coordinates, place

if TYPE_CHECKING:
    from gearchaos.results.basins import Basin, Basins

WIDTH = 80
"""Columns of a terminal."""


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("result", metavar="RESULT.h5", help="result file of a sweep from several starts")
    text = (
        "draw the basins of one value over the two states of a grid of starts, or the shares of "
        "several values, into this file, such as basins.png or basins.pdf"
    )
    add("-o", "--output", type=Path, metavar="FIGURE", help=text)
    text = (
        "where to fix a parameter or another axis, at the nearest of its values; may be repeated "
        "(default: the first value of each but the first swept parameter)"
    )
    add("--at", type=place, action="append", default=[], metavar="NAME=VALUE", help=text)
    add("--json", action="store_true", help="print JSON, with sections and means of all variables")


def _basins(options: argparse.Namespace) -> int:
    from gearchaos.engine.basins import find_basins
    from gearchaos.engine.running import compiling
    from gearchaos.figures import basins_page, save_figure
    from gearchaos.figures.files import is_own_figure
    from gearchaos.results.atomic_file import check_output
    from gearchaos.results.overview import finite, slice_lines
    from gearchaos.results.result import open_result
    from gearchaos.results.stage_table import slice_facts
    from gearchaos.results.variables import REPEATS, START

    if options.output:
        check_output(options.output, overwrite=options.overwrite or is_own_figure(options.output))
    whole = open_result(options.result)
    part = whole.sel("nearest", **coordinates(options.at, whole.axes, whole.axis))
    kept = {START} | ({part.axis} - {*REPEATS})
    part = part.sel(**{axis: part[axis][0] for axis in part.axes if axis not in kept})
    with compiling():
        found = find_basins(part, options.result, options.threads)
    where = slice_facts(whole, part)
    if options.json:
        facts = {"parameter": found.parameter, "slice": where, "values": [*_values(found)]}
        print(json.dumps(finite(facts), indent=1, allow_nan=False))
    else:
        print("\n".join([*table(found, slice_lines(where))]))
    if options.output:
        title = str(whole.metadata.get("title", ""))
        save_figure(basins_page(found), options.output, title=title)
    return OK


def table(found: "Basins", where: list[str]) -> Iterator[str]:
    """Word the basins as lines of a table, no longer than 80 characters."""
    yield f"basins over {found.parameter}, {found.numbers.shape[1]} starts at each value"
    yield from where
    head = f"{'value':>10}  {'no':>3}  {'motion':15}{'multiplier':>10}  {'exponent':>9}"
    yield f"{head}  {'share':>7}  95 % confidence"
    for one in found.basins:
        low, high = one.starts.intervals
        number = str(one.number) if one.number > 0 else "-"
        yield (
            f"{one.value:10.6g}  {number:>3}  {one.motion:15}{_known(one.multiplier, 10)}  "
            f"{_known(one.exponent, 9)}  {one.starts.shares:7.4f}  {low:.4f} to {high:.4f}"
        )
    for value, entropy in zip(found.values, found.entropy, strict=False):
        told = f"basin entropy {entropy.basin:.4f}, of the boundary alone {entropy.boundary:.4f}"
        yield f"{value:10.6g}  {told}"
    for one in found.basins if found.values.size == 1 else ():
        means = (f"{name} {mean:.4g}" for name, mean in one.means.items() if mean == mean)
        if one.number > 0:
            lead = f"{one.number}: "
            yield from textwrap.wrap(lead + ", ".join(means), WIDTH, subsequent_indent="   ")


def _known(value: float, width: int) -> str:
    return f"{value:{width}.4f}" if value == value else " " * width


def _values(found: "Basins") -> Iterator[dict[str, Any]]:
    for at, value in enumerate(found.values.tolist()):
        facts: dict[str, Any] = {"value": value, "starts": found.numbers.shape[1]}
        if found.entropy:
            basin, boundary = found.entropy[at]
            facts |= {"basin_entropy": basin, "boundary_basin_entropy": boundary}
        here = [_facts(one) for one in found.basins if one.value == value]
        yield facts | {"basins": here}


def _facts(one: "Basin") -> dict[str, Any]:
    facts = one._asdict() | {"number": one.number if one.number > 0 else None}
    facts |= {"starts": int(one.starts.counts), "share": float(one.starts.shares)}
    facts |= {"share_95_percent": one.starts.intervals.tolist()}
    # That of a motion without a period would be thousands of points.
    return facts | {"section": one.section.tolist() if one.period else None}


main = Command("basins", __doc__, _arguments, _basins, common=("overwrite", "threads"))

if __name__ == "__main__":
    sys.exit(main())
