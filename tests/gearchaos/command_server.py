"""A process that imports the modules of all commands once, and forks to run each command.

Its arguments name more modules to import. Each line of its input is a JSON list: the number of the
request, module, arguments, folder, the files for stdin, stdout and stderr, more environment
variables, and the size of the largest file that may be written, or null. The server answers with
the number of the process when it begins, and with its exit code when it ends. Every answer is a
line that begins with the number of the request, because several commands may run at the same time.
Except for the imports, a command runs as in a new process.
"""

import atexit
import gc
import importlib
import json
import os
import resource
import runpy
import signal
import sys
from contextlib import suppress
from typing import Any, NoReturn

import compiled_once
import matplotlib.pyplot as plt  # noqa: F401
import numba
from numba.core.registry import cpu_target

import gearchaos.engine.refinement
import gearchaos.engine.running
import gearchaos.engine.store_filling
import gearchaos.figures.response_page
import gearchaos.figures.sweep_page  # noqa: F401

LONGEST = 3600
"""Seconds after which a command is killed: a longer command hangs, also on a busy machine."""


def main() -> None:
    """Serve until the input ends."""
    for name in sys.argv[1:]:
        importlib.import_module(name)
    compiled_once.install()
    # Otherwise Numba would import these in every process before it loads the first kernel.
    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()
    # A garbage collection would write to every object, and so copy the memory of this process.
    gc.freeze()
    for line in sys.stdin:
        bury()
        if os.fork() == 0:
            keep(*json.loads(line))
    bury()


def bury() -> None:
    """Collect the exit codes of ended processes, so that the system removes their entries."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def keep(request: int, *command: Any) -> NoReturn:
    """Fork again to run a command; answer when the command begins and when it has ended."""
    process = os.fork()
    if process == 0:
        run(*command)
    answer(request, process)
    answer(request, os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]))
    os._exit(0)


def answer(request: int, number: int) -> None:
    """Write a line in one call, so that lines of several processes do not mix."""
    os.write(1, f"{request} {number}\n".encode())


def run(
    module: str,
    arguments: list[str],
    folder: str,
    files: list[str],
    variables: dict[str, str],
    largest_file: int | None,
) -> None:
    """Run one command in this process, and exit with its exit code."""
    signal.alarm(LONGEST)
    # A test run in the background may ignore Ctrl-C, and its child processes inherit this.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(folder)
    for descriptor, name in enumerate(files):
        os.dup2(os.open(name, os.O_RDWR), descriptor)
    os.environ.update(variables)
    if "NUMBA_NUM_THREADS" in variables:
        numba.config.NUMBA_NUM_THREADS = int(variables["NUMBA_NUM_THREADS"])
    if "dask" in sys.modules:
        sys.modules["dask"].config.refresh()
    if largest_file is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))
    sys.argv[1:] = arguments
    sys.orig_argv[1:] = ["-m", module, *arguments]
    code = 1
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as leaving:
        code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
