"""How a sweep begins and ends, whether one process computes it or several share it."""

from __future__ import annotations

import sys
from contextlib import suppress

from gearchaos.command_line import OK, TOO_MANY_DIVERGED
from gearchaos.engine.running import COMPILING
from gearchaos.engine.simulation import Simulation
from gearchaos.engine.store_filling import open_store
from gearchaos.errors import FileError
from gearchaos.progress import notice, say
from gearchaos.results.completed import completed
from gearchaos.results.manifest import differing_keys, folder_of


def prepare(simulation: Simulation, quiet: bool, compile_now: bool = True) -> None:
    """Compile the kernel, choose the steps where a tolerance is wanted, and say what was found."""
    if compile_now:
        with notice(COMPILING, quiet):
            simulation.compile()
    simulation.choose_steps()
    for note in simulation.notes:
        say(note, quiet)


def ending(name: str, simulation: Simulation, diverged: int) -> int:
    """Complain in the name of a command if too many lanes diverged, and return the exit code."""
    allowed = simulation.config.outputs.allowed_diverged_share
    if diverged <= allowed * simulation.lanes:
        return OK
    sys.stderr.write(
        f"{name}: {diverged} of {simulation.lanes} lanes diverged, more than "
        f"outputs.allowed_diverged_share = {allowed:g} allows; the file marks them: "
        "raise integration.steps_per_period, or check the load and the start state\n"
    )
    return TOO_MANY_DIVERGED


def complete_already(name: str, simulation: Simulation, output: str, quiet: bool) -> int | None:
    """Go on with a sweep whose result exists: nothing is left to be done.

    Returns
    -------
    int or None
        The exit code that the sweep had; None if the file is no undamaged result.

    Raises
    ------
    FileError
        If the file is the result of another configuration.
    """
    found = completed(output)
    if found is None:
        return None
    if keys := differing_keys(found.configuration, simulation.config.resolved_toml()):
        raise FileError(
            f"{output}: is the result of another configuration, which differs in "
            f"{', '.join(keys)}; restore these values, replace it with --overwrite or choose "
            "another --output"
        )
    if folder_of(output).is_dir():
        # A process that was killed while it tidied up has left its blocks.
        with suppress(FileError), open_store(simulation, output, resume=True) as store:
            store.remove()
    sys.stdout.write(f"{output}\n")
    say(f"complete already: {found.lanes} lanes, {found.diverged} diverged", quiet)
    return ending(name, simulation, found.diverged)
