"""Server that has imported Numba but no kernels, and forks for each program that uses kernels.

It reads one JSON list per line: a program, its arguments, additional environment variables, the
folder of the package of kernels, and the files for stdout and stderr. It answers with the exit
code. In a new process, the imports of Numba before the first compilation would take two seconds.
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
"""Modules that import most parts of Numba. None of them selects the processor, because this is left
to the kernels."""


def main() -> None:
    """Run programs until the input ends."""
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
    """Run one program in this process and exit; every warning is an error."""
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
