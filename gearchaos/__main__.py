"""The console script: ``gearchaos sweep``, ``gearchaos plot`` and the other commands."""

import sys
from collections.abc import Sequence
from importlib import import_module

from gearchaos.command_line import OK, USAGE, version_text

COMMANDS = {
    "sweep": "compute a sweep from a configuration file",
    "plot": "draw a result file",
    "stages": "list the stages of a sweep, and refine their boundaries",
    "basins": "find the attractors of a sweep from many starts, and their basins",
    "response": "compute a motion at every step of some mesh periods",
    "reproduce": "compute, draw and compare everything that a paper shows",
    "info": "tell what a result file holds, and verify it",
    "identify": "fit parameters of a pair to what was observed of its diagram",
    "accuracy": "measure what accuracy costs on some lanes of a sweep",
    "merge": "join what several jobs have computed of one sweep",
    "export": "write a result as CSV, Parquet or for MATLAB",
    "example": "list the ready configurations, or copy one",
    "configuration": "print the JSON Schema of a configuration file",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command named first and return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    first = given[0] if given else ""
    if first in COMMANDS:
        # The package of that name is not the command.
        module = "configure" if first == "configuration" else first
        code: int = import_module(f"gearchaos.{module}").main(given[1:])
        return code
    if given == ["--version"]:
        print(version_text())
        return OK
    lines = [f"  {name:14} {text}" for name, text in COMMANDS.items()]
    usage = "\n".join(["usage: gearchaos COMMAND ...", "", *lines])
    if first in ("-h", "--help"):
        print(usage)
        return OK
    if first:
        print(f"gearchaos: error: no command `{first}`", file=sys.stderr)
    print(usage, file=sys.stderr)
    return USAGE


if __name__ == "__main__":
    sys.exit(main())
