"""The command that computes a time response: ``python -m gearchaos.response config.toml``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.command_line import run_command, version_text
from gearchaos.errors import ConfigurationError, FileError

if TYPE_CHECKING:
    from gearchaos.configuration import Configuration

NAME = "gearchaos response"
PITCH_ERROR = "pitch_error"

DESCRIPTION = """\
Compute the motion of some pitch errors, or of some values of the swept parameter, at every step of
the last mesh periods: displacements, velocities, accelerations, mesh forces and contact."""

EPILOG = """\
The path of the result goes to stdout, everything else to stderr; python -m gearchaos.plot draws
it. Exit codes: 0 done, 2 the command line or the configuration asks for what cannot be, 3 done, but
more lanes diverged than outputs.allowed_diverged_share, 4 a file cannot be read or written."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_command(NAME, partial(_run, argv))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description=DESCRIPTION, epilog=EPILOG, allow_abbrev=False
    )
    add = parser.add_argument
    add("config", metavar="config.toml", help="the pair, its scene, start and integration")
    values = parser.add_mutually_exclusive_group(required=True)
    values.add_argument(
        "--pitch-error",
        type=float,
        action="append",
        metavar="P",
        help="multiple of the pitch error, may be repeated",
    )
    values.add_argument(
        "--at",
        type=float,
        action="append",
        metavar="VALUE",
        help="value of the parameter that the configuration sweeps, may be repeated",
    )
    add("--periods", type=int, default=32, metavar="N", help="mesh periods kept (default: 32)")
    add(
        "-o",
        "--output",
        metavar="PATH",
        help="result file (default: the name of the configuration, _response.h5, in the current "
        "folder)",
    )
    add("--overwrite", action="store_true", help="replace an existing result")
    add("--threads", type=int, metavar="N", help="threads to use (default: all cores)")
    add(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="replace one key of the configuration, such as start.kind=contact",
    )
    add("-q", "--quiet", action="store_true", help="say nothing on stderr unless something fails")
    add("--version", action="version", version=version_text())
    return parser


def _run(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    config = _configuration(options)
    from gearchaos.engine.response_run import ResponseRun
    from gearchaos.engine.running import COMPILING, choose_threads
    from gearchaos.finishing import ending
    from gearchaos.progress import notice
    from gearchaos.results.atomic_file import check_output

    choose_threads(options.threads)
    run = ResponseRun(config, options.periods)
    output = options.output or f"{Path(options.config).stem}_response.h5"
    if os.path.exists(output) and os.path.samefile(output, options.config):
        raise FileError(f"{output}: is the configuration itself; choose another --output")
    check_output(output, options.overwrite)
    with notice(COMPILING, options.quiet):
        run.compile()
    run.choose_steps()
    result = run.result()
    result.save(output, overwrite=options.overwrite)
    print(output, flush=True)
    lanes, diverged = run.lanes, int((result["status"] != 0).sum())
    if not options.quiet:
        summary = (
            f"{lanes} lane{'s' if lanes != 1 else ''} over {run.axis}, {run.periods} mesh periods "
            f"of {run.plan.steps_per_period} steps, {diverged} diverged"
        )
        for note in [*run.notes, summary]:
            print(f"{NAME}: {note}", file=sys.stderr)
    return ending(NAME, run, diverged)


def _configuration(options: argparse.Namespace) -> Configuration:
    from gearchaos.configuration import load_config
    from gearchaos.configuration.toml_text import toml_literal

    parameter, values = PITCH_ERROR, options.pitch_error
    if values is None:
        values = options.at
        parameter = load_config(options.config, options.set).sweep.parameter
    # Repeating a value is no mistake worth a message.
    sweep = {"parameter": parameter, "values": sorted(set(values))}
    try:
        return load_config(options.config, [*options.set, f"sweep={toml_literal(sweep)}"])
    except ConfigurationError as error:
        swept = load_config(options.config, options.set).sweep.parameter
        if parameter == swept:
            raise
        key = swept if "." in swept else f"groups.{swept}"
        hint = (
            f"--pitch-error takes the place of the sweep over {swept}: give one value of it with "
            f"--set {key}=VALUE, or several with --at"
        )
        raise ConfigurationError([*error.problems, hint]) from error


if __name__ == "__main__":
    sys.exit(main())
