"""Whether a sweep is complete already, told without reading its arrays."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from gearchaos.results.checksum_line import checksum_fits


class Completed(NamedTuple):
    """What a finished sweep has computed.

    Attributes
    ----------
    configuration : str
        The resolved configuration in TOML.
    lanes : int
        Lanes of the sweep.
    diverged : int
        Those of them that diverged.
    """

    configuration: str
    lanes: int
    diverged: int


def completed(path: str | os.PathLike[str]) -> Completed | None:
    """Look into a result file; None if there is none, or if it is not as it was written."""
    try:
        if not checksum_fits(Path(path)):
            return None
        with h5py.File(path, "r") as file:
            status = file["status"][...]
            return Completed(
                file["configuration_resolved"].asstr()[()],
                status.size,
                int(np.count_nonzero(status)),
            )
    except (OSError, KeyError, ValueError, AttributeError, RuntimeError):
        return None
