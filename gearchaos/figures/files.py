"""Figures as files: written completely or not at all, the same bits for the same input."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from gearchaos.errors import FigureError
from gearchaos.figures.style import STYLE
from gearchaos.interrupts import check
from gearchaos.results.atomic_file import replacing
from gearchaos.version import software_version

FORMATS: tuple[str, ...] = ("png", "pdf")
PDF_FINENESS = 2
SIGNATURE = "gearchaos"


def save_figure(
    figure: Figure, path: str | Path, *, title: str = "", dpi: int = 300, overwrite: bool = True
) -> None:
    """Write a figure as PNG or PDF, complete or not at all.

    The file carries the title and the version of the software, but no date: the same figure
    gives the same bits.

    Parameters
    ----------
    figure : Figure
    path : path
        Its ending says the format, `.png` or `.pdf`.
    title : str
        For the file's metadata.
    dpi : int
        Pixels per inch of a PNG. The rasterised points in a PDF get twice as many, since they
        will be looked at more closely.
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
    if kind not in FORMATS:
        raise FigureError(f"{path}: a figure ends in {' or '.join('.' + f for f in FORMATS)}")
    # The name of a file, which may not be Unicode, can serve as a title.
    title = title.encode("utf-8", "replace").decode("utf-8")
    software = f"{SIGNATURE} {software_version()}"
    metadata: dict[str, str | None] = {"Title": title, "Software": software}
    if kind == "pdf":
        metadata = {"Title": title, "Creator": software, "CreationDate": None}
        dpi *= PDF_FINENESS
    check()
    with replacing(path, overwrite=overwrite) as partial, mpl.rc_context(STYLE):
        figure.savefig(partial, format=kind, dpi=dpi, metadata=metadata)


def is_own_figure(path: Path) -> bool:
    """Whether a file says in its metadata that `save_figure` wrote it."""
    try:
        content = path.read_bytes()
    except OSError:
        return False
    marks = (f"Software\0{SIGNATURE} ", f"/Creator ({SIGNATURE} ")
    return any(mark.encode() in content for mark in marks)
