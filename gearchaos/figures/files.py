"""Figures as files: written completely or not at all, the same bits for the same input."""

import re
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from gearchaos.errors import FigureError
from gearchaos.figures.style import style
from gearchaos.interrupts import check
from gearchaos.results.atomic_file import replacing
from gearchaos.version import software_version

FORMATS: tuple[str, ...] = ("png", "pdf")
"""What is written unless asked otherwise."""

ENDINGS = (*FORMATS, "svg", "eps", "tiff", "tif")
FINENESS = {"pdf": 2, "svg": 2}
BELOW_AXIS = 2.4
SIGNATURE = "gearchaos"
OWN = rb"(Software[\0 ]|/Creator \(|%%Creator: |<dc:creator>\s*<cc:Agent>\s*<dc:title>)gearchaos "


def save_figure(
    figure: Figure, path: str | Path, *, title: str = "", dpi: int = 300, overwrite: bool = True
) -> None:
    """Write a figure in one of the formats of `ENDINGS`, complete or not at all.

    The file carries the title and the version of the software, but no date: the same figure
    gives the same bits.

    Parameters
    ----------
    figure : Figure
    path : path
        Its ending says the format, such as `.png` or `.pdf`.
    title : str
        For the file's metadata.
    dpi : int
        Pixels per inch. The rasterised points in a PDF or SVG get twice as many, since they will
        be looked at more closely. EPS knows no transparency: its panels are pictures.
    overwrite : bool
        Whether an existing file is replaced.

    Raises
    ------
    FigureError
        If the ending names no known format.
    FileError
        If the file cannot be written.
    """
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in ENDINGS:
        raise FigureError(f"{path}: a figure ends in {' or '.join('.' + f for f in ENDINGS)}")
    # The name of a file, which may not be Unicode, can serve as a title.
    title = "".join(filter(str.isprintable, title))
    software = f"{SIGNATURE} {software_version()}"
    facts: dict[str, dict[str, Any]] = {
        "png": {"metadata": {"Title": title, "Software": software}},
        "pdf": {"metadata": {"Title": title, "Creator": software, "CreationDate": None}},
        "svg": {"metadata": {"Title": title, "Creator": software, "Date": None}},
        "eps": {"metadata": {"Creator": software}},
    }
    tags = {"description": title, "software": f"Software {software}", "compression": "tiff_lzw"}
    dpi *= FINENESS.get(kind, 1)
    drawn, before = BytesIO(), [axes.get_rasterization_zorder() for axes in figure.axes]
    check()
    with replacing(path, overwrite=overwrite) as partial, mpl.rc_context(style()):
        for axes in figure.axes if kind == "eps" else ():
            axes.set_rasterization_zorder(BELOW_AXIS)
        figure.savefig(drawn, format=kind, dpi=dpi, **facts.get(kind, {"pil_kwargs": tags}))
        for axes, zorder in zip(figure.axes, before, strict=True):
            axes.set_rasterization_zorder(zorder)
        content = drawn.getvalue()
        if kind == "eps":
            content = re.sub(rb"\n%%CreationDate: .*", b"", content, count=1)
        partial.write_bytes(content)


def is_own_figure(path: Path) -> bool:
    """Whether a file says in its metadata that `save_figure` wrote it."""
    with suppress(OSError):
        return re.search(OWN, path.read_bytes()) is not None
    return False
