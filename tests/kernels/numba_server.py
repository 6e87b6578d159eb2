"""A process that has imported Numba and no kernels, and forks for each program that uses them.

It reads one JSON list a line: a program, its arguments, more variables of the environment, the
folder of the package of kernels, and the files for stdout and stderr. It answers with the exit
code. What Numba imports before it compiles anything takes two seconds in a process of its own.
"""

import atexit
import importlib
import json
import os
import sys
import traceback
import warnings

import numba
from numba.core.registry import cpu_target

FOR_COMPILING = (
    "numba.core.ccallback",
    "numba.cpython.unicode",
    "numba.np.arraymath",
    "numba.np.linalg",
    "numba.np.npyimpl",
    "numba.np.polynomial.polynomial_functions",
    "numba.typed.typedlist",
)
"""With what these import, most of what Numba does. None of it asks for the processor: that is for
the kernels to decide."""


def main() -> None:
    """Serve until the input ends."""
    for name in FOR_COMPILING:
        importlib.import_module(name)
    cpu_target.typing_context.refresh()
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            run(*json.loads(line))
        code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        sys.stdout.write(f"{code}\n")
        sys.stdout.flush()


def run(
    program: str,
    arguments: list[str],
    variables: dict[str, str],
    package_parent: str,
    out: str,
    err: str,
) -> None:
    """Become the process of one program, for which every warning is an error."""
    for descriptor, name in ((1, out), (2, err)):
        os.dup2(os.open(name, os.O_WRONLY), descriptor)
    os.environ.update(variables)
    numba.config.reload_config()
    sys.path.insert(0, package_parent)
    sys.dont_write_bytecode = True
    warnings.simplefilter("error")
    sys.argv = ["-c", *arguments]
    code = 1
    try:
        exec(compile(program, "<program>", "exec"), {"__name__": "__main__"})
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
