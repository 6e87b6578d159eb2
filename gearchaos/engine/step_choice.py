"""The number of steps per period that a wanted error needs, measured on some lanes of the sweep."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gearchaos.errors import ConfigurationError
from gearchaos.records.difference import Motion, bound, difference

PILOT_LANES = 48
"""Lanes on which the error is measured, spread evenly over the sweep."""

PILOT_PERIODS = 150
"""Mesh periods in which a lane settles on its grid, and as many that are compared."""

MOST_STEPS = 25_600
"""Finest grid of the search."""


class Candidate(NamedTuple):
    """A number of steps per period and what was measured for it against a grid four times finer.

    ``section_error``, ``exponent_error``: not exceeded by 95 % of the lanes that move periodically
    on all three grids, the ``periodic_share`` of them; ``changed_share``: share of the lanes that
    move in another way.
    """

    steps: int
    section_error: float
    exponent_error: float
    changed_share: float
    periodic_share: float

    @property
    def error(self) -> float:
        """The larger of the two errors; NaN counts as no error only where nothing is periodic."""
        return float(np.nanmax([self.section_error, self.exponent_error, 0.0]))


def choose_steps(
    motion: Callable[[int], Motion], coarsest: int, tolerance: float, source: str
) -> list[Candidate]:
    """Double the steps until the error is small enough; the last candidate is the one to take.

    Parameters
    ----------
    motion : callable
        Integrates the pilot lanes with so many steps per period, from one common state.
    coarsest : int
        First number of steps tried.
    tolerance : float
        Largest error of section and exponent.
    source : str
        What a message calls the configuration.

    Raises
    ------
    ConfigurationError
        If the tolerance is not reached, with what was reached, or if no lane moves periodically.
    """
    motions: dict[int, Motion] = {}
    candidates: list[Candidate] = []
    steps = coarsest
    while 4 * steps <= MOST_STEPS:
        for grid in (steps, 2 * steps, 4 * steps):
            if grid not in motions:
                motions[grid] = motion(grid)
        candidates.append(_candidate(steps, motions))
        if np.isnan(candidates[-1].section_error):
            raise ConfigurationError(
                f"{source}: integration.tolerance = {tolerance:g}: none of the lanes that were "
                "tried moves periodically, so that no error can be measured; give "
                "integration.steps_per_period alone"
            )
        if candidates[-1].error <= tolerance:
            return candidates
        steps *= 2
    reached = (
        f"{candidates[-1].error:.1e} with {candidates[-1].steps} steps per period"
        if candidates
        else "nothing, integration.steps_per_period is too large to begin with"
    )
    raise ConfigurationError(
        f"{source}: integration.tolerance = {tolerance:g}: is not reached, but {reached}; ask for "
        "less" + ("" if candidates else " steps")
    )


def _candidate(steps: int, motions: dict[int, Motion]) -> Candidate:
    coarse = difference(motions[steps], motions[4 * steps])
    middle = difference(motions[2 * steps], motions[4 * steps])
    periodic = (coarse.period > 0) & (middle.period > 0)
    return Candidate(
        steps,
        bound(coarse.section_error[periodic]),
        bound(coarse.exponent_error[periodic]),
        float(np.mean(coarse.changed)),
        float(np.mean(periodic)),
    )
