"""The page of a sweep: bifurcation diagram above Lyapunov chart, on one shared axis."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from gearchaos.errors import FigureError
from gearchaos.figures.diagrams import bifurcation, lyapunov, waterfall
from gearchaos.figures.labels import form_in_words, in_words, plain
from gearchaos.figures.lanes import Between
from gearchaos.figures.page import Page, few_ticks, footnote, letter, page
from gearchaos.figures.panel import legend_above, legend_entries, mark_values
from gearchaos.figures.stages import NARROWEST_SHARE, shade_stages
from gearchaos.figures.style import OVERLAID, SINGLE_COLUMN_MM
from gearchaos.outputs.names import LABELS, LARGEST_EXPONENT, ORDER, SECTION_POINT, WAYS
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.jumps import apart, directions_of
from gearchaos.results.reading.result import Result, section_variables
from gearchaos.results.reading.stage_table import LabelledLanes

HEIGHT_RATIOS = (1.6, 1.0)
SHADE = "0.92"  # Grey of the stretches where the two directions differ.
MOST_INTERVALS = (7, 8)  # Most tick intervals of the lower and of the upper panel.


def bifurcation_page(
    result: Result | Sequence[Result],
    variable: str | None = None,
    *,
    between: Between = (None, None),
    stages: bool | LabelledLanes = False,
    marked: tuple[str, Sequence[float]] | None = None,
    labels: Sequence[str] | None = None,
    lines: bool = False,
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw the bifurcation diagram (a) above the chart of the largest Lyapunov exponent (b).

    Parameters
    ----------
    result : Result or sequence of Result
        Results over one swept parameter, the same for all; they are drawn over each other.
    variable, between, lines
        As for `bifurcation`. Amplitudes at mesh orders are drawn as by `waterfall`.
    stages : bool or LabelledLanes
        Shade the stages of the result behind both panels, or those of lanes with other labels.
    marked : (str, sequence of float), optional
        Legend entry, and the values of the swept parameter with a tick at the upper edge.
    labels : sequence of str, optional
        Legend entry of each result; by default its title.
    width_mm, height_mm : float
        Size of the page. The default height follows from the width and the number of panels.

    Returns
    -------
    Page
        A figure unknown to pyplot. It has one panel if section points or exponents are missing.

    Raises
    ------
    FigureError
        If the variable, the range or any data is missing, there are several swept parameters, or
        stages or amplitudes are requested for several results.
    FileError
        If stages are requested and the result has no labels of the motion.

    Notes
    -----
    It has nine arguments, because each is an independent choice of whoever draws.

    Examples
    --------
    >>> page = figures.bifurcation_page(gearchaos.open_result("pan2021.h5"), stages=True)
    >>> len(page.axes)
    2
    """
    overlay = _overlay(result, variable, between, labels)
    overlay = replace(overlay, lines=lines)
    overlay.check(bool(stages))
    height = height_mm or (55.0 + 0.35 * width_mm) * (1.0 if overlay.panels == 2 else 0.7)
    with page(width_mm, height) as figure:
        _draw(figure, overlay, stages, marked)
    return figure


@dataclass(frozen=True, eq=False)
class _Overlay:
    """The results on one page, and what is drawn of them.

    ``files``: the results as given; ``results``: the same with one result for each direction;
    ``labels``: legend entries of ``results``.
    """

    files: Sequence[Result]
    results: Sequence[Result]
    labels: Sequence[str]
    variable: str | None
    between: Between
    lines: bool = False

    @property
    def of_orders(self) -> bool:
        """Whether the variable has a value for each mesh order."""
        name = str(self.variable)
        return any(name in one and one.dims(name)[-1] == ORDER for one in self.results)

    @property
    def of_section(self) -> bool:
        """Whether section points are drawn."""
        sections = {name for one in self.results for name in section_variables(one)}
        return bool(sections) if self.variable is None else self.variable in sections

    @property
    def panels(self) -> int:
        """Number of panels."""
        # A requested variable that is missing is an error, not a page without its panel.
        has_section = self.variable is not None or any(map(section_variables, self.results))
        return has_section + any(LARGEST_EXPONENT in one for one in self.results)

    def check(self, stages: bool) -> None:
        """Raise FigureError if the results cannot share a page or have nothing to draw."""
        if len({one.axis for one in self.results}) > 1:
            raise FigureError(
                f"results over {', '.join(one.axis for one in self.results)}: only those over the "
                "same parameter are drawn over each other"
            )
        if len(self.results) > 1 and (stages or self.of_orders):
            both = len(self.results) > len(self.files)
            remedy = "; choose one with --at direction=upwards" if both else ""
            what = "stages are" if stages else f"{self.variable}: is"
            raise FigureError(f"{what} drawn of one result, in one direction{remedy}")
        if not self.panels:
            raise FigureError(
                "nothing to draw: the result has neither section points nor Lyapunov exponents"
            )


def _overlay(
    result: Result | Sequence[Result],
    variable: str | None,
    between: Between,
    labels: Sequence[str] | None,
) -> _Overlay:
    """Split results by direction and label each part."""
    files = [result] if isinstance(result, Result) else list(result)
    titles = labels or [str(one.metadata.get("title", "")) for one in files]
    results: list[Result] = []
    names: list[str] = []
    for one, title in zip(files, titles, strict=True):
        ways = directions_of(one)
        results += ways
        of_ways = [title] if len(ways) == 1 else [f"{title}, {way}" for way in WAYS]
        names += of_ways if len(files) > 1 else WAYS[: len(ways)]
    return _Overlay(files, results, names, variable, between)


def _draw(
    figure: Page,
    overlay: _Overlay,
    stages: bool | LabelledLanes,
    marked: tuple[str, Sequence[float]] | None,
) -> None:
    """Draw the panels, the marks and shades behind them, and the texts around them."""
    stack = _draw_panels(figure, overlay)
    files, results = overlay.files, overlay.results
    if marked is not None:
        mark_values(stack, *marked)
    if len(files) < len(results) == 2 and LABELS[0] in files[0]:
        _mark_stretches(stack, files[0])
    if stages:
        given = None if isinstance(stages, bool) else stages
        for axes in stack:
            shade_stages(axes, results[0], lanes=given, legend=axes is stack[0])
    else:
        words = [max(map(form_in_words, results))]
        if overlay.of_section:
            words.append(max(map(_points_in_words, results)))
        footnote(figure, "\n".join(filter(None, words)))
    places = dict.fromkeys(in_words(one, one.fixed) for one in files if one.fixed)
    if places:
        figure.suptitle("; ".join(places))
    figure.align_ylabels(stack)


def _points_in_words(result: Result) -> str:
    """Return how many section points a motion of period 1 has, if it has several."""
    shown = result[SECTION_POINT].size if SECTION_POINT in result else 1
    return excitation_of(result.metadata).points_in_words(shown)


def _draw_panels(figure: Page, overlay: _Overlay) -> list[Axes]:
    """Make the panels, draw every result into them, and return them from top to bottom."""
    two = overlay.panels == 2
    ratios = HEIGHT_RATIOS if two else (1.0,)
    grid = figure.subplots(overlay.panels, 1, sharex=True, squeeze=False, height_ratios=ratios)
    stack: list[Axes] = grid[:, 0].tolist()
    for number, look in zip(range(len(overlay.results)), cycle(OVERLAID), strict=False):
        _draw_result(stack, overlay, number, look)
    if two:
        stack[0].set_xlabel("")
        letter(stack)
    for axes, intervals in zip(reversed(stack), MOST_INTERVALS, strict=False):
        few_ticks(axes, None, None if axes.images else intervals)
        axes.yaxis.label.set_linespacing(1.0)
    return stack


def _draw_result(
    stack: Sequence[Axes], overlay: _Overlay, number: int, look: tuple[str, str]
) -> None:
    """Draw one result into the panels, with a colour and a marker if it is one of several."""
    one, variable = overlay.results[number], overlay.variable
    shown: dict[str, Any] = {"between": overlay.between}
    if len(overlay.results) > 1:
        label = plain(overlay.labels[number]) or "untitled"
        shown |= {"color": look[0], "marker": look[1], "label": label}
    # Both remain visible where results agree: later results have larger dots, which are drawn
    # below, and dashed lines, which are drawn above.
    zorder, above = 2.0 - 0.01 * number, 2.0 + 0.01 * number
    if overlay.of_orders:
        waterfall(stack[0], one, str(variable), between=overlay.between)
    elif variable is not None or section_variables(one):
        drawn = bifurcation(stack[0], one, variable, lines=overlay.lines, **shown)
        drawn.points.set_zorder(zorder)
        if "line" in drawn.parts:
            drawn.parts["line"].set_zorder(above)
    if LARGEST_EXPONENT in one:
        # One legend of the colours is enough.
        curve = lyapunov(stack[-1], one, **shown | ({"label": None} if len(stack) == 2 else {}))
        curve.points.set_zorder(above)


def _mark_stretches(panels: Sequence[Axes], result: Result) -> None:
    """Shade where the two directions of a result differ, and tick where either jumps."""
    low, high = panels[0].get_xlim()
    stretches = apart(result, NARROWEST_SHARE * (high - low))
    shades: list[Artist] = [
        axes.axvspan(one.lower, one.upper, fc=SHADE, lw=0.0, zorder=0.0, label="directions differ")
        for one in stretches
        for axes in panels
    ]
    first, last = result[result.axis][[0, -1]]
    ends = [end for one in stretches for end in (one.lower, one.upper) if first < end < last]
    if ends:
        mark_values(panels, "jumps", ends)
    if shades:
        named = [*legend_entries(panels[0]), shades[0]]
        legend_above(panels[0], sorted(named, key=lambda one: one.get_label() == "jumps"))
