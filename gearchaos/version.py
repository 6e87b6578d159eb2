"""The version of gearchaos, as --version, results, figures and reports name it."""

from __future__ import annotations


def software_version() -> str:
    """Return the installed version of gearchaos, "0+unknown" in a clone never installed."""
    # Half of what a command needs to start, and few ask for it.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("gearchaos")
    except PackageNotFoundError:
        return "0+unknown"
