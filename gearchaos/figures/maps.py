"""Maps over two swept parameters: motion and period, exponent, contact, or another variable."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, LinearSegmentedColormap, ListedColormap, Normalize
from matplotlib.image import AxesImage
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import offset_copy

from gearchaos.arrays import Array, Floats, Integers, Mask
from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, check_variable, in_words, legend_title
from gearchaos.figures.lanes import Between, cell_edges, map_axes, select_lanes
from gearchaos.figures.page import Page, few_ticks, footnote, page
from gearchaos.figures.panel import legend_entries, robust_limits
from gearchaos.figures.stages import look_of
from gearchaos.figures.style import BLACK, LEGEND, SINGLE_COLUMN_MM, SMALL_FONT_PT
from gearchaos.outputs.names import CONTACT_STATE, LABELS, LARGEST_EXPONENT, STATUS
from gearchaos.results.reading.ensembles import motion_kinds
from gearchaos.results.reading.result import Result

MOST_SHOWN = 4
"""Largest number of maps on a page where none is chosen."""
"""Variables of the panels of a page, if the result has them."""

DIVERGED = "diverged"  # Kind, and legend entry, of lanes without a whole record.
NO_VALUE = "no value"  # Legend entry of lanes that did not diverge but have no number.

NUMBERS = "YlGn"
"""Colour map of numbers, and of kinds without colours of their own."""

SIGNS = {-1.0: "#3C7FB8", -0.5: "#82B1DE", 0.0: "#F7F7F7"}
SIGNS |= {0.3: "#E69F00", 0.65: "#A84300", 1.0: "#4A1500"}
"""Colours of exponents by their share of the lowest (negative) or the highest (positive) one.

As in diagrams, blue is periodic and orange is chaotic; in grey only chaos is dark.
"""

NARROWEST_MM = 60.0  # Least width of panels side by side; narrower panels are stacked.

KEY_COLUMNS = 3  # Columns of the legend between a map and its title.
ROW_PT = 1.5 * SMALL_FONT_PT  # Height of a row of the legend.
BAR_ROWS = 2  # Rows that a colour bar takes.


def parameter_map(
    axes: Axes, result: Result, variable: str = LABELS[0], *, between: Between = (None, None)
) -> ScalarMappable:
    """Draw one variable of the lanes as a map over two swept parameters into axes.

    Parameters
    ----------
    axes : Axes
        The axes to draw into.
    result : Result
        A result over two swept parameters, the first one along x, with one lane per pair of values.
    variable : str
        "motion", another variable with flags, or a variable with one number per lane.
    between : (float or None, float or None)
        Part of the first parameter's range to show; None is the end of the sweep.

    Returns
    -------
    ScalarMappable
        The image. Its array has shape (values of the second parameter, shown values of the first).
        It holds the numbers of the kinds, or numbers that are masked where a lane has none.

    Raises
    ------
    FigureError
        If the variable is missing, no lane is in the range, or the axes are not two parameters.
    FileError
        If the motion is requested and the result has no labels.

    Notes
    -----
    Each lane is a cell that ends halfway to its neighbours. The motion has the colours and hatches
    of the diagrams; exponents have colours that part at zero. Lanes without a number are grey or
    hatched, and the legend gives the reason. The cells are an image, so that a PDF stays small.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> image = figures.parameter_map(axes, gearchaos.open_result("chart.h5"), "period")
    >>> image.get_array().shape
    (2, 3)
    """
    grid = _grid(result, between)
    image, masks, looks = _draw_cells(axes, result, variable, grid)
    seen = [name for name, mask in masks.items() if mask.any()]
    for name in seen:
        if looks[name].get("hatch"):
            # As a patch, each corner would be a candidate for the limits of the axes.
            outline = _outline(masks[name], *grid.edges)
            axes.add_artist(PathPatch(outline, linewidth=0.0, **looks[name]))
    _set_map_axes(axes, result, grid, between)
    _legend(axes, [Patch(linewidth=0.3, label=name, **looks[name]) for name in seen])
    _title(axes, _name(result, variable), _rows(axes))
    return image


class _Grid(NamedTuple):
    """Cells of a map: lane numbers (rows, columns), and the edges of the cells along x and y."""

    numbers: Integers
    edges: tuple[Floats, Floats]

    def cells(self, values: Array) -> Array:
        """Arrange values of all lanes as cells, shape (rows, columns)."""
        return values.ravel()[self.numbers]


def _grid(result: Result, between: Between) -> _Grid:
    """Arrange the lanes in a range of the first parameter as cells."""
    _, y_axis = map_axes(result)
    lanes, y = select_lanes(result, between), np.asarray(result[y_axis], dtype=np.float64)
    x = lanes.parameter[:: y.size]
    return _Grid(lanes.numbers.reshape(x.size, y.size).T, (cell_edges(x), cell_edges(y)))


def _draw_cells(
    axes: Axes, result: Result, variable: str, grid: _Grid
) -> tuple[ScalarMappable, dict[str, Mask], dict[str, dict[str, Any]]]:
    """Draw the image of the cells; return it, and mask and look of each legend entry by name."""
    of_lanes = [one.name for one in result.variables.values() if one.dims == result.axes]
    if variable not in LABELS:
        check_variable(variable, of_lanes, "of each lane")
    image: ScalarMappable
    if variable in LABELS or result.variables[variable].flags:
        kinds, looks = _kinds(result, variable)
        numbers = grid.cells(kinds)
        colours = ListedColormap([look["facecolor"] for look in looks.values()])
        ends: Any = {"vmin": -0.5, "vmax": len(looks) - 0.5}
        image = axes.pcolorfast(*grid.edges, numbers, cmap=colours, **ends)
        masks = {name: numbers == number for number, name in enumerate(looks)}
    else:
        numbers = grid.cells(result[variable].astype(np.float64))
        numbers[(numbers == result.variables[variable].fill_value) | np.isinf(numbers)] = np.nan
        image = _number_cells(axes, grid.edges, numbers, variable == LARGEST_EXPONENT)
        none, ended = np.isnan(numbers), grid.cells(result[STATUS]) != 0
        masks = {DIVERGED: none & ended, NO_VALUE: none & ~ended}
        looks = {name: look_of(name) for name in masks}
    if type(image) is AxesImage:
        # A PDF then holds the cells themselves, not the pixels they cover on paper.
        image.set_interpolation("none")
    return image, masks, looks


def _set_map_axes(axes: Axes, result: Result, grid: _Grid, between: Between) -> None:
    """Set limits and labels of the axes of a map."""
    x_axis, y_axis = map_axes(result)
    (x, y), (low, high) = grid.edges, between
    axes.set_xlim(x[0] if low is None else low, x[-1] if high is None else high)
    axes.set_ylim(y[0], y[-1])
    axes.set(xlabel=axis_label(result, x_axis), ylabel=axis_label(result, y_axis))


def map_page(
    result: Result,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    marked: Mapping[str, float] | None = None,
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw the maps of motion and period (a), largest exponent (b) and contact state (c).

    Parameters
    ----------
    result, between
        As for `parameter_map`.
    variable : str, optional
        Draw one panel of this variable. By default motion, exponent and contact states, as far as
        the result has them.
    marked : mapping of str to float, optional
        Values of the two parameters, each marked by a line across the maps.
    width_mm, height_mm : float
        Size of the page. Panels are side by side where each is at least 60 mm wide.

    Returns
    -------
    Page
        A figure unknown to pyplot.

    Raises
    ------
    FigureError, FileError
        As for `parameter_map`; FigureError also if there is nothing to draw.

    Examples
    --------
    >>> page = figures.map_page(gearchaos.open_result("chart.h5"))
    """
    names = _shown_by_default(result) if variable is None else [variable]
    if not names:
        looked = ", ".join((LABELS[0], LARGEST_EXPONENT, f"{CONTACT_STATE}ELEMENT"))
        raise FigureError(f"nothing to draw: the result has none of {looked}; name one")
    map_axes(result)  # Raises FigureError before a page is made.
    beside = width_mm >= NARROWEST_MM * len(names)
    shape = (1, len(names)) if beside else (len(names), 1)
    height = height_mm or 25.0 + 0.68 * width_mm * shape[0] / shape[1]
    with page(width_mm, height) as figure:
        panels = figure.subplots(*shape, sharex=True, sharey=True, squeeze=False).ravel().tolist()
        for axes, name in zip(panels, names, strict=True):
            parameter_map(axes, result, name, between=between)
            few_ticks(axes)
            axes.label_outer()
            _mark_lines(axes, result, marked or {})
        if marked:
            lines = panels[0].get_legend_handles_labels()[0]
            _legend(panels[0], [*legend_entries(panels[0]), *lines])
        _set_titles(panels, [_name(result, name, 34 if beside else 80) for name in names], beside)
        footnote(figure, legend_title(result) or "")
        if result.fixed:
            figure.suptitle(in_words(result, result.fixed))
    return figure


def _mark_lines(axes: Axes, result: Result, marked: Mapping[str, float]) -> None:
    """Draw a line across a map at each marked value."""
    x_axis, _ = map_axes(result)
    for axis, value in marked.items():
        line = axes.axvline if axis == x_axis else axes.axhline
        line(value, color="white", linewidth=1.4)
        label = in_words(result, {axis: value})
        line(value, color=BLACK, linewidth=0.7, linestyle=(0, (5, 2)), label=label)


def _set_titles(panels: Sequence[Axes], titles: Sequence[str], beside: bool) -> None:
    """Title the panels, with letters if there are several; ``beside``: they are side by side."""
    pairs = list(zip(panels, titles, strict=True))
    most = max(_rows(axes) + title.count("\n") for axes, title in pairs)
    for letter, (axes, title) in zip("abcd", pairs, strict=False):
        head = rf"$\mathbf{{({letter})}}$ " if len(panels) > 1 else ""
        # Side by side, the first lines are at the same height.
        _title(axes, head + title, most - title.count("\n") if beside else _rows(axes))


def _kinds(result: Result, variable: str) -> tuple[Array, dict[str, dict[str, Any]]]:
    """Return the number of each lane's kind, and the look of the kinds 0, 1, ... by name."""
    if variable in LABELS:
        kinds, names = motion_kinds(result)
        return kinds, {name: look_of(name) for name in names}
    flags = result.variables[variable].flags
    coloured = [flag for flag in flags if flag != DIVERGED]
    shades = mpl.colormaps[NUMBERS](np.linspace(0.0, 1.0, len(coloured)))
    looks = {DIVERGED: look_of(DIVERGED)}
    looks |= {
        flag: {"facecolor": shade, "edgecolor": "0.55"}
        for flag, shade in zip(coloured, shades, strict=True)
    }
    return result[variable], {flag.replace("_", " "): looks[flag] for flag in flags}


def _number_cells(
    axes: Axes, edges: tuple[Floats, Floats], numbers: Floats, signed: bool
) -> ScalarMappable:
    """Draw numbers (rows, columns) and their colour bar, within robust limits."""
    there = numbers[np.isfinite(numbers)]
    there = there if there.size else np.zeros(1)
    ends = lowest, highest = there.min(), there.max()
    low, high = np.clip(robust_limits(there, there), *ends)
    colours: Colormap = mpl.colormaps[NUMBERS]
    if signed:
        # Both sides of zero have a minimum length: zero must not lie at the end of the bar.
        low, high = min(low, -high / 50.0, -1e-9), max(high, -low / 50.0, 1e-9)
        values = [share * high if share > 0.0 else -share * low for share in SIGNS]
        shades = zip((np.array(values) - low) / (high - low), SIGNS.values(), strict=True)
        colours = LinearSegmentedColormap.from_list("signs", list(shades), N=1024)
    colours = colours.with_extremes(bad=look_of(NO_VALUE)["facecolor"])
    look: Any = {"cmap": colours, "norm": Normalize(low, high)}
    image = axes.pcolorfast(*edges, np.ma.masked_invalid(numbers), **look)
    cut = [["neither", "max"], ["min", "both"]][int(lowest < low)][int(highest > high)]
    bar: Any = {"extend": cut, "location": "top", "ticks": MaxNLocator(6)}
    assert axes.figure is not None
    axes.figure.colorbar(image, cax=axes.inset_axes((0.0, 1.025, 1.0, 0.04)), **bar)
    return image


def _legend(axes: Axes, handles: list[Any]) -> None:
    """Place a legend above the left end of the axes, above the colour bar if there is one."""
    if handles:
        above = 2.0 + BAR_ROWS * ROW_PT * len(axes.child_axes)
        figure: Any = axes.figure
        raised = offset_copy(axes.transAxes, figure, y=above, units="points")
        place: Any = {"bbox_to_anchor": (0.0, 1.0), "bbox_transform": raised, "borderaxespad": 0.0}
        axes.legend(handles=handles, loc="lower left", ncols=KEY_COLUMNS, **place, **LEGEND)


def _rows(axes: Axes) -> int:
    """Return the number of rows between the axes and their title."""
    legend = axes.get_legend()
    entries = len(legend.legend_handles) if legend else 0
    return BAR_ROWS * len(axes.child_axes) + -(-entries // KEY_COLUMNS)


def _name(result: Result, variable: str, line_length: int = 80) -> str:
    if variable in LABELS:
        return "Motion and period"
    return axis_label(result, variable, line_length)


def _title(axes: Axes, text: str, rows: int) -> None:
    look: Any = {"fontsize": SMALL_FONT_PT, "fontweight": "normal", "linespacing": 1.5}
    axes.set_title(text, loc="left", pad=4.0 + ROW_PT * rows, **look)


def _outline(mask: Mask, x: Floats, y: Floats) -> Path:
    """Outline the cells of a mask (rows, columns); adjacent cells of a row share a rectangle."""
    ends = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (row, first), after = np.nonzero(ends == 1), np.nonzero(ends == -1)[1]
    left, right, bottom, top = x[first], x[after], y[row], y[row + 1]
    across, up = (left, right, right, left, left), (bottom, bottom, top, top, bottom)
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], row.size)
    return Path(np.array([across, up]).T.reshape(-1, 2), codes)


def _shown_by_default(result: Result) -> list[str]:
    """Return the variables of the maps of a page where none is chosen."""
    states = (name for name in result if name.startswith(CONTACT_STATE))
    return [n for n in (LABELS[0], LARGEST_EXPONENT, *states) if n in result][:MOST_SHOWN]
