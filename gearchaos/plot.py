"""Draw a result file as PNG and PDF beside it: of a sweep the bifurcation diagram over the Lyapunov
chart, of two parameters maps of motion, exponent and contact, of a response one page for each lane,
with time history, phase portrait, Poincare section and amplitude spectrum.

A figure that this command drew before is replaced, so that it can be run again and again; any
other file of that name is kept unless --overwrite is given. The paths of the figures go to
stdout.
"""

from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.command_line import Command, coordinates
from gearchaos.errors import FigureError
from gearchaos.progress import progress, say

if TYPE_CHECKING:
    from gearchaos.figures.page import Page
    from gearchaos.results.reading.result import Result

    Sheet = tuple[str, Callable[[], Page]]
    """One page: what its name says beside that of the result, and how it is drawn."""

RESULT_ENDINGS = (".h5", ".hdf5", ".nc")
OTHER_PICTURES = ("avif", "gif")  # Endings that matplotlib knows from 3.11 on.


def _plot(options: Namespace) -> None:
    from gearchaos.figures.page import check_figures, save_figure
    from gearchaos.figures.response import is_response

    results = [_opened(path, options.at) for path in options.result]
    if options.units == "physical":
        results = [one.physical() for one in results]
    responses = [is_response(one) for one in results]
    if any(responses):
        _draws_alone("a response", options, "stages", "shares", "mark")
    sheets = (_response_sheets if responses[0] else _sweep_sheets)(results, options)
    if options.units == "physical":
        sheets = [(f"{name}_physical", draw) for name, draw in sheets]
    targets = [_targets(options, name, len(sheets) == 1) for name, _ in sheets]
    check_figures([path for paths in targets for path in paths], options.result, options.overwrite)
    with progress(len(sheets), unit="pages") as bar:
        for (_, draw), paths in zip(sheets, targets, strict=True):
            figure = draw()
            for path in paths:
                save_figure(figure, path, dpi=options.dpi)
                bar.write(str(path))
            bar.update()
    width, height = (25.4 * inches for inches in figure.get_size_inches())
    size = f"{width:.0f} mm x {height:.0f} mm at {options.dpi} dpi"
    say(f"{'; '.join(map(_lanes_in_words, results))}, {size}")


def _draws_alone(page: str, options: Namespace, *others: str) -> None:
    """Refuse several results on a page other than a diagram, and the options that it lacks."""
    faults = {f"--{name}": "have it" for name in others if getattr(options, name)}
    faults |= {str(path): "are drawn over each other" for path in options.result[1:]}
    for fault, rule in faults.items():
        rule = f"only diagrams of sweeps {rule}, and here is {page}; leave it out"
        raise FigureError(f"{fault}: {rule}")


def _titles(results: "Sequence[Result]", paths: Sequence[Path]) -> list[str]:
    """Name results by their titles, or by their files where these do not tell them apart."""
    titles = [str(one.metadata.get("title", "")) for one in results]
    return titles if all(titles) and len({*titles}) == len(paths) else [one.stem for one in paths]


def _sweep_sheets(results: "Sequence[Result]", options: Namespace) -> "list[Sheet]":
    from gearchaos.figures import bifurcation_page, map_page, shares_page
    from gearchaos.figures.labels import in_a_name, in_words
    from gearchaos.figures.lanes import swept_axes
    from gearchaos.figures.style import SINGLE_COLUMN_MM
    from gearchaos.models.gear_pair.outputs import DEFAULT_VARIABLE

    # A detail does not take the place of the whole.
    name = in_a_name(results[0].fixed, digits=6)
    if options.variable not in (None, DEFAULT_VARIABLE):
        name += f"_{options.variable}"
    for word, end in (("from", options.low), ("to", options.high)):
        name += "" if end is None else f"_{word}_{end:g}"
    swept = swept_axes(results[0])
    marked = coordinates(options.mark, swept, option="--mark")
    if unknown := [axis for axis in marked if axis not in swept]:
        rule = f"no swept parameter of the figure, which are {', '.join(swept)}"
        raise FigureError(f"--mark {unknown[0]}: is {rule}")
    if options.shares:
        _draws_alone("a figure of shares", options, "variable", "stages")
        width = options.width or SINGLE_COLUMN_MM
        drawn = (options.low, options.high), width, options.height
        return [(f"{name}_shares", partial(shares_page, results[0], *drawn))]
    size = {"width_mm": options.width or SINGLE_COLUMN_MM, "height_mm": options.height}
    shown: dict[str, Any] = {"between": (options.low, options.high)}
    maps = [axes for axes in map(swept_axes, results) if len(axes) > 1]
    if maps:
        _draws_alone(f"a map, of which --at {maps[0][0]}=VALUE makes a diagram", options, "stages")
        draw = partial(map_page, results[0], options.variable, marked=marked, **shown, **size)
        return [(name, draw)]
    name += "_stages" if options.stages else ""
    shown |= {"stages": options.stages, "labels": _titles(results, options.result)}
    if marked:
        shown |= {"marked": (in_words(results[0], marked), [*marked.values()])}
    return [(name, partial(bifurcation_page, results, options.variable, **shown, **size))]


def _response_sheets(results: "Sequence[Result]", options: Namespace) -> "list[Sheet]":
    from gearchaos.figures import response_page
    from gearchaos.figures.labels import in_a_name, place_of
    from gearchaos.figures.lanes import select_lanes
    from gearchaos.figures.response import COORDINATE
    from gearchaos.figures.style import DOUBLE_COLUMN_MM

    (result,) = results
    lanes = select_lanes(result, (options.low, options.high))
    if lanes.diverged.all():
        raise FigureError(f"{options.result[0]}: nothing to draw: every lane diverged")
    coordinate = "" if options.variable in (None, COORDINATE) else f"_{options.variable}"
    size = {"width_mm": options.width or DOUBLE_COLUMN_MM, "height_mm": options.height}
    draw = partial(response_page, result, coordinate=options.variable, **size)
    return [
        (f"{in_a_name(place_of(result, lane))}{coordinate}", partial(draw, lane))
        for lane in lanes.numbers[~lanes.diverged].tolist()
    ]


def _opened(path: Path, at: Sequence[tuple[str, float]]) -> "Result":
    """Read a result, its sections too unless it is a map, with the axes fixed that --at names."""
    from gearchaos.figures.lanes import swept_axes
    from gearchaos.results.reading.result import open_result

    for rows in (False, True):  # Sections are most of a file.
        result = open_result(path, rows=rows)
        fixed = coordinates(at, result.axes, result.axis)
        left = {*swept_axes(result)} - {*fixed}
        if fixed and not left:
            raise FigureError(
                f"--at {' and '.join(fixed)}: nothing is left to draw against; choose values of "
                f"{result.axis} with --from and --to"
            )
        result = result.sel(method="within", **fixed)
        if len(left) > 1:
            break
    return result


def _targets(options: Namespace, name: str, alone: bool) -> list[Path]:
    from matplotlib.backend_bases import FigureCanvasBase

    from gearchaos.figures.page import ENDINGS, FORMATS

    path: Path = options.result[0]
    output, asked = path.parent if options.output is None else Path(options.output), FORMATS
    if options.output is None or output.is_dir() or options.output.endswith(("/", "\\")):
        stems = (
            one.stem if one.suffix.lower() in RESULT_ENDINGS else one.name for one in options.result
        )
        output /= f"{'_and_'.join(stems)}{name}"
    else:
        ending = output.suffix.lower().removeprefix(".")
        if ending in {*FigureCanvasBase.filetypes, *OTHER_PICTURES}:
            output, asked = output.with_suffix(""), (ending,)
        output = output.with_name(f"{output.name}{'' if alone else name}")
    asked = asked if options.format is None else options.format.split(",")
    formats = dict.fromkeys(kind.strip().lower() for kind in asked)
    if unknown := [repr(kind) for kind in formats if kind not in ENDINGS]:
        raise FigureError(f"{', '.join(unknown)}: a figure is written as {', '.join(ENDINGS)}")
    return [output.with_name(f"{output.name}.{kind}") for kind in formats]


def _lanes_in_words(result: "Result") -> str:
    from gearchaos.figures.lanes import swept_axes

    lanes = result.along(result.axis).size
    words = f"{lanes} lane{'s' if lanes != 1 else ''} over {' and '.join(swept_axes(result))}"
    words += f" at {result.where}" if result.fixed else ""
    diverged = int((result["status"] != 0).sum())
    return f"{words}, {diverged} of them diverged" if diverged else words


main = Command("plot", __doc__, _plot).start(__name__)
