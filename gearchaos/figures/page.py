"""A page for a journal: the bifurcation diagram over the Lyapunov chart, on one shared axis."""

from __future__ import annotations

from io import BytesIO

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gearchaos.errors import ConfigurationError
from gearchaos.figures.bifurcation import bifurcation
from gearchaos.figures.lanes import Between, legend_above
from gearchaos.figures.lyapunov import VARIABLE as LYAPUNOV_VARIABLE
from gearchaos.figures.lyapunov import lyapunov
from gearchaos.figures.stages import shade_stages
from gearchaos.figures.style import MM_PER_INCH, SINGLE_COLUMN_MM, STYLE, page_height_mm
from gearchaos.results.result import Result, section_variables

HEIGHT_RATIOS = (1.6, 1.0)
NOTEBOOK_DPI = 200
MOST_INTERVALS = (7, 8)


class Page(Figure):
    """A matplotlib figure that a notebook shows by itself, without pyplot."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        with mpl.rc_context(STYLE):
            self.savefig(picture, format="png", dpi=NOTEBOOK_DPI)
        return picture.getvalue()


def bifurcation_page(
    result: Result,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    full_range: bool = False,
    stages: bool = False,
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw the bifurcation diagram (a) over the Lyapunov chart (b).

    A result without section points or without exponents gives the one panel it has data for.

    Parameters
    ----------
    result : Result
    variable : str, optional
        Section variable of the diagram; default `section_delta_5`, or the first there is.
    between : (float or None, float or None)
        The part of the parameter range to show.
    full_range : bool
        Let the vertical axes reach every lane, however few lie far out.
    stages : bool
        Shade the stages behind both panels.
    width_mm, height_mm : float
        Size of the page; 85 mm is one column of a journal and 180 mm two. The default height
        follows from the width and the number of panels.

    Returns
    -------
    Page
        A Figure not known to pyplot, which a notebook shows; `savefig` or
        `gearchaos.figures.save_figure` writes it.

    Raises
    ------
    ConfigurationError
        If the result has nothing to draw, no such variable or no lane in the range.
    FileError
        If stages are wanted and the result has no labels of the motion.
    """
    # A variable that was asked for and is not there is an error, not a page without it.
    has_section = variable is not None or bool(section_variables(result))
    has_exponent = LYAPUNOV_VARIABLE in result
    if not has_section and not has_exponent:
        raise ConfigurationError(
            "nothing to draw: the result has neither section points nor Lyapunov exponents"
        )
    panels = has_section + has_exponent
    height = height_mm or page_height_mm(width_mm) * (1.0 if panels == 2 else 0.7)
    with mpl.rc_context(STYLE):
        figure = Page(figsize=(width_mm / MM_PER_INCH, height / MM_PER_INCH), layout="constrained")
        FigureCanvasAgg(figure)
        ratios = HEIGHT_RATIOS if panels == 2 else (1.0,)
        stack: list[Axes] = list(
            figure.subplots(panels, 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
        )
        if has_section:
            diagram = bifurcation(
                stack[0],
                result,
                variable,
                between=between,
                full_range=full_range,
                legend=panels == 1,
            )
        if has_exponent:
            lyapunov(stack[-1], result, between=between, full_range=full_range, legend=True)
        if panels == 2:
            legend_above(stack[0], [diagram.diverged, *diagram.off_scale])
            stack[0].set_xlabel("")
            for axes, letter in zip(stack, "ab", strict=True):
                axes.set_title(f"({letter})", loc="left")
        for axes, intervals in zip(reversed(stack), MOST_INTERVALS, strict=False):
            axes.yaxis.set_major_locator(MaxNLocator(intervals, steps=[1, 2, 5, 10]))
            axes.yaxis.label.set_linespacing(1.0)
        if stages:
            for axes in stack:
                shade_stages(axes, result, legend=axes is stack[0])
        figure.align_ylabels(stack)
        # Ticks are made at the first drawing, in the style of that moment.
        figure.draw_without_rendering()
    return figure
