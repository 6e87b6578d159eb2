"""Find the attractors of a sweep from many starts, and the share of the starts that leads to each.

An attractor keeps its number along the sweep. If --at chooses one value of the swept parameter, the
numbers are those of this value alone. The table goes to stdout, everything else to stderr.

With --output, the command also draws a figure: the basins of one value over the two states of a
grid of starts, or the shares of several values.
"""

import json
import math
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import (
    AsCsv,
    Option,
    Overwrite,
    Place,
    Threads,
    Units,
    one_format,
    placed_coordinates,
)

if TYPE_CHECKING:
    from gearchaos.results.reading.ensembles import Basins


class BasinsOptions(NamedTuple):
    """Options of ``gearchaos basins``."""

    result: Annotated[
        str,
        Option(
            "result file of a sweep from several starts", "RESULT.h5", positional=True, file=True
        ),
    ]
    output: Annotated[
        Path | None,
        Option(
            "draw the basins or their shares into this file, such as basins.png or basins.pdf",
            "FIGURE",
            ("-o", "--output"),
            file=True,
        ),
    ] = None
    at: Annotated[
        tuple[Place, ...],
        Option(
            "use the nearest value of this axis; may be repeated (default: the first value of each "
            "axis but the first swept parameter)",
            "NAME=VALUE",
        ),
    ] = ()
    json: Annotated[bool, Option("print JSON, with sections and means of all variables")] = False
    csv: AsCsv = False
    units: Units = None
    overwrite: Overwrite = False
    threads: Threads = None


def _basins(options: BasinsOptions) -> None:
    from gearchaos.engine.basins import find_basins
    from gearchaos.engine.running import compiling
    from gearchaos.figures import basins_page
    from gearchaos.figures.page import check_figures, save_figure
    from gearchaos.outputs.names import REPEATS, START
    from gearchaos.results.reading.basin_units import physical_basins
    from gearchaos.results.reading.listed import list_basins
    from gearchaos.results.reading.overview import json_values, slice_lines
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.stage_table import slice_facts
    from gearchaos.results.reading.tables import csv_text

    one_format(options.json, options.csv)
    whole = open_result(options.result)
    if options.output:
        check_figures([options.output], [options.result], options.overwrite)
    part = whole.sel("within", **placed_coordinates(options.at, whole.axes, START))
    kept = {START} | ({part.axis} - {*REPEATS})
    part = part.sel(**{axis: part[axis][0] for axis in part.axes if axis not in kept})
    with compiling():
        found = find_basins(part, options.result, options.threads)
    if options.units == "physical":
        found = physical_basins(found)
    where = slice_facts(whole, part)
    if options.json:
        print(json.dumps(json_values(_facts(found, where)), indent=1))
    elif options.csv:
        print(csv_text(*list_basins(found)))
    else:
        print("\n".join([*table(found, slice_lines(where))]))
    if options.output:
        save_figure(basins_page(found), options.output)


def _facts(found: "Basins", where: Any) -> dict[str, Any]:
    """Return what --json prints."""
    from gearchaos.results.reading.listed import unit_of_axis

    basins = [one._asdict() for one in found.basins]
    for one in basins:
        # The section of a motion without a period would have a thousand points.
        one["section"] = one["section"].tolist() if one["period"] else None
        one["number"] = one["number"] if one["number"] > 0 else None
    return {
        "parameter": found.parameter,
        "unit": unit_of_axis(found.result, found.parameter),
        "slice": where,
        "starts": found.numbers.shape[1],
        "basins": basins,
        "entropy": found.entropy,
        "units": dict(found.units),
    }


def table(found: "Basins", where: list[str]) -> Iterator[str]:
    """Return the basins as lines of a table, each of at most 80 characters."""
    from gearchaos.results.reading.listed import unit_of_axis

    unit = unit_of_axis(found.result, found.parameter)
    unit = "" if unit == "1" else f" [{unit}]"
    yield f"basins over {found.parameter}{unit}, {found.numbers.shape[1]} starts at each value"
    yield from where
    rate = found.units.get("lyapunov_exponent", "1")
    if rate != "1":
        yield f"exponents {rate if rate.startswith('per ') else f'in {rate}'}"
    head = f"{'value':>10}  {'no':>3}  {'motion':15}{'multiplier':>10}  {'exponent':>9}"
    yield f"{head}  {'share':>7}  95 % confidence"
    for one in found.basins:
        number = str(one.number) if one.number > 0 else "-"
        known = ["" if math.isnan(x) else f"{x:.4f}" for x in (one.multiplier, one.exponent)]
        words = f"{one.value:10.6g}  {number:>3}  {one.motion:15}{known[0]:>10}  {known[1]:>9}"
        low, high = one.share_95_percent
        yield f"{words}  {one.share:7.4f}  {low:.4f} to {high:.4f}"
    for value, (basin, boundary) in zip(found.values, found.entropy, strict=False):
        yield f"{value:10.6g}  basin entropy {basin:.4f}, of the boundary alone {boundary:.4f}"
    for one in found.basins if found.values.size == 1 else ():
        facts = [f"{name} {kind}" for name, kind in one.contact.items()]
        facts += [
            f"{name} {mean:.4g} {'' if (unit := found.units[name]) == '1' else unit}".rstrip()
            for name, mean in one.means.items()
            if not math.isnan(mean)
        ]
        if one.number > 0 and facts:
            text = f"{one.number}: {', '.join(facts)}"
            yield from textwrap.wrap(text, 80, subsequent_indent="   ")


main = Command("basins", __doc__, BasinsOptions, _basins).start(__name__)
