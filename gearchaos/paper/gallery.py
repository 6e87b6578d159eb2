"""The folder of a gallery: figures, results, and the report from `report_text.md`."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from importlib.resources import files
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.errors import FileError
from gearchaos.figures.labels import short
from gearchaos.figures.page import FORMATS, Page, save_figure
from gearchaos.figures.response import coordinates_of
from gearchaos.outputs.names import CROSSINGS, acceleration_of
from gearchaos.paper import figures
from gearchaos.paper.comparison import (
    AGREEMENT_RULES,
    WINDOW,
    Agreement,
    ComparisonRow,
    compare,
    signed,
)
from gearchaos.paper.computation import Reproduction, lane_of, largest_acceleration
from gearchaos.paper.published import published
from gearchaos.paper.stages import OUT_OF_TURN, TWO_BANDS
from gearchaos.progress import say
from gearchaos.results.files.atomic_file import check_output, replacing, writing
from gearchaos.results.reading.result import Result
from gearchaos.version import software_version

REPORT = "report.md"
DPI = 200
RESULTS = {"sweep.h5": "sweep", "accelerations.h5": "response", "motions.h5": "motions"}
"""Attributes of `Reproduction` by the name of their result file."""

TOLERANCE_MM = 0.011  # Single pitch deviation of the driving gear in grade 7 (ISO 1328-1).

KINDS = ("derived", "fitted", "predicted")
"""Kinds of printed numbers, which decide what an agreement proves; see `published.toml`."""

TABLE_HEAD = (
    "| | where | kind | Pan 2021 | here | difference | verdict |\n|---|---|---|---|---|---|---|\n"
)


def pictures() -> list[tuple[str, str, Callable[[Reproduction], Page]]]:
    """List all figures in the paper's order: file name without ending, title, drawing function.

    Their captions are in `report_text.md`.
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
    """Create the folder, and check that the gallery can be written to it.

    Parameters
    ----------
    folder : Path
        The folder.
    overwrite : bool
        Whether to replace existing files of a gallery.

    Raises
    ------
    FileError
        If it contains files that must not be replaced, is a file, or is not writable.
    """
    if folder.exists() and not folder.is_dir():
        raise FileError(f"{folder}: is a file; give the name of a folder as --output")
    images = [f"{name}.{kind}" for name, *_ in pictures() for kind in FORMATS]
    targets = [folder / name for name in (REPORT, *images, *RESULTS)]
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for target in targets:
        check_output(target, overwrite)


def write_gallery(
    found: Reproduction, folder: Path, *, overwrite: bool = False, formats: Sequence[str] = FORMATS
) -> Path:
    """Write results, figures and, last, the report; report progress.

    Parameters
    ----------
    found : Reproduction
        The results to show.
    folder : Path
        An existing folder.
    overwrite : bool
        Whether to replace existing files.
    formats : sequence of str
        Formats of the figures; the report needs ``"png"``.

    Returns
    -------
    Path
        The report.

    Raises
    ------
    FileError
        If a file cannot be written.
    """
    for name, attribute in RESULTS.items():
        say(f"writing {name}")
        getattr(found, attribute).save(folder / name, overwrite=overwrite)
    for name, title, draw in pictures():
        say(f"drawing {title.lower()}")
        page = draw(found)
        for kind in formats:
            target = folder / f"{name}.{kind}"
            save_figure(page, target, dpi=DPI, overwrite=overwrite)
    with replacing(folder / REPORT, overwrite=overwrite) as partly_written:
        partly_written.write_text(_report(found), encoding="utf-8")
    return folder / REPORT


def _report(found: Reproduction) -> str:
    tables = compare(found)
    rows = [row for table in tables.values() for row in table]
    length_scale = TOLERANCE_MM / found.group("pitch_error_amplitude")
    template = files("gearchaos.paper").joinpath("report_text.md").read_text(encoding="utf-8")
    on_two = found.lanes.exponent[found.lanes.labels == TWO_BANDS]
    return template.format(
        version=software_version(),
        rows=len(rows),
        counts=Counter(row.verdict for row in rows),
        kinds={kind: _counts(row for row in rows if row.kind == kind) for kind in KINDS},
        rules=AGREEMENT_RULES,
        window=WINDOW,
        out_of_turn=OUT_OF_TURN,
        tables={name: _table(table) for name, table in tables.items()},
        printed={key: number.value for key, number in vars(published().numbers).items()},
        found=found,
        length_scale=length_scale,
        backlash=length_scale * found.group("half_backlash"),
        table_3=_table_3(found.response),
        band_exponents=[signed(end, 3) for end in (on_two.min(), on_two.max())],
        shown={motion.figure: motion for motion in published().motions},
        **_of_the_hop(found),
        **_of_the_increments(found),
    )


def _counts(rows: Iterable[ComparisonRow]) -> str:
    counts = Counter(row.verdict for row in rows)
    return " | ".join(map(str, (counts.total(), *(counts[verdict] for verdict in Agreement))))


def _table(rows: Iterable[ComparisonRow]) -> str:
    lines = []
    for row in rows:
        verdict = f"**{row.verdict}**" if row.verdict is Agreement.DOES_NOT else row.verdict
        lines.append(_line(*row[:-1], verdict))
    return TABLE_HEAD + "\n".join(lines)


def _table_3(response: Result) -> str:
    lines = []
    for name in coordinates_of(response):
        before, after = (largest_acceleration(response, p, name) for p in (0.0, 1.0))
        theirs = short(getattr(published().numbers, f"added_{name}").value)
        wording = response.attributes(acceleration_of(name))["long_name"]
        added = short(after - before, sign="+")
        lines.append(_line(wording, short(before), short(after), added, theirs))
    return "\n".join(lines)


def _line(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def _of_the_hop(found: Reproduction) -> dict[str, Any]:
    hop, paper = found.hop, published().numbers
    place = paper.hop.value
    there = hop.sweeps.sel(pitch_error=place, method="nearest")
    before = found.sweep[found.sweep.axis] <= hop.changes["rest"][0]
    return {
        **hop.changes,
        "losses": [re.split("[,:]", end.loss)[0] for end in (hop.first, hop.last)],
        "crossings": there[CROSSINGS],
        "hop_share": (place - hop.first.above) / (hop.last.below - hop.first.above),
        "exponents": [signed(exponent, 5) for exponent in chain(*found.exponents)],
        "printed_exponent": signed(paper.hop_exponent_before.value, 4),
        "exponent_spread": np.ptp(found.sweep["lyapunov_exponent"][before]),
    }


def _of_the_increments(found: Reproduction) -> dict[str, Any]:
    lanes = [lane_of(found.response, p) for p in published().increments.pitch_errors]
    largest = np.max(np.abs(found.response["delta_5_acceleration"][lanes]), axis=1)
    forcing = 2.0 * found.group("mesh_frequency") ** 2 * found.group("pitch_error_amplitude")
    return {"forcing": short(forcing), "magnitudes": ", ".join(map(short, np.diff(largest)))}
