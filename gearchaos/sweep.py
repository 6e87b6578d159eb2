"""The command that computes a sweep: ``python -m gearchaos.sweep config.toml``."""

from __future__ import annotations

import argparse
import math
import os
import shlex
import sys
import time
from collections.abc import Sequence
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.errors import FileError

if TYPE_CHECKING:
    from gearchaos.engine.error_check import Tally
    from gearchaos.engine.simulation import Bounds, Simulation
    from gearchaos.results.shards import ShardStore

NAME = "gearchaos sweep"
TOO_MANY_DIVERGED = 3

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
    from gearchaos.engine.simulation import Simulation

    choose_threads(options.threads)
    simulation = Simulation(config)
    # A text, not a Path, which would drop the slash that tells a folder from a file.
    output = f"{Path(options.config).stem}.h5" if options.output is None else options.output
    if os.path.exists(output) and os.path.samefile(output, options.config):
        raise FileError(f"{output}: is the configuration itself; choose another --output")
    if options.dry_run:
        _describe(simulation, output, options.quiet)
        return OK
    return _compute(simulation, output, options, arguments)


def _compute(
    simulation: Simulation, output: str, options: argparse.Namespace, arguments: list[str]
) -> int:
    from gearchaos_kernels import current_threads

    from gearchaos.engine.running import metadata
    from gearchaos.progress import say
    from gearchaos.results.atomic_file import check_output
    from gearchaos.results.shards import ShardStore

    check_output(output, options.overwrite)
    began = time.monotonic()
    _prepare(simulation, options.quiet)
    with ShardStore(
        output,
        simulation.variables,
        simulation.lanes,
        simulation.config.resolved_toml(),
        axis=simulation.axis,
        resume=options.resume,
    ) as store:
        found = store.finished()
        for problem in found.problems:
            print(f"{NAME}: {problem}; it is computed again", file=sys.stderr)
        missing = store.missing(found.bounds, simulation.block_lanes(current_threads()))
        try:
            tally = _fill(simulation, store, found.bounds, missing, options.quiet)
            seconds = time.monotonic() - began
            store.merge(
                simulation.parameters, metadata(simulation, seconds), overwrite=options.overwrite
            )
        except (KeyboardInterrupt, FileError) as fault:
            kept = sum(last - first for first, last in store.finished().bounds)
            fault.add_note(f"{kept} of {simulation.lanes} lanes are kept")
            fault.add_note(f"go on with: {_resuming(arguments)}")
            raise
    print(output, flush=True)
    say(f"{simulation.lanes} lanes, {tally.diverged} diverged, {seconds:.1f} s", options.quiet)
    if tally.errors:
        say(tally.errors, options.quiet)
    diverged = tally.diverged
    allowed = simulation.config.outputs.allowed_diverged_share
    if diverged > allowed * simulation.lanes:
        print(
            f"{NAME}: {diverged} of {simulation.lanes} lanes diverged, more than "
            f"outputs.allowed_diverged_share = {allowed:g} allows; the file marks them: "
            "raise integration.steps_per_period, or check the load and the start state",
            file=sys.stderr,
        )
        return TOO_MANY_DIVERGED
    return OK


def _prepare(simulation: Simulation, quiet: bool) -> None:
    """Compile the kernel, choose the steps where a tolerance is wanted, and say what was found."""
    from gearchaos.engine.running import COMPILING
    from gearchaos.progress import notice, say

    with notice(COMPILING, quiet):
        simulation.compile()
    simulation.choose_steps()
    for note in simulation.notes:
        say(note, quiet)


def _fill(
    simulation: Simulation,
    store: ShardStore,
    finished: Sequence[Bounds],
    missing: Sequence[Bounds],
    quiet: bool,
) -> Tally:
    """Compute the missing blocks into the store and add up all of them."""
    from gearchaos.engine.error_check import Tally
    from gearchaos.engine.simulation import compute_all
    from gearchaos.progress import Progress

    readers = {bounds: partial(store.read, *bounds) for bounds in finished}
    tally = Tally()
    for read in readers.values():
        tally.add(read())
    order = simulation.in_order([*finished, *missing])
    done = sum(last - first for first, last in finished)
    with Progress(simulation.lanes, done, quiet) as progress:
        for (first, last), arrays in compute_all(simulation, order, readers):
            store.write(first, last, arrays)
            tally.add(arrays)
            progress.advance(last - first)
    return tally


def _resuming(arguments: list[str]) -> str:
    again = [argument for argument in arguments if argument != "--resume"]
    return shlex.join([sys.orig_argv[0], "-m", "gearchaos.sweep", *again, "--resume"])


def _describe(simulation: Simulation, output: str, quiet: bool) -> None:
    """Say what a run would compute and how long it would take, judged by a few real lanes."""
    import numpy as np
    from gearchaos_kernels import current_threads
    from tqdm import tqdm

    from gearchaos.engine.running import pilot_rate

    _prepare(simulation, quiet)
    seconds = simulation.steps / pilot_rate(simulation)
    duration = f"{seconds:.1f} s" if seconds < 100 else str(timedelta(seconds=round(seconds)))
    config = simulation.config
    sizes = {v.name: len(v.values) for v in simulation.variables if v.values is not None}
    bytes_kept = simulation.lanes * sum(
        np.dtype(v.dtype).itemsize * math.prod(sizes[dim] for dim in v.dims[1:])
        for v in simulation.variables
        if v.dims[0] == simulation.axis
    )
    starts = f", {simulation.starts} starts each" if simulation.starts > 1 else ""
    values, threads = simulation.values, current_threads()
    memory = simulation.block_memory(threads)
    for key, value in {
        "output": f"{output}{' (exists)' if os.path.exists(output) else ''}",
        "effects": ", ".join(config.scene.effects) or "none",
        "states": f"{len(simulation.states)}{_left_out(simulation)}",
        "lanes": f"{simulation.lanes} ({values.size} values of {config.sweep.parameter} from "
        f"{values[0]:g} to {values[-1]:g}{starts})",
        "steps": f"{simulation.steps:.3g} ({simulation.plan.steps_per_period} per period)",
        "file": f"about {tqdm.format_sizeof(bytes_kept, 'B')} before compression",
        "memory": f"about {tqdm.format_sizeof(memory, 'B')} for a block of lanes",
        "time": f"about {duration} with {threads} thread{'s' if threads > 1 else ''}",
    }.items():
        print(f"{key + ':':10}{value}", file=sys.stderr)


def _left_out(simulation: Simulation) -> str:
    unused = [name for name in simulation.config.scene.effects if name not in simulation.effects]
    return f" (nothing that is kept needs {', '.join(unused)})" if unused else ""


if __name__ == "__main__":
    sys.exit(main())
