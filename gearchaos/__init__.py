"""Bifurcation diagrams and Lyapunov charts of gear pairs with pitch error.

>>> import gearchaos
>>> config = gearchaos.load_config("sweeps/pan2021.toml")
>>> result = gearchaos.run(config)
>>> result["lyapunov_exponent"]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearchaos.configuration import Configuration, load_config
    from gearchaos.engine.response_run import respond
    from gearchaos.engine.running import run
    from gearchaos.errors import ConfigurationError, FileError, GearchaosError
    from gearchaos.results.result import Result, open_result
    from gearchaos.version import software_version

__all__ = [
    "Configuration",
    "ConfigurationError",
    "FileError",
    "GearchaosError",
    "Result",
    "load_config",
    "open_result",
    "respond",
    "run",
    "software_version",
]

# Each name is imported on first use: reading and drawing results needs neither Numba nor the
# kernels, and a command that only prints its help imports nothing.
_HOMES = {
    "Configuration": "gearchaos.configuration",
    "ConfigurationError": "gearchaos.errors",
    "FileError": "gearchaos.errors",
    "GearchaosError": "gearchaos.errors",
    "Result": "gearchaos.results.result",
    "load_config": "gearchaos.configuration",
    "open_result": "gearchaos.results.result",
    "respond": "gearchaos.engine.response_run",
    "run": "gearchaos.engine.running",
    "software_version": "gearchaos.version",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'gearchaos' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
