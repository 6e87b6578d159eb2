"""The folder of a gallery: figures, results and report, written once they are computed."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from gearchaos.errors import FileError
from gearchaos.figures.page import FORMATS, Page, save_figure
from gearchaos.paper import figures
from gearchaos.paper.computation import Reproduction
from gearchaos.paper.published import published
from gearchaos.paper.report import report
from gearchaos.progress import say
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


def pictures() -> list[tuple[str, str, Callable[[Reproduction], Page]]]:
    """List all figures: the name of the files without ending, the title, and how it is drawn.

    In the paper's order; `report_text.md` holds their captions.
    """
    draw = figures.motion_page
    numbered: dict[int, Callable[[Reproduction], Page]] = {
        3: figures.pitch_error_page,
        4: figures.mesh_stiffness_page,
        5: figures.accelerations_page,
        6: figures.spectra_page,
        7: figures.diagram_page,
        **{motion.figure: partial(draw, shown=motion) for motion in published().motions},
        14: partial(figures.accelerations_page, growing=True),
        15: partial(figures.spectra_page, growing=True),
    }
    shown = [(f"figure_{n:02d}", f"Figure {n}", page) for n, page in numbered.items()]
    return sorted([*shown, ("figure_07_hop", "The hop of figure 7", figures.hop_page)])


def check_folder(folder: Path, overwrite: bool) -> None:
    """Make the folder, and make sure that nothing in it is replaced unasked.

    Raises FileError if it holds a gallery that may not be replaced, is a file, or cannot be written
    to.
    """
    if folder.exists() and not folder.is_dir():
        raise FileError(f"{folder}: is a file; give the name of a folder as --output")
    images = [f"{name}.{kind}" for name, *_ in pictures() for kind in FORMATS]
    targets = [folder / name for name in (REPORT, *images, *RESULTS)]
    present = [target.name for target in targets if target.exists()]
    if present and not overwrite:
        raise FileError(
            f"{folder}: holds {present[0]} already; replace the gallery with --overwrite or choose "
            "another --output"
        )
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for target in targets:
        check_output(target, overwrite)


def write_gallery(
    found: Reproduction, folder: Path, *, overwrite: bool = False, formats: Sequence[str] = FORMATS
) -> Path:
    """Write everything, say what comes next, and return the path of the report, which comes last.

    ``formats``: of the figures, ``"png"`` among them: that is what the report shows. Raises
    FileError if a file cannot be written.
    """
    for name, (attribute, _) in RESULTS.items():
        say(f"writing {name}")
        getattr(found, attribute).save(folder / name, overwrite=overwrite)
    for name, title, draw in pictures():
        say(f"drawing {title.lower()}")
        page = draw(found)
        for kind in formats:
            target = folder / f"{name}.{kind}"
            save_figure(page, target, title=title, dpi=DPI, overwrite=overwrite)
    text = report(found, {name: words for name, (_, words) in RESULTS.items()})
    with replacing(folder / REPORT, overwrite=overwrite) as partly_written:
        partly_written.write_text(text, encoding="utf-8")
    return folder / REPORT
