"""The version of gearchaos, as --version, results, figures and reports name it."""

import sys
from typing import NamedTuple


class Software(NamedTuple):
    """The software that, with the configuration, determines the numbers of a sweep."""

    software: str
    kernels: str

    def __str__(self) -> str:
        return f"{self.software} (kernels {self.kernels})"


def software_version() -> str:
    """Return the installed version of gearchaos.

    Returns
    -------
    str
        The version; "0+unknown" in a clone that was never installed.

    Examples
    --------
    >>> isinstance(gearchaos.software_version(), str)
    True
    """
    # Imported here: it takes a third of the time of an empty command, and few commands need it.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("gearchaos")
    except PackageNotFoundError:
        return "0+unknown"


def version_text() -> str:
    """Return the one line that --version prints: gearchaos, Python and the platform."""
    from platform import python_version

    return f"gearchaos {software_version()} (Python {python_version()}, {sys.platform})"
