"""The command that computes a sweep: ``python -m gearchaos.sweep config.toml``."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.errors import ConfigurationError, FileError, GearchaosError

if TYPE_CHECKING:
    from gearchaos.configuration import Configuration
    from gearchaos.engine.sharding import Part
    from gearchaos.engine.simulation import Simulation

NAME = "gearchaos sweep"

DESCRIPTION = "Compute the sweep that a TOML file describes and write it to an HDF5 file."

EPILOG = """\
The path of the result goes to stdout, everything else to stderr. Exit codes: 0 done, 2 the
command line or the configuration asks for what cannot be, 3 done, but more lanes diverged than
outputs.allowed_diverged_share, 4 a file cannot be read or written, 130 interrupted and 143
terminated: finished blocks are kept and --resume goes on from them."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_command(NAME, partial(_run, argv))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description=DESCRIPTION, epilog=EPILOG, allow_abbrev=False
    )
    add = parser.add_argument
    add("config", metavar="config.toml", help="what to compute")
    add(
        "-o",
        "--output",
        metavar="PATH",
        help="result file (default: the name of the configuration, .h5, in the current folder)",
    )
    add("--overwrite", action="store_true", help="replace an existing result")
    add("--resume", action="store_true", help="go on from the finished blocks of a stopped sweep")
    add("--threads", type=int, metavar="N", help="threads to use (default: all cores)")
    add(
        "--dask",
        metavar="ADDRESS",
        help="compute on the dask cluster of this scheduler, or on local:N processes",
    )
    add(
        "--shard",
        metavar="i/N",
        help="compute the i-th of N parts only; python -m gearchaos.merge joins them",
    )
    add(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="replace one key of the configuration, such as integration.steps_per_period=400",
    )
    add("--dry-run", action="store_true", help="say what would be computed, and stop")
    add("-q", "--quiet", action="store_true", help="say nothing on stderr unless something fails")
    add("--version", action="version", version=version_text())
    return parser


def _run(argv: Sequence[str] | None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    options = _parser().parse_args(arguments)
    # Imported only now: --help and --version answer at once, and an interrupt is caught.
    from gearchaos.configuration import load_config

    config = load_config(options.config, options.set)
    from gearchaos.engine.running import choose_threads
    from gearchaos.engine.sharding import Part
    from gearchaos.engine.simulation import Simulation
    from gearchaos.finishing import complete_already, prepare

    part = None if options.shard is None else Part.from_text(options.shard)
    _check_sharing(options, config)
    choose_threads(options.threads)
    simulation = Simulation(config)
    # A text, not a Path, which would drop the slash that tells a folder from a file.
    output = f"{Path(options.config).stem}.h5" if options.output is None else options.output
    if os.path.exists(output) and os.path.samefile(output, options.config):
        raise FileError(f"{output}: is the configuration itself; choose another --output")
    if options.dry_run:
        from gearchaos.dry_run import describe

        prepare(simulation, options.quiet)
        describe(simulation, output)
        return OK
    if options.resume and not options.overwrite and os.path.isfile(output):
        code = complete_already(NAME, simulation, output, options.quiet)
        if code is not None:
            return code
    return _compute(simulation, output, part, options, arguments)


def _check_sharing(options: argparse.Namespace, config: Configuration) -> None:
    """Refuse what --dask and --shard cannot do."""
    for flag in ("dask", "shard"):
        if getattr(options, flag) is not None and config.start.carry != "none":
            raise ConfigurationError(
                f'--{flag}: with start.carry = "{config.start.carry}" one value is computed after '
                f'the other; set start.carry = "none" or leave out --{flag}'
            )
    if options.dask is None:
        return
    if options.threads is not None and not options.dask.startswith("local:"):
        raise ConfigurationError(
            f"--threads {options.threads}: the workers of a cluster use the cores that they have; "
            "start them with the variable NUMBA_NUM_THREADS to use fewer"
        )
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise ConfigurationError(
            "--dask: dask.distributed is not installed; pip install gearchaos[dask]"
        ) from None


def _compute(
    simulation: Simulation,
    output: str,
    part: Part | None,
    options: argparse.Namespace,
    arguments: list[str],
) -> int:
    from gearchaos.engine.running import metadata
    from gearchaos.engine.store_filling import fill, open_store
    from gearchaos.finishing import ending, prepare
    from gearchaos.progress import say
    from gearchaos.results.atomic_file import check_output

    quiet = options.quiet
    check_output(output, options.overwrite)
    began = time.monotonic()
    # Workers compile for themselves: this may be another kind of machine.
    prepare(simulation, quiet, compile_now=options.dask is None)
    with open_store(simulation, output, resume=options.resume, part=part) as store:
        try:
            tally, performed_by = fill(simulation, store, options.dask, quiet)
            seconds = time.monotonic() - began
            if part is None:
                store.merge(
                    simulation.parameters,
                    {**metadata(simulation, seconds), **performed_by},
                    overwrite=options.overwrite,
                )
        except (KeyboardInterrupt, GearchaosError) as fault:
            kept = sum(last - first for first, last in store.finished().bounds)
            fault.add_note(f"{kept} of {store.own_lanes} lanes are kept")
            fault.add_note(f"go on with: {_resuming(arguments)}")
            raise
    print(output if part is None else store.folder, flush=True)
    say(f"{store.own_lanes} lanes, {tally.diverged} diverged, {seconds:.1f} s", quiet)
    for remark in tally.remarks:
        say(remark, quiet)
    if part is not None:
        merging = shlex.join([sys.orig_argv[0], "-m", "gearchaos.merge", output])
        say(f"this was part {options.shard}; once all are there: {merging}", quiet)
        return OK
    return ending(NAME, simulation, tally.diverged)


def _resuming(arguments: list[str]) -> str:
    again = [argument for argument in arguments if argument != "--resume"]
    return shlex.join([sys.orig_argv[0], "-m", "gearchaos.sweep", *again, "--resume"])


if __name__ == "__main__":
    sys.exit(main())
