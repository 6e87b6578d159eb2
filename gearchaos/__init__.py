"""Bifurcation diagrams and Lyapunov charts of gear pairs with pitch error.

>>> import gearchaos
>>> config = gearchaos.load_config("sweeps/pan2021.toml")
>>> result = gearchaos.run(config)
>>> result["lyapunov_exponent"].shape
(1501,)
"""

import atexit
import gc
import os
import signal
import sys

# Started as `-m gearchaos.NAME` or as the console script, a command ends on Ctrl-C without a
# traceback of its imports until it heeds interrupts itself. Who else imports this is left alone.
if (
    os.path.basename(*(sys.orig_argv[-len(sys.argv) :][:1] or [""])).split(".")[0] == __name__
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # Commands multiply no large matrices; waiting threads of NumPy would only take time.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # No plugin changes a configuration; to look for them reads the facts of all packages.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # Imports make no garbage. With the usual threshold Python searches for it several times.
    gc.set_threshold(100_000, 50, 100)
    # A search at the end of the process would take a quarter of a short command.
    atexit.register(gc.freeze)

from typing import Any

# Each name is imported on first use: reading and drawing results needs neither Numba nor the
# kernels, and a command that only prints its help imports nothing.
_HOMES = {
    "models": ("Configuration", "load_config"),
    "controlling.controller": ("Controller",),
    "dynamics.controllers": ("ControlSettings",),
    "engine.response": ("respond",),
    "engine.running": ("run",),
    "errors": ("ConfigurationError", "FigureError", "FileError", "GearchaosError"),
    "iso1328": ("iso1328",),
    "results.reading.result": ("Result", "open_result"),
    "system": ("System",),
    "version": ("software_version",),
}
__all__ = sorted(name for names in _HOMES.values() for name in names)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from gearchaos.version import software_version

        return software_version()
    for home, names in _HOMES.items():
        if name in names:
            from importlib import import_module

            module = import_module(f"gearchaos.{home}")
            return module if name == home else getattr(module, name)
    raise AttributeError(f"module 'gearchaos' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
