"""A page for a journal: its size and style, the texts beside its panels, and its file."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.ticker import AutoMinorLocator, MaxNLocator

from gearchaos.errors import FigureError, FileError
from gearchaos.figures.style import (
    DRAWING,
    LEGEND,
    MM_PER_INCH,
    SINGLE_COLUMN_MM,
    SMALL_FONT_PT,
    styled,
)
from gearchaos.figures.ticks import light
from gearchaos.figures.units import explained_units
from gearchaos.interrupts import check
from gearchaos.results.files.atomic_file import check_output, replacing
from gearchaos.version import software_version

FORMATS: tuple[str, ...] = ("png", "pdf")  # Default formats.

ENDINGS = (*FORMATS, "svg", "eps", "tiff", "tif")
FINENESS = {"pdf": 2, "svg": 2}  # Factor of the resolution, for formats that readers zoom into.
BELOW_AXIS = 2.4  # Drawing order just below that of axes with their ticks and labels.
SIGNATURE = "gearchaos"
OWN = rb"(Software[\0 ]|/Creator \(|%%Creator: |<dc:creator>\s*<cc:Agent>\s*<dc:title>)gearchaos "

NOTEBOOK_DPI = 200


FORMULAE: Any = getattr(RendererAgg(1, 1, 72.0), "mathtext_parser", None)  # type: ignore[no-untyped-call]
"""Parser of formulae, shared by all pages: it caches its results, and pages repeat most formulae.

It is taken from a renderer because its kind depends on the version of matplotlib: Agg draws
formulae as pictures before 3.11 and as paths from 3.11 on.
"""


class Page(Figure):
    """A matplotlib figure that a notebook shows by itself, without pyplot."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        with styled():
            self.savefig(picture, format="png", dpi=NOTEBOOK_DPI)
        return picture.getvalue()

    def savefig(self, *given: Any, **named: Any) -> None:
        """Write the page as `Figure.savefig` does; wait while another page is drawn."""
        with DRAWING:
            super().savefig(*given, **named)

    def draw(self, renderer: Any) -> None:
        """Draw the page; wait while another page is drawn."""
        with DRAWING:
            super().draw(renderer)


@contextmanager
def page(width_mm: float, height_mm: float) -> Iterator[Page]:
    """Make a page of a size in mm; within the context the project's style is set."""
    with styled():
        size = (width_mm / MM_PER_INCH, height_mm / MM_PER_INCH)
        layout = ConstrainedLayoutEngine()
        figure = Page(figsize=size, layout=layout)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.get_renderer().mathtext_parser = FORMULAE
        yield figure
        _explain(figure)
        _lay_out(figure, layout)


def _explain(figure: Page) -> None:
    """Explain the units of a page in the title of its legend, or else in its footnote."""
    words = explained_units(figure)
    if not words:
        return
    if figure.legends:
        legend = figure.legends[-1]
        before = legend.get_title().get_text()
        # A legend without a title has the text "None".
        lines = [before, words] if before not in ("", "None") else [words]
        legend.set_title("\n".join(lines))
    else:
        footnote(figure, "\n".join(filter(None, (figure.get_supxlabel(), words))))


@contextmanager
def continued(figure: Page) -> Iterator[None]:
    """Draw more into a finished page, which is then laid out again."""
    layout = ConstrainedLayoutEngine()
    with styled():
        figure.set_layout_engine(layout)
        yield
        _lay_out(figure, layout)


def _lay_out(figure: Page, layout: ConstrainedLayoutEngine) -> None:
    """Place the parts of a drawn page once and for all."""
    for axes in figure.axes:
        light(axes)
    # Ticks are created when they are first measured, in the style of that moment.
    layout.execute(figure)
    # Repeating the layout takes longer than the drawing itself. With the engine "none",
    # matplotlib would draw each page twice.
    figure.set_layout_engine(None)


column = partial(page, SINGLE_COLUMN_MM)
"""Make a page as wide as one journal column, of a height in mm."""


def letter(panels: Iterable[Axes]) -> None:
    """Write (a), (b), ... above the left end of the panels."""
    for name, axes in zip("abcdefghij", panels, strict=False):
        axes.set_title(f"({name})", loc="left")


def remark(axes: Axes, text: str) -> None:
    """Write a short text above the right end of a panel."""
    axes.set_title(text, loc="right", fontsize=SMALL_FONT_PT, fontweight="normal")


def footnote(figure: Figure, text: str) -> None:
    """Write a line at the foot of a page, unless the text is empty."""
    if text:
        figure.supxlabel(text, fontsize=SMALL_FONT_PT, color="0.4", x=0.99, ha="right")


def legend_below(figure: Figure, handles: Sequence[Any], title: str | None, columns: int) -> Legend:
    """Place a legend below everything in a figure with constrained layout.

    It has as many of the columns as fit into the width of the figure.
    """
    look = {"loc": "outside lower center", **LEGEND}
    for count in range(min(len(handles), columns), 1, -1):
        legend = figure.legend(handles=handles, title=title, ncols=count, **look)
        if legend.get_window_extent().width <= figure.bbox.width:
            return legend
        legend.remove()
    return figure.legend(handles=handles, title=title, ncols=1, **look)


def few_ticks(axes: Axes, x: int | None = 5, y: int | None = 4) -> None:
    """Limit the numbers of tick intervals along x and y; None leaves an axis unchanged."""
    for axis, most in ((axes.xaxis, x), (axes.yaxis, y)):
        if most is not None:
            axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
            axis.set_minor_locator(AutoMinorLocator())


def save_figure(
    figure: Figure, path: str | Path, *, dpi: int = 300, overwrite: bool = True
) -> None:
    """Write a figure to a file, complete or not at all.

    Parameters
    ----------
    figure : Figure
        A page, or any figure of matplotlib.
    path : str or Path
        The file. Its ending, one of `ENDINGS`, selects the format.
    dpi : int
        Pixels per inch. Rasterised points in PDF and SVG get twice as many, for zooming in.
    overwrite : bool
        Whether to replace an existing file.

    Raises
    ------
    FigureError
        If the ending is unknown.
    FileError
        If the file cannot be written, or exists and must not be replaced.

    Notes
    -----
    The metadata contain the version of the software but no date: the same figure gives the same
    bytes. EPS has no transparency; its panels are pictures.

    Examples
    --------
    >>> page = figures.bifurcation_page(gearchaos.open_result("pan2021.h5"))
    >>> figures.save_figure(page, "page.svg")
    """
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in ENDINGS:
        raise FigureError(f"{path}: a figure ends in {' or '.join('.' + f for f in ENDINGS)}")
    check()
    with replacing(path, overwrite=overwrite) as partial:
        partial.write_bytes(picture(figure, kind, dpi))


def picture(
    figure: Figure, kind: str, dpi: int = 300, settings: Mapping[str, Any] | None = None
) -> bytes:
    """Return the content of the file that `save_figure` writes.

    ``kind``: one of `ENDINGS`; ``settings``: of matplotlib, in place of those of the style.
    """
    drawn, before = BytesIO(), [axes.get_rasterization_zorder() for axes in figure.axes]
    with styled(settings):
        for axes in figure.axes if kind == "eps" else ():
            axes.set_rasterization_zorder(BELOW_AXIS)
        figure.savefig(drawn, format=kind, dpi=dpi * FINENESS.get(kind, 1), **_facts(kind))
        for axes, zorder in zip(figure.axes, before, strict=True):
            axes.set_rasterization_zorder(zorder)
    content = drawn.getvalue()
    return re.sub(rb"\n%%CreationDate: .*", b"", content, count=1) if kind == "eps" else content


def _facts(kind: str) -> dict[str, Any]:
    """Return the arguments of `Figure.savefig` that set metadata and compression of a format."""
    software = f"{SIGNATURE} {software_version()}"
    # Files are a sixth larger, and written in two thirds of the time.
    fast = {"pil_kwargs": {"compress_level": 1}}
    facts: dict[str, dict[str, Any]] = {
        "png": {"metadata": {"Software": software}, **fast},
        "pdf": {"metadata": {"Creator": software, "CreationDate": None}},
        "svg": {"metadata": {"Creator": software, "Date": None}},
        "eps": {"metadata": {"Creator": software}},
    }
    tags = {"software": f"Software {software}", "compression": "tiff_lzw"}
    return facts.get(kind, {"pil_kwargs": tags})


def check_figures(paths: Sequence[Path], results: Sequence[str | Path], overwrite: bool) -> None:
    """Check that figures of results can be written, before anything is computed for them.

    Parameters
    ----------
    paths : sequence of Path
        Files of the figures.
    results : sequence of str or Path
        Result files to draw, which are never replaced.
    overwrite : bool
        Whether to replace any other file. Files from `save_figure` are always replaced.

    Raises
    ------
    FileError
        If a file cannot be written or must not be replaced.
    """
    for path in paths:
        if path.exists() and any(path.samefile(result) for result in results):
            raise FileError(f"{path}: is a result file itself; choose another --output")
        check_output(path, overwrite or _is_own(path))


def _is_own(path: Path) -> bool:
    """Whether the metadata of a file show that `save_figure` wrote it."""
    with suppress(OSError):
        return re.search(OWN, path.read_bytes()) is not None
    return False
