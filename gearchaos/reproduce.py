"""Compute and draw all results of a paper, and compare every printed number with the computed one.

The output folder receives the figures (PNG and PDF), the results (HDF5) and the report with the
comparison, report.md. The path of the report goes to stdout, everything else to stderr.
"""

import time
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from gearchaos.command_line import SWEEPS, Command
from gearchaos.options import Option, Overwrite, Threads
from gearchaos.progress import say


class ReproduceOptions(NamedTuple):
    """Options of ``gearchaos reproduce``."""

    paper: Annotated[Literal["pan2021"], Option("paper to reproduce", positional=True)]
    output: Annotated[
        str | None,
        Option(
            "folder of the results (default: the name of the paper)",
            "DIR",
            ("-o", "--output"),
            file=True,
        ),
    ] = None
    overwrite: Overwrite = False
    threads: Threads = None


def _reproduce(options: ReproduceOptions) -> None:
    from gearchaos.engine.running import choose_threads
    from gearchaos.models import load_config
    from gearchaos.paper.computation import compute_gallery
    from gearchaos.paper.gallery import check_folder, write_gallery

    began = time.monotonic()
    folder = Path(options.output or options.paper)
    check_folder(folder, options.overwrite)
    names = (f"{options.paper}.toml", f"{options.paper}_full.toml")
    configs = [load_config(SWEEPS / name) for name in names]
    choose_threads(options.threads)
    found = compute_gallery(*configs, threads=options.threads)
    print(write_gallery(found, folder, overwrite=options.overwrite), flush=True)
    say(f"done in {time.monotonic() - began:.0f} s")


main = Command("reproduce", __doc__, ReproduceOptions, _reproduce).start(__name__)
