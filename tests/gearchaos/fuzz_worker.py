"""A process that runs commands one after the other and reports how each of them ended.

Each line of its input is a JSON list, the command and its arguments. Each line of its output is a
JSON object, the answer. If a command hangs, there is no answer; if it crashes, this process ends.
"""

import contextlib
import importlib
import io
import json
import os
import resource
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

from gearchaos.options import Option

MEMORY = 1 << 30


class Paths(NamedTuple):
    """Options of the commands that load a configuration."""

    paths: Annotated[tuple[str, ...], Option("configuration", positional=True)]


def main() -> None:
    """Serve until the input ends."""
    # Above the limit of `Watch`, which does not count memory that is reserved but unused.
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    for line in sys.stdin:
        command, *arguments = json.loads(line)
        print(json.dumps(run(command, arguments)), file=answers, flush=True)


def run(command: str, arguments: list[str]) -> dict[str, object]:
    """Run one command in this process; return exit code, output and an escaped exception."""
    out, err = io.StringIO(), io.StringIO()
    code, escaped, began = None, "", time.process_time()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = _main(command)(arguments)
        except BaseException:
            escaped = traceback.format_exc()
    return {
        "code": code,
        "out": out.getvalue()[:1000],
        "err": err.getvalue(),
        "escaped": escaped[-3_000:],
        "seconds": time.process_time() - began,
        "megabytes": _peak_megabytes(),
    }


def _peak_megabytes() -> int:
    # Not by getrusage, which begins at the peak of the parent process.
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) >> 10


def _main(command: str) -> Callable[[list[str]], int]:
    if command not in ("load_config", "run"):
        return importlib.import_module(f"gearchaos.{command}").main
    import gearchaos
    from gearchaos.command_line import OK, Command

    def body(options: Paths) -> int:
        config = gearchaos.load_config(*options.paths)
        if command == "run":
            gearchaos.run(config)
        return OK

    return Command(command, "Load a configuration.", Paths, body)


if __name__ == "__main__":
    main()
