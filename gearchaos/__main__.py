"""The console script: ``gearchaos sweep``, ``gearchaos plot`` and the other commands."""

import sys
from collections.abc import Sequence
from importlib import import_module

from gearchaos.command_line import CANNOT_READ_OR_WRITE, COMMANDS, OK, USAGE, version_text
from gearchaos.progress import complain, discard, print_error, standing_streams


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command named first and return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    first = given[0] if given else ""
    if first in COMMANDS:
        code: int = import_module(f"gearchaos.{first}").main(given[1:])
        return code
    with standing_streams():
        try:
            return _overview(given)
        except OSError as error:
            complain(f"error: {error}")
            discard(sys.stdout)
            return CANNOT_READ_OR_WRITE


def _overview(given: list[str]) -> int:
    """Print the version or the commands; without either, or with a wrong name, on stderr."""
    if given == ["--version"]:
        print(version_text(), flush=True)
        return OK
    lines = [f"  {name:14} {one['summary']}" for name, one in COMMANDS.items()]
    usage = "\n".join(["usage: gearchaos COMMAND ...", "", *lines])
    if given and given[0] in ("-h", "--help"):
        print(usage, flush=True)
        return OK
    if given:
        print_error(f"gearchaos: error: no command `{given[0]}`")
    print_error(usage)
    return USAGE


if __name__ == "__main__":
    sys.exit(main())
