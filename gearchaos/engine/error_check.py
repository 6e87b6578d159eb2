"""The error of some lanes of a sweep, measured by computing them again with half the step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos.records.difference import Difference

NOT_CHECKED, SAME, CHANGED = 0, 1, 2
MEANINGS = ("not_checked", "same", "changed")
"""Meanings of the values of ``motion_changed``."""


def checked_lanes(first: int, last: int, share: float) -> NDArray[np.intp]:
    """Return which of the lanes ``first`` to ``last - 1`` are checked, counted from the first.

    The share is spread evenly over the whole sweep and depends on the number of a lane alone.
    """
    numbers = np.arange(first, last)
    return np.flatnonzero(np.floor((numbers + 1) * share) > np.floor(numbers * share))


def check_arrays(
    lanes: int, checked: NDArray[np.intp], difference: Difference
) -> dict[str, NDArray[Any]]:
    """Return what the check says of every lane of a block, by the name of the variable.

    Parameters
    ----------
    lanes : int
        Lanes of the block.
    checked : ndarray of int
        Those that were computed twice, see `checked_lanes`.
    difference : Difference
        Of the checked lanes.
    """
    section = np.full(lanes, np.nan)
    exponent = np.full(lanes, np.nan)
    motion = np.full(lanes, NOT_CHECKED, dtype=np.uint8)
    section[checked] = difference.section_error
    exponent[checked] = difference.exponent_error
    motion[checked] = np.where(difference.changed, CHANGED, SAME)
    return {"section_error": section, "exponent_error": exponent, "motion_changed": motion}


class Tally:
    """What the blocks of a sweep add up to: diverged lanes, and the errors of the checked ones."""

    def __init__(self) -> None:
        self.diverged = 0
        self._unsplit_lanes = 0
        self._unsplit_steps = 0
        self._section: list[NDArray[np.float64]] = []
        self._exponent: list[NDArray[np.float64]] = []
        self._motion: list[NDArray[np.uint8]] = []

    def add(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Count the lanes of one block."""
        self.diverged += int(np.count_nonzero(arrays["status"]))
        if "unsplit_steps" in arrays:
            self._unsplit_lanes += int(np.count_nonzero(arrays["unsplit_steps"]))
            self._unsplit_steps += int(np.sum(arrays["unsplit_steps"]))
        if "motion_changed" in arrays:
            periodic = np.isfinite(arrays["section_error"])
            self._section.append(arrays["section_error"][periodic])
            self._exponent.append(arrays["exponent_error"][periodic])
            self._motion.append(arrays["motion_changed"])

    @property
    def remarks(self) -> list[str]:
        """What a user should know of the lanes, a line each."""
        remarks = [self.errors] if self.errors else []
        if self._unsplit_steps:
            remarks.append(
                f"{self._unsplit_steps} steps of {self._unsplit_lanes} lanes crossed contact "
                "boundaries too often to be split at each (unsplit_steps in the file); raise "
                "integration.steps_per_period"
            )
        return remarks

    @property
    def errors(self) -> str:
        """The errors in one line; empty where no lane was checked."""
        motion = np.concatenate(self._motion) if self._motion else np.zeros(0)
        checked = np.count_nonzero(motion != NOT_CHECKED)
        if checked == 0:
            return ""
        changed = np.count_nonzero(motion == CHANGED)
        text = f"{checked} lanes computed again with half the step: "
        section = np.concatenate(self._section)
        if section.size:
            text += f"section of {section.size} periodic ones off by {_spread(section)}"
            exponent = np.concatenate(self._exponent)
            if np.isfinite(exponent).any():
                text += f", their exponent by {_spread(exponent)}"
            text += "; "
        return f"{text}{changed} move in another way"


def _spread(errors: NDArray[np.float64]) -> str:
    return f"{np.nanmedian(errors):.1e} (median) to {np.nanmax(errors):.1e}"
