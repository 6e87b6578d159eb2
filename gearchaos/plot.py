"""Draw a result file as PNG and PDF next to it.

A sweep of one parameter becomes its bifurcation diagram above its Lyapunov chart. A sweep of two
parameters becomes maps of motion, exponent and contact. A response becomes one page for each lane,
with time history, phase portrait, Poincare section and amplitude spectrum. A file of branches
becomes a page of its orbits above their Floquet multipliers, a file of boundaries a page of curves
over both parameters.

--variable names what is drawn. For a sweep it is a section variable (default: section_delta_5), any
variable with one number per lane, or an amplitude such as amplitude_transmission_error. For a map
it is any variable with one number per lane (default: motion, exponent and contact). For a response
it is a coordinate (default: delta_5) or another variable over time, such as mesh_force_tangential.

Settings of a matplotlibrc file that differ from the defaults of matplotlib replace those of the
style. Texts stay texts in SVG, and fonts are embedded in PDF.

--stages omits stages that are narrower than a 150th of the axis: they are merged into the
surrounding stage, or into a stage of several motions.

The paths of the figures go to stdout. A figure that gearchaos drew before is replaced, so that
the command can be repeated; any other file of that name is kept unless --overwrite is given.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import FigureError
from gearchaos.options import Option, Overwrite, Place, Units, placed_coordinates
from gearchaos.progress import count_of, progress, say

if TYPE_CHECKING:
    from gearchaos.figures.page import Page
    from gearchaos.results.reading.result import Result

    Sheet = tuple[str, Callable[[], Page]]
    """One page: the end of its name, after that of the result, and the function that draws it."""

RESULT_ENDINGS = (".h5", ".hdf5", ".nc")
OTHER_PICTURES = ("avif", "bmp", "gif")  # Endings that not every version of matplotlib supports.


class PlotOptions(NamedTuple):
    """Options of ``gearchaos plot``."""

    results: Annotated[
        tuple[Path, ...],
        Option(
            "result file of a sweep or a response; several sweeps are drawn into one diagram",
            "RESULT.h5",
            positional=True,
            file=True,
        ),
    ]
    output: Annotated[
        str | None,
        Option(
            "folder of the figures, or name of the figure; an ending such as .pdf selects the "
            "format",
            "PATH",
            ("-o", "--output"),
            file=True,
        ),
    ] = None
    formats: Annotated[
        str | None,
        Option(
            "formats of the figures: png, pdf, svg, eps or tiff, with commas between them "
            "(default: the ending of --output, or png,pdf)",
            "FORMATS",
            ("--format",),
        ),
    ] = None
    variables: Annotated[
        tuple[str, ...],
        Option(
            "variable to draw; the end of --help describes the choices; may be repeated, for one "
            "figure of each",
            "NAME",
            ("--variable",),
        ),
    ] = ()
    label: Annotated[
        tuple[str, ...],
        Option("legend entry of a result, in the order of the results; may be repeated", "TEXT"),
    ] = ()
    title: Annotated[str | None, Option("title of the figure (default: none)", "TEXT")] = None
    font: Annotated[str | None, Option("font of all texts but formulae, such as Arial", "NAME")] = (
        None
    )
    low: Annotated[
        float | None, Option("lowest value of the parameter to show", "VALUE", ("--from",))
    ] = None
    high: Annotated[
        float | None, Option("highest value of the parameter to show", "VALUE", ("--to",))
    ] = None
    at: Annotated[
        tuple[Place, ...],
        Option(
            "draw the slice nearest to this value of a second parameter or of start; may be "
            "repeated; VALUE is enough for a single axis",
            "NAME=VALUE",
        ),
    ] = ()
    mark: Annotated[
        tuple[Place, ...],
        Option(
            "mark this value of a swept parameter by a line across a map or a tick in a diagram; "
            "may be repeated; VALUE is enough for a single axis",
            "NAME=VALUE",
        ),
    ] = ()
    stages: Annotated[bool, Option("shade the stages behind the diagram of a sweep")] = False
    lines: Annotated[
        bool,
        Option(
            "draw variables with one number per lane as lines, broken at jumps and where the "
            "motion changes; sections stay dots"
        ),
    ] = False
    shares: Annotated[
        bool,
        Option(
            "draw the share of gear pairs and starts that settles on each motion, at each value"
        ),
    ] = False
    control: Annotated[
        bool,
        Option(
            "draw a sweep with [control]: the diagrams without and with it, and the effort below"
        ),
    ] = False
    branches: Annotated[
        Path | None,
        Option(
            "draw the branches of this file of gearchaos branches into the diagram",
            "BRANCHES.h5",
            file=True,
        ),
    ] = None
    boundaries: Annotated[
        Path | None,
        Option(
            "draw the curves of this file of gearchaos boundaries over the map",
            "BOUNDARIES.h5",
            file=True,
        ),
    ] = None
    width: Annotated[
        float | None,
        Option(
            "width of the page (default: 85, one column of a journal; for a response 180, two "
            "columns)",
            "MM",
            low=60,
            high=1000,
        ),
    ] = None
    height: Annotated[
        float | None,
        Option("height of the page (default: follows from the width)", "MM", low=70, high=1000),
    ] = None
    dpi: Annotated[int, Option("pixels per inch (default: %(default)s)", low=50, high=1200)] = 300
    overwrite: Overwrite = False
    units: Units = None

    @property
    def variable(self) -> str | None:
        """The variable to draw, None for the default."""
        return self.variables[0] if self.variables else None

    def one_by_one(self) -> "list[PlotOptions]":
        """Return options for one figure of each variable."""
        each: list[tuple[str, ...]] = [(name,) for name in dict.fromkeys(self.variables)]
        return [self._replace(variables=one) for one in each or [()]]


def _plot(options: PlotOptions) -> None:
    from gearchaos.figures.response import is_response
    from gearchaos.results.files.boundary_reader import is_boundary_file
    from gearchaos.results.files.branch_reader import is_branch_file
    from gearchaos.results.reading.physical_units import in_units

    if any(map(is_boundary_file, options.results)):
        _plot_boundaries(options)
        return
    if any(map(is_branch_file, options.results)):
        _plot_branches(options)
        return
    results = [_opened(path, options.at, options.control) for path in options.results]
    responses = [is_response(one) for one in results]
    pairs = zip(results, responses, strict=True)
    results = [in_units(one, options.units, over_time) for one, over_time in pairs]
    if any(responses):
        refused = ("stages", "lines", "shares", "control", "mark", "branches", "boundaries")
        _draws_alone("a response", options, *refused)
    make = _response_sheets if responses[0] else _sweep_sheets
    sheets = [sheet for one in options.one_by_one() for sheet in make(results, one)]
    if options.units == ("dimensionless" if responses[0] else "physical"):
        # The other units are the default.
        sheets = [(f"{name}_{options.units}", draw) for name, draw in sheets]
    targets = [_targets(options, name, len(sheets) == 1) for name, _ in sheets]
    size = _write(sheets, targets, options)
    say(f"{'; '.join(map(_lanes_in_words, results))}, {size}")


def _write(
    sheets: "Sequence[Sheet]", targets: Sequence[Sequence[Path]], options: PlotOptions
) -> str:
    """Draw and write pages in their formats, and return the size of the last one in words."""
    from gearchaos.figures.page import check_figures, save_figure
    from gearchaos.figures.style import with_font

    sources = [*options.results, *filter(None, (options.branches, options.boundaries))]
    check_figures([path for paths in targets for path in paths], sources, options.overwrite)
    with progress(len(sheets), unit="pages") as bar, with_font(options.font):
        for (_, draw), paths in zip(sheets, targets, strict=True):
            figure = _titled(draw(), options.title)
            for path in paths:
                save_figure(figure, path, dpi=options.dpi)
                bar.write(str(path))
            bar.update()
    width, height = (25.4 * inches for inches in figure.get_size_inches())
    return f"{width:.0f} mm x {height:.0f} mm at {options.dpi} dpi"


def _titled(figure: "Page", title: str | None) -> "Page":
    """Return a page with a title above all of it."""
    from gearchaos.figures.labels import plain
    from gearchaos.figures.page import continued

    if title:
        before = figure.get_suptitle()
        with continued(figure):
            figure.suptitle("\n".join(filter(None, (plain(title), before))))
    return figure


def _plot_branches(options: PlotOptions) -> None:
    """Draw the page of a file of branches."""
    from gearchaos.figures.branches import branches_page
    from gearchaos.figures.style import SINGLE_COLUMN_MM
    from gearchaos.results.files.branch_reader import read_branches

    refused = ("stages", "lines", "shares", "mark", "at", "branches", "boundaries", "units")
    _draws_alone("a file of branches", options, *refused)
    found = read_branches(options.results[0])
    width, between = options.width or SINGLE_COLUMN_MM, (options.low, options.high)
    size: dict[str, Any] = {"between": between, "width_mm": width, "height_mm": options.height}
    shown = [one.variable for one in options.one_by_one()]
    sheets: list[Sheet] = [
        ("" if name is None else f"_{name}", partial(branches_page, found, name, **size))
        for name in shown
    ]
    targets = [_targets(options, name, len(sheets) == 1) for name, _ in sheets]
    drawn = _write(sheets, targets, options)
    orbits = sum(one.value.size for one in found.branches)
    held = f"{count_of(len(found.branches), 'branch', 'branches')}, {count_of(orbits, 'orbit')}"
    say(f"{held} over {found.parameter.name}, {drawn}")


def _plot_boundaries(options: PlotOptions) -> None:
    """Draw the page of a file of boundaries."""
    from gearchaos.figures.boundaries import boundaries_page
    from gearchaos.figures.style import SINGLE_COLUMN_MM
    from gearchaos.results.files.boundary_reader import read_boundaries

    refused = (
        "variable",
        "stages",
        "lines",
        "shares",
        "mark",
        "at",
        "branches",
        "boundaries",
        "units",
    )
    _draws_alone("a file of boundaries", options, *refused)
    found = read_boundaries(options.results[0])
    width, between = options.width or SINGLE_COLUMN_MM, (options.low, options.high)
    size: dict[str, Any] = {"between": between, "width_mm": width, "height_mm": options.height}
    draw = partial(boundaries_page, found, **size)
    drawn = _write([("", draw)], [_targets(options, "", alone=True)], options)
    names = " and ".join(one.name for one in found.parameters)
    say(f"{len(found.boundaries)} boundaries over {names}, {drawn}")


def _with_boundaries(
    result: "Result", options: PlotOptions, draw: "Callable[[], Page]"
) -> "Callable[[], Page]":
    """Return the function that draws a map with the curves of --boundaries."""
    if options.boundaries is None:
        return draw
    from gearchaos.figures.boundaries import add_boundaries
    from gearchaos.figures.lanes import map_axes
    from gearchaos.figures.overlaid_files import boundaries_over

    found = boundaries_over(options.boundaries, result, options.units)

    def drawn() -> "Page":
        figure = draw()
        add_boundaries(figure, found, map_axes(result))
        return figure

    return drawn


def _with_branches(
    results: "Sequence[Result]", options: PlotOptions, draw: "Callable[[], Page]"
) -> "Callable[[], Page]":
    """Return the function that draws a diagram with the branches of --branches."""
    if options.branches is None:
        return draw
    from gearchaos.figures.branches import add_branches
    from gearchaos.figures.overlaid_files import branches_over

    given = options.results[0], options.variable, options.units
    found = branches_over(options.branches, results, *given)

    def drawn() -> "Page":
        figure = draw()
        between = (options.low, options.high)
        add_branches(figure, found, options.variable, between=between)
        return figure

    return drawn


def _draws_alone(page: str, options: PlotOptions, *refused: str) -> None:
    """Raise a FigureError for what only diagrams of sweeps support: several results, some flags.

    ``refused``: names of these flags without their dashes.
    """
    from gearchaos.figures.overlaid_files import draws_alone

    given = {name: getattr(options, name) for name in refused}
    if "units" in given:
        given["units"] = given["units"] == "physical"
    faults = {f"--{name}": "have it" for name, value in given.items() if value}
    faults |= {str(path): "are drawn over each other" for path in options.results[1:]}
    for fault, rule in faults.items():
        raise FigureError(f"{fault}: {draws_alone(rule, page)}")


def _labels(results: "Sequence[Result]", options: PlotOptions) -> list[str]:
    """Return the legend entry of each result: those of --label, or the titles."""
    if not options.label:
        return _titles(results, options.results)
    if len(options.label) != len(results):
        raise FigureError(
            f"--label: is given {len(options.label)} times for {len(results)} results; give one "
            "for each result, or none"
        )
    return [*options.label]


def _titles(results: "Sequence[Result]", paths: Sequence[Path]) -> list[str]:
    """Return the titles of results, or the names of their files if two titles are the same."""
    titles = [str(one.metadata.get("title", "")) for one in results]
    return titles if all(titles) and len({*titles}) == len(paths) else [one.stem for one in paths]


def _sweep_sheets(results: "Sequence[Result]", options: PlotOptions) -> "list[Sheet]":
    """Return the page of one or several sweeps."""
    from gearchaos.figures import bifurcation_page, control_sweep_page, map_page, shares_page
    from gearchaos.figures.labels import in_words
    from gearchaos.figures.lanes import swept_axes
    from gearchaos.figures.overlaid_files import of_map, refuse_boundaries_of_diagram
    from gearchaos.figures.style import SINGLE_COLUMN_MM

    name = _detail(results[0], options)
    marked = _marked(options, results[0], swept_axes(results[0]))
    width, height = options.width or SINGLE_COLUMN_MM, options.height
    between = (options.low, options.high)
    for chosen, kind, draw_page in (
        (options.shares, "shares", shares_page),
        (options.control, "control", control_sweep_page),
    ):
        if not chosen:
            continue
        refused = ("variable", "stages", "lines", "branches", "boundaries")
        _draws_alone(f"a figure of {kind}", options, *refused)
        return [(f"{name}_{kind}", partial(draw_page, results[0], between, width, height))]
    size: dict[str, Any] = {"between": between, "width_mm": width, "height_mm": height}
    maps = [axes for axes in map(swept_axes, results) if len(axes) > 1]
    if maps:
        _draws_alone(of_map(maps[0][0]), options, "stages", "lines", "branches")
        draw = partial(map_page, results[0], options.variable, marked=marked, **size)
        name += "_with_boundaries" if options.boundaries else ""
        return [(name, _with_boundaries(results[0], options, draw))]
    if options.boundaries:
        refuse_boundaries_of_diagram(options.boundaries)
    name += "_stages" if options.stages else ""
    name += "_lines" if options.lines else ""
    shown: dict[str, Any] = {"stages": options.stages, "lines": options.lines}
    shown["labels"] = _labels(results, options)
    if marked:
        shown["marked"] = (in_words(results[0], marked), [*marked.values()])
    draw = partial(bifurcation_page, results, options.variable, **shown, **size)
    name += "_with_branches" if options.branches else ""
    return [(name, _with_branches(results, options, draw))]


def _detail(result: "Result", options: PlotOptions) -> str:
    """Return the end of a figure's name: a detail must not replace the figure of the whole."""
    from gearchaos.figures.labels import in_a_name
    from gearchaos.models.gear_pair.outputs import DEFAULT_VARIABLE

    name = in_a_name(result.fixed, digits=6)
    if options.variable not in (None, DEFAULT_VARIABLE):
        name += f"_{options.variable}"
    for word, end in (("from", options.low), ("to", options.high)):
        name += "" if end is None else f"_{word}_{end:g}"
    return name


def _marked(options: PlotOptions, result: "Result", swept: Sequence[str]) -> dict[str, float]:
    """Return the value of --mark for each axis; a FigureError if it lies on no axis."""
    marked = placed_coordinates(options.mark, swept, option="--mark")
    if unknown := [axis for axis in marked if axis not in swept]:
        raise FigureError(
            f"--mark {unknown[0]}: is no swept parameter of the figure, which are "
            f"{', '.join(swept)}"
        )
    for axis, value in marked.items():
        low, high = float(result[axis].min()), float(result[axis].max())
        if not low <= value <= high:
            raise FigureError(f"--mark {value:g}: {axis} runs from {low:g} to {high:g}")
    return marked


def _response_sheets(results: "Sequence[Result]", options: PlotOptions) -> "list[Sheet]":
    """Return a page for each lane of a response that did not diverge."""
    from gearchaos.figures import response_page
    from gearchaos.figures.labels import in_a_name, place_of
    from gearchaos.figures.lanes import select_lanes
    from gearchaos.figures.response import COORDINATE
    from gearchaos.figures.style import DOUBLE_COLUMN_MM

    (result,) = results
    lanes = select_lanes(result, (options.low, options.high))
    if lanes.diverged.all():
        raise FigureError(f"{options.results[0]}: nothing to draw: every lane diverged")
    coordinate = "" if options.variable in (None, COORDINATE) else f"_{options.variable}"
    draw = partial(
        response_page,
        result,
        coordinate=options.variable,
        width_mm=options.width or DOUBLE_COLUMN_MM,
        height_mm=options.height,
    )
    return [
        (f"{in_a_name(place_of(result, lane))}{coordinate}", partial(draw, lane))
        for lane in lanes.numbers[~lanes.diverged].tolist()
    ]


def _opened(path: Path, at: Sequence[Place], whole: bool = False) -> "Result":
    """Read a result at the places that --at names; of a map, unless whole, without sections."""
    from gearchaos.figures.lanes import swept_axes
    from gearchaos.results.reading.result import open_result

    for rows in (False, True):  # Sections are the largest part of a file.
        result = open_result(path, rows=rows)
        fixed = placed_coordinates(at, result.axes, result.axis)
        left = {*swept_axes(result)} - {*fixed}
        if fixed and not left:
            raise FigureError(
                f"--at {' and '.join(fixed)}: nothing is left to draw against; choose values of "
                f"{result.axis} with --from and --to"
            )
        result = result.sel(method="within", **fixed)
        if len(left) > 1 and not whole:
            break
    return result


def _targets(options: PlotOptions, name: str, alone: bool) -> list[Path]:
    """Return the path of a page in each format; ``alone``: it is the only page."""
    from matplotlib.backend_bases import FigureCanvasBase

    from gearchaos.figures.page import ENDINGS, FORMATS

    path = options.results[0]
    output, asked = path.parent if options.output is None else Path(options.output), FORMATS
    if options.output is None or output.is_dir() or options.output.endswith(("/", "\\")):
        stems = (
            one.stem if one.suffix.lower() in RESULT_ENDINGS else one.name
            for one in options.results
        )
        output /= f"{'_and_'.join(stems)}{name}"
    else:
        ending = output.suffix.lower().removeprefix(".")
        if ending in {*FigureCanvasBase.filetypes, *OTHER_PICTURES}:
            output, asked = output.with_suffix(""), (ending,)
        output = output.with_name(f"{output.name}{'' if alone else name}")
    if options.formats is not None:
        asked = tuple(options.formats.split(","))
    formats = dict.fromkeys(kind.strip().lower() for kind in asked)
    if unknown := [repr(kind) for kind in formats if kind not in ENDINGS]:
        raise FigureError(f"{', '.join(unknown)}: a figure is written as {', '.join(ENDINGS)}")
    return [output.with_name(f"{output.name}.{kind}") for kind in formats]


def _lanes_in_words(result: "Result") -> str:
    """Return a phrase with the number of lanes and what they run over."""
    from gearchaos.figures.lanes import swept_axes

    lanes = result.along(result.axis).size
    words = f"{count_of(lanes, 'lane')} over {' and '.join(swept_axes(result))}"
    words += f" at {result.where}" if result.fixed else ""
    diverged = int((result["status"] != 0).sum())
    return f"{words}, {diverged} of them diverged" if diverged else words


main = Command("plot", __doc__, PlotOptions, _plot).start(__name__)
