"""Compute the sweep that a TOML file describes and write it to an HDF5 file.

The path of the result goes to stdout, everything else to stderr. Interrupted or terminated,
finished blocks are kept and --resume goes on from them.
"""

import sys
import time
from argparse import Namespace
from contextlib import suppress
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, Command
from gearchaos.errors import ConfigurationError, ExecutionError, FileError
from gearchaos.finishing import complete_already, ending, output_of
from gearchaos.progress import say

if TYPE_CHECKING:
    from gearchaos.engine.simulation import Simulation
    from gearchaos.engine.store_filling import Shard
    from gearchaos.models import Configuration


def _sweep(options: Namespace) -> int:
    from gearchaos.models import load_config

    config = load_config(options.config, options.set)
    from gearchaos.engine.running import choose_threads, prepare
    from gearchaos.engine.simulation import Simulation
    from gearchaos.engine.store_filling import Shard

    shard = None if options.shard is None else Shard.from_text(options.shard)
    _check_sharing(options, config)
    choose_threads(options.threads)
    simulation = Simulation(config)
    output = output_of(options)
    if options.json and not options.dry_run:
        raise ConfigurationError("--json: only what --dry-run tells is JSON; a sweep is HDF5")
    if options.dry_run:
        from gearchaos.dry_run import describe

        prepare(simulation)
        describe(simulation, output, shard, options.json)
        return OK
    code = None
    if options.resume and not options.overwrite:
        code = complete_already(simulation, output)
    return _compute(simulation, output, shard, options) if code is None else code


def _check_sharing(options: Namespace, config: "Configuration") -> None:
    """Refuse what --dask and --shard cannot do."""
    from gearchaos.results.reading.tables import needed

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
    needed("distributed", "dask")


def _compute(
    simulation: "Simulation", output: str, shard: "Shard | None", options: Namespace
) -> int:
    from gearchaos.engine.running import metadata, prepare
    from gearchaos.engine.store_filling import fill, open_store
    from gearchaos.results.files.atomic_file import check_output

    check_output(output, options.overwrite)
    began = time.monotonic()
    with open_store(simulation, output, resume=options.resume, shard=shard) as store:
        # Workers compile for themselves: this may be another kind of machine.
        prepare(simulation, compile_now=options.dask is None)
        try:
            tally, performed_by = fill(simulation, store, options.dask)
            seconds = time.monotonic() - began
            if shard is None:
                facts = {**metadata(simulation, seconds), **performed_by}
                told = simulation.variables, simulation.lanes.parameters, facts
                order = simulation.lanes.computed_at if simulation.carried else None
                store.merge(*told, overwrite=options.overwrite, computed_at=order)
        except (KeyboardInterrupt, FileError, ExecutionError, OSError) as fault:
            kept = sum(last - first for first, last in store.finished().bounds)
            fault.add_note(f"{kept} of {store.own_lanes} lanes are kept")
            again = [argument for argument in options.arguments if argument != "--resume"]
            # With this it begins, and may be refused at once.
            with suppress(FileError):
                check_output(output, options.overwrite)
                fault.add_note(f"go on with: {_command('sweep', *again, '--resume')}")
            raise
    said = [f"{store.own_lanes} lanes, {tally.diverged} diverged, {seconds:.1f} s", *tally.remarks]
    if shard is None:
        return ending(simulation, output, tally.diverged, *said)
    print(store.folder, flush=True)
    say(*said, f"this was shard {options.shard}; once all are there: {_command('merge', output)}")
    return OK


def _command(name: str, *arguments: str) -> str:
    from shlex import join

    return join([sys.orig_argv[0], "-m", f"gearchaos.{name}", *arguments])


main = Command("sweep", __doc__, _sweep).start(__name__)
