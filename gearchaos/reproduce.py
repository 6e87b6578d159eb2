"""Compute and draw everything that a paper shows, and compare every number it prints with ours.

The folder gets the figures (PNG and PDF), the results (HDF5) and a report with the comparison,
report.md. The path of report.md goes to stdout, everything else to stderr.
"""

import time
from argparse import Namespace
from pathlib import Path

from gearchaos.command_line import SWEEPS, Command
from gearchaos.progress import say


def _reproduce(options: Namespace) -> None:
    from gearchaos.engine.running import choose_threads
    from gearchaos.models import load_config
    from gearchaos.paper.computation import compute
    from gearchaos.paper.gallery import check_folder, write_gallery

    began = time.monotonic()
    folder = Path(options.output or options.paper)
    check_folder(folder, options.overwrite)
    names = (f"{options.paper}.toml", f"{options.paper}_full.toml")
    configs = [load_config(SWEEPS / name) for name in names]
    choose_threads(options.threads)
    found = compute(*configs, threads=options.threads)
    print(write_gallery(found, folder, overwrite=options.overwrite), flush=True)
    say(f"done in {time.monotonic() - began:.0f} s")


main = Command("reproduce", __doc__, _reproduce).start(__name__)
