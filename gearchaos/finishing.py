"""How a command that computes names its output, and how it ends."""

import os
from argparse import Namespace
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, TOO_MANY_DIVERGED
from gearchaos.configuration.methods import METHODS
from gearchaos.errors import FileError
from gearchaos.progress import complain, say

if TYPE_CHECKING:
    from gearchaos.engine.simulation import Simulation


def output_of(options: Namespace, suffix: str = ".h5") -> str:
    """Return the result file to be: that of --output, or one named after the configuration.

    Raises FileError if it is the input itself, or no file at all.
    """
    if (options.output or options.config) == "-":
        raise FileError("-: a result is a file, not a stream, and needs a name; give --output PATH")
    # A text, not a Path, which would drop the slash that tells a folder from a file.
    output: str = options.output
    if options.output is None:
        output = f"{Path(options.config).stem}{suffix}"
    with suppress(OSError, ValueError):  # One of them is not there.
        if os.path.samefile(output, options.config):
            raise FileError(f"{output}: is the input itself; choose another --output")
    return output


def ending(simulation: "Simulation", output: str, diverged: int, *said: str) -> int:
    """Print the path of the result, say these lines, and return the exit code.

    Complains if too many lanes diverged.
    """
    print(output, flush=True)
    say(*said)
    allowed = simulation.config.outputs.allowed_diverged_share
    if diverged <= allowed * len(simulation.lanes):
        return OK
    complain(
        f"{diverged} of {len(simulation.lanes)} lanes diverged"
        f"{' or were too fast' if METHODS[simulation.plan.method].shares_maps else ''}, more than "
        f"outputs.allowed_diverged_share = {allowed:g} allows; the file marks them: "
        "raise integration.steps_per_period, or check the load and the start state"
    )
    return TOO_MANY_DIVERGED


def complete_already(simulation: "Simulation", output: str) -> int | None:
    """Go on with a sweep whose result exists: nothing is left to be done.

    Returns the exit code that the sweep had, None if the file is no undamaged result. Raises
    FileError if it is the result of another configuration or of another gearchaos.
    """
    from gearchaos.engine.provenance import SOFTWARE
    from gearchaos.engine.store_filling import open_store
    from gearchaos.results.files.block_folder import folder_of, require_same
    from gearchaos.results.reading.result import completed

    found = completed(output)
    if found is None:
        return None
    # A file that another program has changed may not say who computed it.
    now = {key: fact for key, fact in SOFTWARE._asdict().items() if key in found.metadata}
    now["configuration"] = simulation.config.resolved_toml()
    resolved = str(found.metadata.get("configuration_resolved", ""))
    earlier = {**found.metadata, "configuration": resolved}
    require_same(f"{output}: is the result", earlier, now, "replace it with --overwrite")
    if folder_of(output).is_dir():
        # A process that was killed while it tidied up has left its blocks.
        with suppress(FileError), open_store(simulation, output, resume=True) as store:
            store.remove()
    diverged = int((found["status"] != 0).sum())
    text = f"complete already: {found['status'].size} lanes, {diverged} diverged"
    return ending(simulation, output, diverged, text)
