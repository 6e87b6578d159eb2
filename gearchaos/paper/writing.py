"""The folder of a gallery: figures, results and report, written once they are computed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gearchaos.errors import FileError
from gearchaos.figures.files import FORMATS, save_figure
from gearchaos.paper.computation import Notify, Reproduction
from gearchaos.paper.gallery import pictures
from gearchaos.paper.published import published
from gearchaos.paper.report import report
from gearchaos.results.atomic_file import check_output, replacing, writing

REPORT = "report.md"
DPI = 200
RESULTS = {
    "sweep.h5": ("sweep", "figure 7, a sweep over the pitch error"),
    "accelerations.h5": ("response", "figures 5, 6, 14 and 15 and Table 3, a response"),
    "motions.h5": ("motions", "figures 8 to 13, a response, starting at rest"),
    "motions_from_contact.h5": ("motions_from_contact", "the same, starting on the contact flank"),
}
"""Result files by name: the attribute of `Reproduction`, and what they hold."""


def check_folder(folder: Path, overwrite: bool) -> None:
    """Make the folder, and make sure that nothing in it is replaced unasked.

    Raises
    ------
    FileError
        If it holds a gallery that may not be replaced, is a file, or cannot be written to.
    """
    if folder.exists() and not folder.is_dir():
        raise FileError(f"{folder}: is a file; give the name of a folder as --output")
    present = [name for name in _names() if (folder / name).exists()]
    if present and not overwrite:
        raise FileError(
            f"{folder}: holds {present[0]} already; replace the gallery with --overwrite or choose "
            "another --output"
        )
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for name in _names():
        check_output(folder / name, overwrite)


def write_gallery(
    found: Reproduction,
    folder: Path,
    *,
    overwrite: bool = False,
    formats: Sequence[str] = FORMATS,
    notify: Notify = lambda _: None,
) -> Path:
    """Write everything and return the path of the report, which comes last.

    Parameters
    ----------
    found : Reproduction
    folder : Path
    overwrite : bool
        Whether existing files are replaced.
    formats : sequence of str
        Of the figures, ``"png"`` among them: that is what the report shows.
    notify : callable
        Told what comes next.

    Raises
    ------
    FileError
        If a file cannot be written.
    """
    printed = published()
    for name, (attribute, _) in RESULTS.items():
        notify(f"writing {name}")
        getattr(found, attribute).save(folder / name, overwrite=overwrite)
    for picture in pictures():
        notify(f"drawing {picture.title.lower()}")
        page = picture.draw(printed, found)
        for kind in formats:
            target = folder / f"{picture.name}.{kind}"
            save_figure(page, target, title=picture.title, dpi=DPI, overwrite=overwrite)
    text = report(printed, found, {name: words for name, (_, words) in RESULTS.items()})
    with replacing(folder / REPORT, overwrite=overwrite) as partial:
        partial.write_text(text, encoding="utf-8")
    return folder / REPORT


def _names() -> list[str]:
    figures = [f"{picture.name}.{kind}" for picture in pictures() for kind in FORMATS]
    return [REPORT, *figures, *RESULTS]
