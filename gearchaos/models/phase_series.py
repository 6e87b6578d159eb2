"""Fourier series of a quantity that is tabulated over a mesh period."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats

_SAME = 1e-6
"""Phases or values, relative, that are equal up to the digits of the file."""

_LONGEST_STEP = 1.0 / 12.0
"""Longest step between phases, in mesh periods."""

_EVEN_SHARE, _EVEN, _GAP = 0.75, 0.05, 1.5
"""A table is even if this share of its steps differs from the median by less than 5 % of it.
In an even table a step that is longer than 1.5 medians is a gap."""


class Series(NamedTuple):
    """A Fourier series over the mesh period, and how well it fits its table.

    Attributes
    ----------
    mean : float
        Mean value.
    cosine, sine : tuple of float
        Amplitudes of the harmonics 1, 2 and so on.
    error, largest_error : float
        Root mean square of the deviation from the table, and the largest one, over the mean.
    """

    mean: float
    cosine: tuple[float, ...]
    sine: tuple[float, ...]
    error: float
    largest_error: float

    @property
    def harmonics(self) -> int:
        """Number of harmonics."""
        return len(self.cosine)


def checked(phase: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a table over the mesh period without the repetition of its first point at its end.

    ``phase`` in mesh periods. Raises ValueError with the rule that the table breaks and the remedy.
    """
    if phase.size != values.size:
        raise ValueError(
            f"has {phase.size} phases and {values.size} values; give one value for each phase"
        )
    if phase.size < 3:
        raise ValueError(f"has {phase.size} points; give at least 12, spread over a mesh period")
    backward = np.flatnonzero(np.diff(phase) <= 0.0)
    if backward.size:
        at = backward[0] + 1
        raise ValueError(
            f"point {at + 1} has the phase {phase[at]:g} after {phase[at - 1]:g}, and phases must "
            "increase; sort the table and leave out repeated phases"
        )
    negative = np.flatnonzero(values < 0.0)
    if negative.size:
        at = negative[0]
        raise ValueError(
            f"point {at + 1}, at the phase {phase[at]:g}, is {values[at]:g}, and a stiffness must "
            "be at least 0; give the force over the deflection, both positive in compression"
        )
    return _closed(*_one_period(phase, values))


def _one_period(phase: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a table without a last point that repeats the first one."""
    length = phase[-1] - phase[0]
    if length > 1.0 + _SAME:
        raise ValueError(
            f"covers {length:.6g} mesh periods, must be at most 1; set `period` to the length of "
            "a mesh period in the unit of the phase, such as 360 for degrees"
        )
    if length < 1.0 - _SAME:
        return phase, values
    if abs(values[-1] - values[0]) > 1e-3 * np.abs(values).max():
        raise ValueError(
            f"begins with {values[0]:g} and ends, a mesh period later, with {values[-1]:g}, which "
            "must be equal; check the length of the period"
        )
    return phase[:-1], values[:-1]


def _closed(phase: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a table that has no gap; ValueError where it has one."""
    steps = np.diff(phase, append=phase[0] + 1.0)
    median = float(np.median(steps))
    even = np.mean(np.abs(steps - median) < _EVEN * median) >= _EVEN_SHARE
    longest = min(_GAP * median, _LONGEST_STEP) if even else _LONGEST_STEP
    at = int(np.argmax(steps))
    if steps[at] > longest * (1.0 + _SAME):
        following = phase[(at + 1) % phase.size] + (at + 1) // phase.size
        raise ValueError(
            f"has a gap: no point between the phases {phase[at]:g} and {following:g}, in mesh "
            f"periods, where steps of up to {longest:.3g} are allowed; add the points that are "
            "missing, and check `period`"
        )
    return phase, values


@lru_cache(maxsize=64)
def series_of(
    phase: tuple[float, ...], values: tuple[float, ...], error: float, most: int
) -> Series:
    """Return the shortest Fourier series that fits a table, by least squares.

    Each point counts as the part of the mesh period that is next to it. ``phase``: in mesh periods;
    ``error``: largest root mean square of the deviation, over the mean; ``most``: largest number of
    harmonics. Raises ValueError with rule and remedy if the table is not sound, or if ``most``
    harmonics do not fit it.
    """
    places, points = checked(np.array(phase), np.array(values))
    steps = np.diff(places, append=places[0] + 1.0)
    weights = np.sqrt((steps + np.roll(steps, 1)) / 2.0)
    # The longest step resolves this many harmonics.
    resolved = int((1.0 / steps.max() - 1.0 + _SAME) // 2.0)
    count = max(0, min(most, resolved))
    turns = 2.0 * np.pi * np.outer(places, np.arange(1, count + 1))
    waves = np.stack([np.cos(turns), np.sin(turns)], axis=2).reshape(places.size, -1)
    design = np.concatenate([np.ones((places.size, 1)), waves], axis=1)
    # Columns in the order of the harmonics: a shorter series is a leading part of the factors.
    factor, triangle = np.linalg.qr(design * weights[:, np.newaxis])
    weighted = points * weights
    parts = factor.T @ weighted
    rest = np.sum((weighted - factor @ parts) ** 2)
    left = rest + np.append(np.cumsum(parts[:0:-1] ** 2)[::-1], 0.0)[::2]
    mean = float(parts[0] / triangle[0, 0])
    if mean <= 0.0:
        raise ValueError("is zero throughout; give a stiffness")
    errors = np.sqrt(np.maximum(left, 0.0)) / mean
    fitting = np.flatnonzero(errors <= error)
    if not fitting.size:
        limit = "most_harmonics" if count == most else "points of the table"
        raise ValueError(
            f"{count} harmonics fit it to {errors[-1]:.3g} of its mean, and fit_error = {error:g} "
            f"needs more; set fit_error to {1.05 * errors[-1]:.2g}, or give more {limit}"
        )
    size = 1 + 2 * int(fitting[0])
    fitted = np.linalg.solve(triangle[:size, :size], parts[:size])
    deviation = design[:, :size] @ fitted - points
    largest = float(np.abs(deviation).max() / fitted[0])
    reached = float(np.sqrt(np.sum((deviation * weights) ** 2)) / fitted[0])
    return Series(
        float(fitted[0]),
        tuple(map(float, fitted[1::2])),
        tuple(map(float, fitted[2::2])),
        reached,
        largest,
    )
