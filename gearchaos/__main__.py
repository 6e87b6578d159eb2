"""The console script: ``gearchaos sweep``, ``gearchaos plot`` and the other commands."""

import sys
from collections.abc import Sequence
from importlib import import_module

from gearchaos.command_line import COMMANDS, OK, USAGE, version_text


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command named first and return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    first = given[0] if given else ""
    if first in COMMANDS:
        code: int = import_module(f"gearchaos.{first}").main(given[1:])
        return code
    if given == ["--version"]:
        print(version_text())
        return OK
    lines = [f"  {name:14} {one['summary']}" for name, one in COMMANDS.items()]
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
