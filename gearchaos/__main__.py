"""The console script: ``gearchaos sweep``, ``gearchaos plot`` and the other commands."""

import sys
from collections.abc import Sequence
from importlib import import_module

from gearchaos.command_line import CANNOT_READ_OR_WRITE, OK, USAGE
from gearchaos.command_list import COMMANDS
from gearchaos.progress import complain, discard, print_error, standing_streams
from gearchaos.version import version_text


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the first argument names and return its exit code."""
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
    """Print the version or the list of commands; on stderr if no command is named."""
    if given == ["--version"]:
        print(version_text(), flush=True)
        return OK
    lines = [f"  {name:14} {summary}" for name, summary in COMMANDS.items()]
    usage = "\n".join(["usage: gearchaos COMMAND ...", "", *lines, "", _HINT])
    if given and given[0] in ("-h", "--help"):
        print(usage, flush=True)
        return OK
    if given:
        print_error(f"gearchaos: error: no command `{given[0]}`{_nearest(given[0])}")
    print_error(usage)
    return USAGE


_HINT = "`gearchaos COMMAND --help` explains a command."


def _nearest(unknown: str) -> str:
    """Return a question with the command that was probably meant, or an empty text."""
    from difflib import get_close_matches

    near = get_close_matches(unknown, COMMANDS, 1)
    return f"; did you mean `{near[0]}`?" if near else ""


if __name__ == "__main__":
    sys.exit(main())
