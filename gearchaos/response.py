"""Compute the motion of some pitch errors, or of some values of the swept parameter, at every step
of the last mesh periods: displacements, velocities, accelerations, mesh forces and contact.

The path of the result goes to stdout, everything else to stderr; python -m gearchaos.plot draws
it. Exit codes: 0 done, 2 the command line or the configuration asks for what cannot be, 3 done, but
more lanes diverged than outputs.allowed_diverged_share, 4 a file cannot be read or written.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.finishing import ending, output_of
from gearchaos.progress import say

if TYPE_CHECKING:
    from gearchaos.configuration import Configuration

PITCH_ERROR = "pitch_error"


def _arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("config", metavar="config.toml", help="the pair, its scene, start and integration")
    values = parser.add_mutually_exclusive_group(required=True)
    for flag, name, text in (
        ("--pitch-error", "P", "multiple of the pitch error, may be repeated"),
        ("--at", "VALUE", "value of the parameter that the configuration sweeps, may be repeated"),
    ):
        values.add_argument(flag, type=float, action="append", metavar=name, help=text)
    add("--periods", type=int, default=32, metavar="N", help="mesh periods kept (default: 32)")


def _respond(options: Namespace) -> int:
    config = _configuration(options)
    from gearchaos.engine.response_run import ResponseRun
    from gearchaos.engine.running import choose_threads, prepare
    from gearchaos.results.atomic_file import check_output

    choose_threads(options.threads)
    run = ResponseRun(config, options.periods)
    output = output_of(options, "_response.h5")
    check_output(output, options.overwrite)
    prepare(run)
    result = run.result()
    result.save(output, overwrite=options.overwrite)
    print(output, flush=True)
    diverged = int((result["status"] != 0).sum())
    say(
        f"{run.lanes} lane{'s' if run.lanes != 1 else ''} over {run.axis}, {run.periods} mesh "
        f"periods of {run.plan.steps_per_period} steps, {diverged} diverged"
    )
    return ending(run, diverged)


def _configuration(options: Namespace) -> Configuration:
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


main = Command(
    "response", __doc__, _arguments, _respond, common=("output", "overwrite", "threads", "set")
)

if __name__ == "__main__":
    sys.exit(main())
