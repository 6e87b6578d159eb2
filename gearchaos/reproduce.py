"""The command that computes a paper again: ``python -m gearchaos.reproduce pan2021``."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.errors import ConfigurationError

NAME = "gearchaos reproduce"
PAPERS = {"pan2021": ("pan2021.toml", "pan2021_full.toml")}
"""The configurations of each paper that can be reproduced."""

DESCRIPTION = """\
Compute and draw everything that a paper shows, and compare every number it prints with ours."""

EPILOG = f"""\
Papers: {", ".join(PAPERS)}. The folder gets the figures (PNG and PDF), the results (HDF5) and a
report with the comparison, report.md, whose path goes to stdout; everything else to stderr. Exit
codes: 0 done, 2 usage, 4 cannot read or write."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_command(NAME, partial(_run, argv))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description=DESCRIPTION, epilog=EPILOG, allow_abbrev=False
    )
    add = parser.add_argument
    add("paper", help=f"what to reproduce: {', '.join(PAPERS)}")
    add("-o", "--output", metavar="DIR", help="folder of the gallery (default: that of the name)")
    add("--overwrite", action="store_true", help="replace an existing gallery")
    add("--threads", type=int, metavar="N", help="threads to use (default: all cores)")
    add("-q", "--quiet", action="store_true", help="say nothing on stderr unless something fails")
    add("--version", action="version", version=version_text())
    return parser


def _run(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    if options.paper not in PAPERS:
        raise ConfigurationError(
            f"{options.paper!r} is no paper that can be reproduced; there is {', '.join(PAPERS)}"
        )
    # Matplotlib would refuse to be imported where the environment names an unknown backend.
    os.environ["MPLBACKEND"] = "agg"
    from gearchaos.configuration import load_config
    from gearchaos.engine.running import choose_threads
    from gearchaos.paper.computation import compute
    from gearchaos.paper.gallery import check_folder, write_gallery
    from gearchaos.paper.sweep_files import sweep_file

    began = time.monotonic()

    def say(text: str) -> None:
        if not options.quiet:
            print(f"{NAME}: {text}", file=sys.stderr, flush=True)

    folder = Path(options.output or options.paper)
    check_folder(folder, options.overwrite)
    configs = [load_config(sweep_file(name)) for name in PAPERS[options.paper]]
    choose_threads(options.threads)
    found = compute(*configs, threads=options.threads, notify=say)
    print(write_gallery(found, folder, overwrite=options.overwrite, notify=say), flush=True)
    say(f"done in {time.monotonic() - began:.0f} s")
    return OK


if __name__ == "__main__":
    sys.exit(main())
