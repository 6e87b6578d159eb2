"""Compute the sweep that a configuration file describes, and write it to an HDF5 file.

The path of the result goes to stdout, everything else to stderr. If the sweep is interrupted or
terminated, its finished blocks are kept, and --resume continues from them.

--dask computes on a cluster, --shard in the jobs of a batch system; docs/scale-out.md explains
both.
"""

import sys
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, NamedTuple

from gearchaos.command_line import OK, Command
from gearchaos.errors import ConfigurationError, ExecutionError, FileError
from gearchaos.finishing import complete_already, ending, output_of, print_facts
from gearchaos.options import (
    Arguments,
    Option,
    OutputFile,
    Overwrite,
    Settings,
    Threads,
)
from gearchaos.progress import count_of, say

if TYPE_CHECKING:
    from gearchaos.engine.run_plan import RunPlan
    from gearchaos.engine.store_filling import Shard
    from gearchaos.models import Configuration
    from gearchaos.results.files.block_store import BlockStore


class SweepOptions(NamedTuple):
    """Options of ``gearchaos sweep``."""

    config: Annotated[
        str,
        Option(
            "configuration file; - reads it from stdin", "config.toml", positional=True, file=True
        ),
    ]
    resume: Annotated[bool, Option("continue from the finished blocks of a stopped sweep")] = False
    dask: Annotated[
        str | None,
        Option("compute on the dask cluster of this scheduler, or on local:N processes", "ADDRESS"),
    ] = None
    shard: Annotated[
        str | None,
        Option("compute only the i-th of N shards; python -m gearchaos.merge joins them", "i/N"),
    ] = None
    dry_run: Annotated[bool, Option("estimate time and memory, describe the sweep, and stop")] = (
        False
    )
    json: Annotated[
        bool, Option("print a summary as JSON instead of the path; with --dry-run, the estimate")
    ] = False
    output: OutputFile = None
    overwrite: Overwrite = False
    threads: Threads = None
    settings: Settings = ()
    arguments: Arguments = ()


def _sweep(options: SweepOptions) -> int:
    from gearchaos.models import load_config

    config = load_config(options.config, options.settings)
    from gearchaos.engine.run_plan import plan_run
    from gearchaos.engine.running import choose_threads, prepare
    from gearchaos.engine.store_filling import Shard

    shard = None if options.shard is None else Shard.from_text(options.shard)
    _check_sharing(options, config)
    choose_threads(options.threads)
    run = plan_run(config)
    output = output_of(options.output, options.config)
    if options.dry_run:
        from gearchaos.dry_run import describe

        run = prepare(run)
        describe(run, output, shard, options.json, _others(run, config))
        return OK
    code = None
    if options.resume and not options.overwrite:
        code = complete_already(run, output, as_json=options.json)
    return _compute(run, output, shard, options) if code is None else code


def _others(run: "RunPlan", config: "Configuration") -> list["RunPlan"]:
    """Return a run with each method that was not chosen, if the configuration names none."""
    from gearchaos.engine.method_choice import other_methods
    from gearchaos.engine.run_plan import plan_run
    from gearchaos.engine.running import prepare

    found = []
    for other in other_methods(config, run.plan.method):
        # Steps that were given may be too few for another method.
        with suppress(ConfigurationError):
            found.append(prepare(plan_run(other)))
    return found


def _check_sharing(options: SweepOptions, config: "Configuration") -> None:
    """Raise a ConfigurationError if --dask or --shard cannot compute this sweep."""
    from gearchaos.results.reading.tables import needed

    for flag, value in (("--dask", options.dask), ("--shard", options.shard)):
        if value is not None and config.start.carry != "none":
            raise ConfigurationError(
                f'{flag}: with start.carry = "{config.start.carry}" one value is computed after '
                f'the other; set start.carry = "none" or leave out {flag}'
            )
    if options.dask is None:
        return
    if options.threads is not None and not options.dask.startswith("local:"):
        raise ConfigurationError(
            f"--threads {options.threads}: has no effect on the workers of a cluster; to use fewer "
            "cores, start them with the variable NUMBA_NUM_THREADS"
        )
    needed("distributed", "dask")


def _compute(run: "RunPlan", output: str, shard: "Shard | None", options: SweepOptions) -> int:
    """Compute the sweep, or one shard of it, and return the exit code."""
    from gearchaos.engine.kept import variables_of
    from gearchaos.engine.running import metadata, prepare
    from gearchaos.engine.store_filling import fill, open_store, shared_blocks
    from gearchaos.results.files.atomic_file import check_output

    check_output(output, options.overwrite)
    began = time.monotonic()
    with open_store(run, output, resume=options.resume, shard=shard) as store:
        if store.own_lanes:
            # Workers compile for themselves: they may run on another kind of machine.
            run = prepare(run, compile_now=options.dask is None)
        try:
            tally, performed_by = fill(run, store, options.dask)
            seconds = time.monotonic() - began
            if shard is None:
                facts = {**metadata(run, seconds), **performed_by}
                told = variables_of(run), run.lanes.parameters, facts
                order = run.lanes.computed_at if run.lanes.reordered else None
                store.merge(*told, overwrite=options.overwrite, computed_at=order)
        except (KeyboardInterrupt, FileError, ExecutionError, OSError) as fault:
            _add_remedy(fault, store, output, options)
            raise
    said = [
        f"{count_of(store.own_lanes, 'lane')}, {tally.diverged} diverged, {seconds:.1f} s",
        *tally.remarks,
    ]
    if shard is None:
        return ending(run, output, tally.diverged, *said, as_json=options.json)
    if options.json:
        print_facts(run, str(store.folder), tally.diverged, said)
    else:
        print(store.folder, flush=True)
    join = _command("merge", output)
    if not store.own_lanes:
        used = len(shared_blocks(len(run.lanes), shard.of))
        said = [
            f"shard {options.shard} has no lanes: {count_of(len(run.lanes), 'lane')} make "
            f"{count_of(used, 'block')}, and a shard needs one; {count_of(used, 'shard')} "
            f"{'is' if used == 1 else 'are'} enough"
        ]
    say(*said, f"this was shard {options.shard}; when all are computed, join them with: {join}")
    return OK


def _add_remedy(
    fault: BaseException, store: "BlockStore", output: str, options: SweepOptions
) -> None:
    """Add notes to a fault: how many lanes are kept, and the command that continues the sweep."""
    from gearchaos.results.files.atomic_file import check_output

    kept = sum(last - first for first, last in store.finished().bounds)
    fault.add_note(f"{kept} of {store.own_lanes} lanes are kept")
    again = [argument for argument in options.arguments if argument != "--resume"]
    # No note if the continued sweep would be refused by this check too.
    with suppress(FileError):
        check_output(output, options.overwrite)
        fault.add_note(f"continue with: {_command('sweep', *again, '--resume')}")


def _command(name: str, *arguments: str) -> str:
    """Return a command line to copy, with the same Python."""
    from shlex import join

    return join([sys.orig_argv[0], "-m", f"gearchaos.{name}", *arguments])


main = Command("sweep", __doc__, SweepOptions, _sweep).start(__name__)
