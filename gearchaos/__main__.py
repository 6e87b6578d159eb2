"""The console script: ``gearchaos sweep``, ``gearchaos plot`` and the other commands."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

from gearchaos.command_line import OK, USAGE, version_text

COMMANDS = {
    "sweep": "compute a sweep from a configuration file",
    "plot": "draw a result file",
    "stages": "list the stages of a sweep, and refine their boundaries",
    "response": "compute a motion at every step of some mesh periods",
    "reproduce": "compute, draw and compare everything that a paper shows",
    "info": "tell what a result file holds, and verify it",
    "accuracy": "measure what accuracy costs on some lanes of a sweep",
    "merge": "join what several jobs have computed of one sweep",
    "configuration": "print the JSON Schema of a configuration file",
}
_HOMES = {"configuration": "gearchaos.configuration.__main__"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command named first and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments and arguments[0] in COMMANDS:
        home = _HOMES.get(arguments[0], f"gearchaos.{arguments[0]}")
        code = import_module(home).main(arguments[1:])
        return int(code)
    if arguments == ["--version"]:
        print(version_text())
        return OK
    usage = "usage: gearchaos COMMAND ...\n\n" + "\n".join(
        f"  {name:14} {text}" for name, text in COMMANDS.items()
    )
    if arguments and arguments[0] in ("-h", "--help"):
        print(usage)
        return OK
    if arguments:
        print(f"gearchaos: error: no command `{arguments[0]}`", file=sys.stderr)
    print(usage, file=sys.stderr)
    return USAGE


if __name__ == "__main__":
    sys.exit(main())
