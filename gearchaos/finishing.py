"""The name of the result of a command that computes, and its exit code."""

import json
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, TOO_MANY_DIVERGED
from gearchaos.errors import FileError
from gearchaos.progress import complain, count_of, say

if TYPE_CHECKING:
    from gearchaos.engine.run_plan import RunPlan


WRITTEN_BY = dict.fromkeys((".png", ".pdf", ".svg", ".eps", ".jpg", ".tiff"), "plot")
WRITTEN_BY |= dict.fromkeys((".csv", ".mat", ".parquet"), "export")
WRITTEN_BY |= {".html": "report"}
"""Endings of files that other commands write from a result."""


def keep_beside(output: Path, words: str, write: Callable[[Path], None]) -> None:
    """Write what was found before an interrupt to a file beside the output, and report its path.

    ``words``: what was found, such as "12 curves"; ``write`` receives the path of the file.
    """
    kept = output.with_name(f"{output.stem}_interrupted.h5")
    write(kept)
    say(f"{kept}: {words}, found before the interrupt")


def output_of(output: str | None, config: str, suffix: str = ".h5") -> str:
    """Return the path of the result: that of --output, or one named after the configuration.

    Raises FileError if this is the configuration itself, a stream instead of a file, or a result in
    HDF5 whose name ends as that of another format.
    """
    if (output or config) == "-":
        raise FileError("-: a result is a file, not a stream, and needs a name; give --output PATH")
    # Text and not a Path, which would drop the slash at the end of a folder.
    if output is None:
        output = f"{Path(config).stem}{suffix}"
    with suppress(OSError, ValueError):  # One of the two does not exist.
        if os.path.samefile(output, config):
            raise FileError(f"{output}: is the input itself; choose another --output")
    kind = Path(output).suffix.lower()
    if suffix.endswith(".h5") and kind in WRITTEN_BY:
        raise FileError(
            f"{output}: this command writes an HDF5 file, which {kind} is no ending for; give a "
            f"name that ends in .h5, and then use gearchaos {WRITTEN_BY[kind]}"
        )
    return output


def print_facts(run: "RunPlan", output: str, diverged: int, said: Sequence[str]) -> None:
    """Print what a run has computed as JSON, for programs."""
    from gearchaos.configuration.methods import METHODS

    facts = {
        "output": output,
        "lanes": len(run.lanes),
        "diverged": diverged,
        "method": METHODS[run.plan.method].name,
        **run.chosen._asdict(),
        "recorded_periods": run.plan.recorded_periods,
        "notes": [*run.notes],
        "remarks": [*said],
    }
    print(json.dumps(facts, indent=1), flush=True)


def ending(run: "RunPlan", output: str, diverged: int, *said: str, as_json: bool = False) -> int:
    """Print the path of the result, or facts as JSON, and these lines; return the exit code.

    Too many diverged lanes give a warning and an exit code of their own.
    """
    from gearchaos.configuration.methods import METHODS

    if as_json:
        print_facts(run, output, diverged, said)
    else:
        print(output, flush=True)
    say(*said)
    allowed = run.config.outputs.allowed_diverged_share
    if diverged <= allowed * len(run.lanes):
        return OK
    complain(
        f"{diverged} of {count_of(len(run.lanes), 'lane')} diverged"
        f"{' or were too fast' if METHODS[run.plan.method].shares_maps else ''}, more than "
        f"outputs.allowed_diverged_share = {allowed:g} allows; the file marks them: "
        "raise integration.steps_per_period, or check the load and the start state"
    )
    return TOO_MANY_DIVERGED


def complete_already(run: "RunPlan", output: str, *, as_json: bool = False) -> int | None:
    """Return the exit code of a sweep whose complete result exists, or None.

    Raises FileError if the result belongs to another configuration or version of gearchaos.
    """
    from gearchaos.engine.provenance import SOFTWARE
    from gearchaos.engine.store_filling import open_store
    from gearchaos.results.files.block_folder import folder_of, require_same
    from gearchaos.results.reading.result import completed

    found = completed(output)
    if found is None:
        return None
    # Another program may have removed the software's version from the file.
    now = {key: fact for key, fact in SOFTWARE._asdict().items() if key in found.metadata}
    now["configuration"] = run.config.resolved_toml()
    resolved = str(found.metadata.get("configuration_resolved", ""))
    earlier = {**found.metadata, "configuration": resolved}
    require_same(f"{output}: is the result", earlier, now, "replace it with --overwrite")
    if folder_of(output).is_dir():
        # A process that was killed during the removal has left its blocks.
        with suppress(FileError), open_store(run, output, resume=True) as store:
            store.remove()
    diverged = int((found["status"] != 0).sum())
    text = f"complete already: {count_of(found['status'].size, 'lane')}, {diverged} diverged"
    return ending(run, output, diverged, text, as_json=as_json)
