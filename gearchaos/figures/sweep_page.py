"""The page of a sweep: the bifurcation diagram over the Lyapunov chart, on one shared axis."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from gearchaos.errors import FigureError
from gearchaos.figures.diagrams import bifurcation, lyapunov, waterfall
from gearchaos.figures.labels import form_in_words, in_words, plain
from gearchaos.figures.lanes import Between
from gearchaos.figures.page import Page, few_ticks, footnote, letter, page
from gearchaos.figures.panel import legend_above, mark_values
from gearchaos.figures.stages import NARROWEST_SHARE, shade_stages
from gearchaos.figures.style import OVERLAID, SINGLE_COLUMN_MM
from gearchaos.outputs.names import LABELS, LARGEST_EXPONENT, ORDER, WAYS
from gearchaos.results.reading.jumps import apart, directions_of
from gearchaos.results.reading.result import Result, section_variables
from gearchaos.results.reading.stage_table import LabelledLanes

HEIGHT_RATIOS = (1.6, 1.0)
SHADE = "0.92"  # Where directions differ.
MOST_INTERVALS = (7, 8)  # Between the ticks of the lower panel, and of the one above it.


def bifurcation_page(
    result: Result | Sequence[Result],
    variable: str | None = None,
    *,
    between: Between = (None, None),
    stages: bool | LabelledLanes = False,
    marked: tuple[str, Sequence[float]] | None = None,
    labels: Sequence[str] | None = None,
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw the bifurcation diagram (a) over the Lyapunov chart (b).

    A result without section points or without exponents gives the one panel it has data for. The
    page is a Figure not known to pyplot, which a notebook shows; `savefig` or
    `gearchaos.figures.save_figure` writes it.

    ``result``: over one swept parameter, or several of them, drawn over each other; ``variable``,
    ``between``: as for `bifurcation`; amplitudes at mesh orders are drawn as by `waterfall`;
    ``stages``: shade the stages behind both panels, also those of lanes with other labels than
    those of the result; ``marked``: a few words, and the values of the parameter of which they
    tell: ticks at the upper edge; ``labels``: what the legend calls each of several results, by
    default their titles; ``width_mm``, ``height_mm``: size of the page; 85 mm is one column of a
    journal and 180 mm two. The default height follows from the width and the number of panels.

    Raises FigureError if the result has nothing to draw, no such variable or no lane in the range,
    or runs over two parameters; if several results run over different parameters or stages are
    wanted. Raises FileError if stages are wanted and the result has no labels of the motion.
    """
    # A variable that was asked for and is not there is an error, not a page without it.
    files = [result] if isinstance(result, Result) else list(result)
    titles = labels or [str(one.metadata.get("title", "")) for one in files]
    results, labels = [], []
    for one, title in zip(files, titles, strict=True):
        ways = directions_of(one)
        results += ways
        of_ways = [title] if len(ways) == 1 else [f"{title}, {way}" for way in WAYS]
        labels += of_ways if len(files) > 1 else WAYS[: len(ways)]
    if len({one.axis for one in results}) > 1:
        raise FigureError(
            f"results over {', '.join(one.axis for one in results)}: only those over the same "
            "parameter are drawn over each other"
        )
    of_orders = any(variable in one and one.dims(str(variable))[-1] == ORDER for one in results)
    if len(results) > 1 and (stages or of_orders):
        remedy = "; choose one with --at direction=upwards" if len(results) > len(files) else ""
        what = "stages are" if stages else f"{variable}: is"
        raise FigureError(f"{what} drawn of one result, in one direction{remedy}")
    has_section = variable is not None or any(map(section_variables, results))
    panels = has_section + any(LARGEST_EXPONENT in one for one in results)
    if not panels:
        raise FigureError(
            "nothing to draw: the result has neither section points nor Lyapunov exponents"
        )
    height = height_mm or (55.0 + 0.35 * width_mm) * (1.0 if panels == 2 else 0.7)
    with page(width_mm, height) as figure:
        ratios = HEIGHT_RATIOS if panels == 2 else (1.0,)
        grid = figure.subplots(panels, 1, sharex=True, squeeze=False, height_ratios=ratios)
        stack: list[Axes] = grid[:, 0].tolist()
        looks = zip(results, labels, cycle(OVERLAID), strict=False)
        for number, (one, name, (color, marker)) in enumerate(looks):
            shown: dict[str, Any] = {"between": between}
            if len(results) > 1:
                shown |= {"color": color, "marker": marker, "label": plain(name) or "untitled"}
            if of_orders:
                waterfall(stack[0], one, str(variable), between=between)
            elif variable is not None or section_variables(one):
                # Dots lie on larger marks, and thin lines on wide ones: where results agree, both
                # are seen.
                drawn = bifurcation(stack[0], one, variable, **shown)
                drawn.points.set_zorder(2.0 - 0.01 * number)
            if LARGEST_EXPONENT in one:
                # A legend of the colours is enough.
                curve = lyapunov(stack[-1], one, **shown | ({"label": None} if panels == 2 else {}))
                curve.points.set(zorder=2.0 - 0.01 * number, linewidth=0.6 * (number + 1))
        if panels == 2:
            stack[0].set_xlabel("")
            letter(stack)
        for axes, intervals in zip(reversed(stack), MOST_INTERVALS, strict=False):
            few_ticks(axes, None, None if axes.images else intervals)
            axes.yaxis.label.set_linespacing(1.0)
        if marked is not None:
            mark_values(stack, *marked)
        if len(files) < len(results) == 2 and LABELS[0] in files[0]:
            _mark_stretches(stack, files[0])
        if stages:
            given = None if isinstance(stages, bool) else stages
            for axes in stack:
                shade_stages(axes, results[0], lanes=given, legend=axes is stack[0])
        else:
            footnote(figure, max(map(form_in_words, results)))
        places = dict.fromkeys(in_words(one, one.fixed) for one in files if one.fixed)
        if places:
            figure.suptitle("; ".join(places))
        figure.align_ylabels(stack)
    return figure


def _mark_stretches(panels: Sequence[Axes], result: Result) -> None:
    """Shade where both directions of a result differ, and tick where either jumps."""
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
        before = panels[0].get_legend()
        named = [*(before.legend_handles if before else ()), shades[0]]
        legend_above(panels[0], sorted(named, key=lambda one: one.get_label() == "jumps"))
