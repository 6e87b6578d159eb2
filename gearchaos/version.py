"""The version of gearchaos, as --version, results, figures and reports name it."""

from typing import NamedTuple


class Software(NamedTuple):
    """What decides the numbers of a sweep beside its configuration, by its name in files."""

    software: str
    kernels: str

    def __str__(self) -> str:
        return f"{self.software} (kernels {self.kernels})"


def software_version() -> str:
    """Return the installed version of gearchaos, "0+unknown" in a clone never installed."""
    # Half of what a command needs to start, and few ask for it.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("gearchaos")
    except PackageNotFoundError:
        return "0+unknown"
