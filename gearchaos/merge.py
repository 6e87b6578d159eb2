"""Join the shards that sweeps with --shard i/N have computed into one result file.

The blocks and their configuration are in a folder next to the result file. They are verified, and
removed once the result is written. If shards are missing, the command names them and changes
nothing. The path of the result goes to stdout, everything else to stderr.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from gearchaos.command_line import OK, Command
from gearchaos.errors import FileError
from gearchaos.finishing import complete_already, ending
from gearchaos.options import Option, Overwrite
from gearchaos.progress import count_of

if TYPE_CHECKING:
    from gearchaos.models import Configuration
    from gearchaos.results.files.block_store import BlockStore, Finished

MANY_LANES = 2**17
"""The lanes of a sweep with fewer lanes are prepared in less than a second."""


class MergeOptions(NamedTuple):
    """Options of ``gearchaos merge``."""

    output: Annotated[
        str,
        Option(
            "result file to write, the --output of the sweeps",
            "sweep.h5",
            positional=True,
            file=True,
        ),
    ]
    overwrite: Overwrite = False


def _merge(options: MergeOptions) -> int:
    output = options.output
    from gearchaos.results.files.atomic_file import check_output
    from gearchaos.results.files.block_folder import folder_of, read_manifest, require_same
    from gearchaos.results.reading.result import completed

    folder = folder_of(output)
    if not (options.overwrite or folder.is_dir() or completed(output) is None):
        print(output, flush=True)
        return OK
    manifest = read_manifest(folder)
    from gearchaos.engine.error_check import Tally
    from gearchaos.engine.kept import variables_of
    from gearchaos.engine.provenance import SOFTWARE
    from gearchaos.engine.run_plan import plan_run
    from gearchaos.engine.running import metadata, prepare
    from gearchaos.engine.store_filling import open_store
    from gearchaos.models import Configuration

    # Another version of gearchaos may have other keys.
    require_same(f"{folder}: holds blocks", manifest, SOFTWARE._asdict())
    config = Configuration.from_toml(manifest["configuration"], f"{folder}: configuration")
    _require_some(config, folder)
    run = plan_run(config)
    code = None if options.overwrite else complete_already(run, output)
    if code is not None:
        return code
    check_output(output, options.overwrite)
    with open_store(run, output, resume=True) as store:
        run = prepare(run, compile_now=False)
        tally = Tally(run.lanes.repeats_after)
        found = store.finished(tally.add)
        _require_all(store, found, manifest.get("shards"))
        facts = {**metadata(run, 0.0), "configuration": manifest["text"] or config.text}
        # Only the shards know their threads and how long they took.
        del facts["threads"], facts["wall_time_seconds"]
        told = variables_of(run), run.lanes.parameters, facts
        order = run.lanes.computed_at if run.lanes.reordered else None
        store.merge(*told, overwrite=options.overwrite, found=found, computed_at=order)
    text = f"{count_of(store.lanes, 'lane')}, {tally.diverged} diverged"
    return ending(run, output, tally.diverged, text, *tally.remarks)


def _require_some(config: "Configuration", folder: Path) -> None:
    """Raise a FileError for far too small blocks of a large sweep, before lanes are prepared.

    A manifest may declare millions of lanes, and every lane takes more than a byte in its block.
    """
    from gearchaos.engine.lanes import Lanes

    lanes = len(Lanes(config))
    size = sum(path.lstat().st_size for path in folder.glob("*.block"))
    if lanes > MANY_LANES and size < lanes:
        raise FileError(
            f"{folder}: holds blocks of {size} bytes for {lanes} lanes, so nearly all are missing; "
            "continue the sweep with --resume"
        )


def _require_all(store: "BlockStore", found: "Finished", shards: object) -> None:
    """Raise a FileError for missing blocks; name their shards if the number of shards is known."""
    from gearchaos.engine.store_filling import shared_blocks
    from gearchaos.results.files.block_store import uncovered

    remedy = "continue the sweep with --resume"
    if isinstance(shards, int) and shards > 0:
        blocks = enumerate(shared_blocks(store.lanes, shards))
        lacking = {n % shards + 1 for n, block in blocks if any(uncovered(block, found.bounds))}
        flags = ", ".join(f"--shard {number}/{shards}" for number in sorted(lacking))
        remedy = f"run the sweep with {flags} and --resume"
    store.require_all(found, remedy)


main = Command("merge", __doc__, MergeOptions, _merge).start(__name__)
