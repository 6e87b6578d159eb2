"""The command that joins the parts of a sweep: ``python -m gearchaos.merge sweep.h5``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.errors import FileError

if TYPE_CHECKING:
    from gearchaos.results.block_store import Finished, ShardStore

NAME = "gearchaos merge"
MOST_NAMED = 10

DESCRIPTION = "Join the parts that sweeps with --shard i/N have computed into one result file."

EPILOG = """\
All that is needed lies beside the output: the blocks and the configuration to which they belong.
They are verified, and removed once the result is there. The path of the result goes to stdout,
everything else to stderr. Exit codes as those of the sweep command; 4 names the parts that are
missing, and everything stays as it is."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_command(NAME, partial(_run, argv))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description=DESCRIPTION, epilog=EPILOG, allow_abbrev=False
    )
    add = parser.add_argument
    add("output", metavar="sweep.h5", help="the result file to be, as the sweeps were given it")
    add("--overwrite", action="store_true", help="replace an existing result")
    add("-q", "--quiet", action="store_true", help="say nothing on stderr unless something fails")
    add("--version", action="version", version=version_text())
    return parser


def _run(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    output: str = options.output
    from gearchaos.results.atomic_file import check_output
    from gearchaos.results.completed import completed
    from gearchaos.results.manifest import folder_of, stored_configuration

    finished_before = not options.overwrite and completed(output) is not None
    if finished_before and not folder_of(output).is_dir():
        print(output, flush=True)
        return OK
    resolved, text = stored_configuration(output)
    from gearchaos.configuration import Configuration
    from gearchaos.engine.error_check import Tally
    from gearchaos.engine.running import metadata
    from gearchaos.engine.simulation import Simulation
    from gearchaos.engine.store_filling import open_store
    from gearchaos.finishing import complete_already, ending, prepare

    config = Configuration.from_toml(resolved, f"{folder_of(output)}: configuration")
    simulation = Simulation(config)
    if finished_before:
        code = complete_already(NAME, simulation, output, options.quiet)
        if code is not None:
            return code
    check_output(output, options.overwrite)
    prepare(simulation, options.quiet, compile_now=False)
    with open_store(simulation, output, resume=True) as store:
        tally = Tally()
        found = store.finished(tally.add)
        _require_all(store, found)
        # Who computed for how long is known to the parts alone.
        described = {
            name: value
            for name, value in metadata(simulation, 0.0).items()
            if name not in ("threads", "wall_time_seconds")
        }
        store.merge(
            simulation.parameters,
            {**described, "configuration": text},
            overwrite=options.overwrite,
            found=found,
        )
    print(output, flush=True)
    told = [f"{simulation.lanes} lanes, {tally.diverged} diverged", *tally.remarks]
    if not options.quiet:
        print(*(f"{NAME}: {text}" for text in told), sep="\n", file=sys.stderr)
    return ending(NAME, simulation, tally.diverged)


def _require_all(store: ShardStore, found: Finished) -> None:
    """Name the parts of which blocks are missing, as far as it is known how many there are."""
    from gearchaos.engine.sharding import shared_blocks
    from gearchaos.results.block_store import lanes_text, uncovered

    gaps = store.missing(found.bounds, store.lanes)
    if not gaps:
        return
    remedy = "go on with the sweep and --resume"
    totals = {total for _, total in store.parts}
    if len(totals) == 1:
        (total,) = totals
        blocks = enumerate(shared_blocks(store.lanes, total))
        lacking = {n % total + 1 for n, block in blocks if any(uncovered(block, found.bounds))}
        flags = ", ".join(f"--shard {number}/{total}" for number in sorted(lacking)[:MOST_NAMED])
        more = f" and {len(lacking) - MOST_NAMED} more" if len(lacking) > MOST_NAMED else ""
        remedy = f"run the sweep with {flags}{more} and --resume"
    raise FileError([*found.problems, f"{store.folder}: {lanes_text(gaps)} missing; {remedy}"])


if __name__ == "__main__":
    sys.exit(main())
