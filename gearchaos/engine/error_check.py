"""The error of some lanes of a sweep, measured by computing them again with half the step."""

from collections.abc import Mapping

import numpy as np
from gearchaos_kernels import Status

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.dynamics.largest_exponents import MIXED, UNIFORM
from gearchaos.outputs.names import SECTION
from gearchaos.progress import count_of
from gearchaos.records.control import CAPTURE_MEANINGS, CAPTURED, NO_GAIN, NO_ORBIT, OFF
from gearchaos.records.label import GROWS, UNRESOLVED

NOT_CHECKED, SAME, CHANGED = 0, 1, 2
CHANGE_MEANINGS = (
    "not_checked",
    "same",
    "changed",
)
"""Meanings of the values of ``motion_changed``."""

CHECKED = ("section_error", "exponent_step_error", "motion_changed")
"""Variables of the check."""

_OF_THE_RECORD = "lyapunov_exponent_standard_error"
_OF_KEPT = "spread of the kept section"


def checked_lanes(numbers: Integers, share: float) -> Integers:
    """Return the indices of the checked lanes among lanes with these numbers (lanes,).

    The checked share is spread evenly over the whole sweep and depends on the number of a lane
    only.
    """
    return np.flatnonzero(np.floor((numbers + 1) * share) > np.floor(numbers * share))


def spread_of_kept(arrays: Mapping[str, Array], repeats: int) -> Floats:
    """Return the distance of kept points of periodic lanes from their last period, (lanes,).

    NaN where a lane is not periodic or the file keeps less than a period. ``arrays``: arrays of a
    block with sections (lanes, points) and ``period`` (lanes,) in excitation periods of ``repeats``
    mesh periods.
    """
    status = arrays["status"]
    spread = np.full(status.shape, np.nan)
    periods = repeats * arrays.get("period", np.zeros(status.shape, dtype=np.int32))
    kept = [array for name, array in arrays.items() if name.startswith(SECTION) and array.ndim > 1]
    for period in np.unique(periods[periods > 0]) if kept else ():
        lanes, points = np.flatnonzero(periods == period), np.arange(kept[0].shape[1])
        if points.size >= period:
            phases = (points - points.size) % period - period
            apart = [np.abs(one[lanes] - one[lanes][:, phases]) for one in kept]
            spread[lanes] = np.max(apart, axis=(0, 2))
    return spread


class Tally:
    """Counts over the blocks of a sweep: diverged lanes, and errors of the checked lanes.

    ``repeats``: mesh periods per excitation period.
    """

    def __init__(self, repeats: int = 1) -> None:
        self._repeats = repeats
        self.diverged = self._too_fast = self._mixed = 0
        self._controlled = self._captured = self._without_orbit = self._without_gain = 0
        self._unsplit_lanes = self._unsplit_steps = self._growing = 0
        self._checked = {name: [np.zeros(0)] for name in (*CHECKED, _OF_THE_RECORD, _OF_KEPT)}

    def add(self, arrays: Mapping[str, Array]) -> None:
        """Count the lanes of one block."""
        self.diverged += int(np.count_nonzero(arrays["status"]))
        self._too_fast += int(np.count_nonzero(arrays["status"] == Status.TOO_FAST))
        self._unsplit_lanes += int(np.count_nonzero(arrays.get("unsplit_steps", 0)))
        self._unsplit_steps += int(np.sum(arrays.get("unsplit_steps", 0)))
        self._mixed += int(np.count_nonzero(arrays.get("record", UNIFORM) == MIXED))
        self._growing += int(np.count_nonzero(arrays.get("motion", UNRESOLVED) == GROWS))
        if "capture" in arrays:
            counts = np.bincount(arrays["capture"], minlength=len(CAPTURE_MEANINGS))
            self._controlled += int(counts.sum() - counts[OFF])
            self._captured += int(counts[CAPTURED])
            self._without_orbit += int(counts[NO_ORBIT])
            self._without_gain += int(counts[NO_GAIN])
        if "motion_changed" in arrays:
            checked = arrays["motion_changed"] != NOT_CHECKED
            arrays = {**arrays, _OF_KEPT: spread_of_kept(arrays, self._repeats)}
            for name, blocks in self._checked.items():
                known = arrays.get(name, np.full(checked.shape, np.nan))
                blocks.append(known[checked])

    @property
    def remarks(self) -> list[str]:
        """Remarks about the lanes for the user, one line each."""
        remarks = (
            (self.errors, self.errors),
            (
                self._too_fast,
                f"{self._too_fast} of the lanes counted as diverged move faster than so few flow "
                "maps can follow (status in the file); raise integration.steps_per_period",
            ),
            (
                self._unsplit_steps,
                f"{self._unsplit_steps} steps of {self._unsplit_lanes} lanes crossed contact "
                "boundaries too often to be split at each (unsplit_steps in the file); raise "
                "integration.steps_per_period",
            ),
            (
                self._growing,
                f"the motion of {count_of(self._growing, 'lane')} grows without bound (grows in "
                "the file); shorter steps do not change this: add damping, or check the varying "
                "stiffness for a parametric resonance",
            ),
            (
                self._mixed,
                f"{count_of(self._mixed, 'lane')} settled on a periodic motion within the record "
                "and moved differently before (record in the file); the exponent of such a lane is "
                "that of the periodic motion",
            ),
            (
                self._controlled,
                f"the controller keeps {self._captured} of {self._controlled} lanes on the orbit "
                "in the end (capture in the file)",
            ),
            (
                self._without_orbit,
                f"{count_of(self._without_orbit, 'lane')} ran without control: the orbit does not "
                "exist there",
            ),
            (
                self._without_gain,
                f"{count_of(self._without_gain, 'lane')} ran without control: no gain stabilises "
                "the orbit there",
            ),
        )
        return [text for found, text in remarks if found]

    @property
    def errors(self) -> str:
        """The errors in one line; empty where no lane was checked."""
        found = map(np.concatenate, self._checked.values())
        section, exponent, motion, of_record, of_kept = found
        if motion.size == 0:
            return ""
        text = f"{count_of(motion.size, 'lane')} computed again with half the step: "
        periodic = np.isfinite(section)
        if periodic.any():
            text += f"section of {periodic.sum()} periodic ones off by {_spread(section[periodic])}"
            farthest = np.fmax.reduce(section[periodic] + of_kept[periodic])
            if farthest > 2.0 * np.max(section[periodic]):
                text += f" in the end (up to {farthest:.1e} where the kept section begins)"
            if np.isfinite(exponent[periodic]).any():
                text += f", their exponent by {_spread(exponent[periodic])}"
            text += "; "
        others = np.isfinite(exponent) & np.isfinite(of_record) & ~periodic & (motion == SAME)
        if others.any():
            text += (
                f"exponent of {others.sum()} others by {_spread(exponent[others])} from the step "
                f"and {_spread(of_record[others])} from the length of the record; "
            )
        return f"{text}{np.count_nonzero(motion == CHANGED)} settle on a different motion"


def _spread(errors: Floats) -> str:
    """Return median and maximum of errors in words."""
    return f"{np.nanmedian(errors):.1e} (median) to {np.nanmax(errors):.1e}"
