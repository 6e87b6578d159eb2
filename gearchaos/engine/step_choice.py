"""The number of steps per mesh period that a scene needs, from trials on some lanes.

Some lanes are integrated from their start over a few mesh periods with N and with 2 N steps. The
difference is the error of N steps. It decreases by a factor of 16 when N is doubled.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Plan, Status, integrate

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.configuration.methods import DEFAULT, EXACT
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.steps import coarse_steps
from gearchaos.interrupts import check

PERIODS = 12
"""Mesh periods of a trial: enough to excite fast modes, too few for chaos to grow much."""

MOST_TRIED_LANES = (
    48  # Lanes that are tried, spread evenly over the sweep, and the one with the fastest mode.
)
"""Largest number of trial lanes, spread over the sweep, besides the lane with the fastest mode."""
LANES_COMPARED = 2048
"""Number of lanes among which the lane with the fastest mode is searched."""

WRONG = 1e-2
"""Error, relative to the largest value of each state, above which steps are too coarse."""

WANTED = WRONG / 10.0
"""Largest error of chosen steps: other lanes than the trial lanes may have a larger error."""

MOST_CHOSEN = 25_600
"""Largest number of steps chosen for accuracy; stability may need more."""
MOST_WORK = 2e7
"""Largest number of steps of all lanes together, about a second of one core."""

DISTURBANCE = 1e-8
"""Disturbance of every state at the start, relative to the largest value of all states."""

AMPLIFIED = 1e2
"""Growth of a disturbance above which a lane is sensitive and a larger error is allowed.

Chaos amplifies every error of a step, so that no number of steps would be enough for long.
"""

SMALLEST_STATE = 1e-9
"""Largest value of a state, relative to all states, below which its error is not judged.

A state that is zero except for rounding has no relative error.
"""


class Verdict(NamedTuple):
    """The errors of a number of steps.

    Attributes
    ----------
    steps : int
        Steps per mesh period.
    error : array, shape (lanes,)
        Error in each trial lane, relative to the largest value of each state.
    granted : array, shape (lanes,)
        Factor by which the error of a sensitive lane may be larger, otherwise 1.
    """

    steps: int
    error: Floats
    granted: Floats

    @property
    def sensitive(self) -> Mask:
        """Lanes in which a disturbance grows so much that a larger error is allowed."""
        return self.granted > 1.0

    def within(self, error: float) -> bool:
        """Whether no lane has a larger error than this, times its factor."""
        return bool(np.all(self.error <= error * self.granted))


def steps_for_exponents(lanes: Lanes, steps: int) -> int:
    """Double a number of steps until it shifts no Lyapunov exponent, up to a limit."""
    while coarse_steps(lanes, steps) and 2 * steps <= MOST_CHOSEN:
        steps *= 2
    return steps


class Trial:
    """Some lanes of a sweep, integrated from their start with different numbers of steps.

    ``plan``: plan of the sweep, whose kernel is used, so that no other kernel is compiled. The
    trial lanes depend on the sweep only; shards, workers and threads therefore choose the same
    steps. ``limit``: stability limit in steps per period.
    """

    def __init__(self, lanes: Lanes, plan: Plan) -> None:
        # The short record does not have whole cycles of every order.
        self._plan = plan._replace(
            transient_periods=0, recorded_periods=PERIODS, section_points=PERIODS, orders=()
        )
        self.numbers, self.limit = _tried_lanes(lanes, plan.steps_per_period)
        self._system, self._start = lanes.system_of(self.numbers), lanes.start_of(self.numbers)
        self._known: dict[int, Floats] = {}

    def verdict(self, steps: int) -> Verdict:
        """Judge a number of steps per period by comparison with twice as many."""
        coarse, fine = self._section(steps), self._section(2 * steps)
        error = _apart(coarse[:, -1], fine[:, -1], _scale(fine))
        # A lane that diverges with both numbers of steps has no error; its status reports it.
        error[np.isnan(fine).any(axis=(1, 2)) & np.isnan(coarse).any(axis=(1, 2))] = 0.0
        granted = np.ones(error.size)
        if np.any(error > WANTED):
            granted = np.maximum(1.0, self._growth / AMPLIFIED)
        return Verdict(steps, error, granted)

    def chosen(self, steps: int, error: float = WANTED) -> Verdict:
        """Double a number of steps until the error is small enough, up to a limit."""
        verdict = self.verdict(steps)
        while not verdict.within(error) and 2 * verdict.steps <= MOST_CHOSEN:
            verdict = self.verdict(2 * verdict.steps)
        return verdict

    def _section(self, steps: int) -> Floats:
        """Return the states after each mesh period, (lanes, periods, states)."""
        if steps not in self._known:
            self._known[steps] = self._integrated(steps, self._start)
        return self._known[steps]

    def _integrated(self, steps: int, start: Floats) -> Floats:
        """Integrate from a start (lanes, states); NaN in lanes that diverge."""
        check()
        outcome = integrate(self._system, start, self._plan._replace(steps_per_period=steps))
        sound = (outcome.status == Status.OK)[:, np.newaxis, np.newaxis]
        return np.where(sound, outcome.section, np.nan)

    @cached_property
    def _growth(self) -> Floats:
        """Growth of a disturbance of the start, with the finest steps so far, (lanes,).

        NaN where a lane leaves the range of numbers.
        """
        steps = max(self._known)
        section = self._known[steps]
        # One scale for all states: a state that hardly moves does not show sensitivity.
        largest = np.nan_to_num(np.max(_scale(section), axis=1, keepdims=True), nan=1.0)
        disturbed = self._integrated(steps, self._start + DISTURBANCE * largest)
        found = _apart(disturbed[:, -1], section[:, -1], largest) / DISTURBANCE
        return np.where(np.isfinite(found), found, 1.0)


def judged_steps(lanes: Lanes, plan: Plan) -> tuple[Plan, str]:
    """Return a plan with the steps that a sweep needs, and a note.

    Configured steps are kept; the note then reports whether they are too coarse.
    """
    trial = Trial(lanes, plan)
    if lanes.config.integration.fixed_steps is None:
        chosen = trial.chosen(plan.steps_per_period)
        return plan._replace(steps_per_period=chosen.steps), choice_note(chosen, trial.limit)
    given = trial.verdict(plan.steps_per_period)
    better = given if given.within(WRONG) else trial.chosen(given.steps)
    return plan, coarse_note(given, better)


def choice_note(verdict: Verdict, limit: int) -> str:
    """Return a note with the chosen number of steps and the reason."""
    lanes = verdict.error.size
    chosen = "chosen for this scene"
    if not verdict.within(WANTED):
        chosen = f'the most that are chosen; integration.method = "{EXACT.name}" is more exact'
    return (
        f"integration.steps_per_period = {verdict.steps}, {chosen}: {DEFAULT.title} is stable "
        f"from {limit} on, and after {PERIODS} periods {_off(verdict)} in {_tried(lanes)}"
        f"{_sensitive_ones(verdict)}"
    )


def coarse_note(verdict: Verdict, better: Verdict) -> str:
    """Return a note that the given number of steps is too coarse; empty if it is not.

    ``better``: verdict on steps that are fine enough.
    """
    wrong = verdict.error > WRONG
    if not wrong.any():
        return ""
    where = f"in {np.count_nonzero(wrong)} of {_tried(verdict.error.size)}"
    text = f"after {PERIODS} periods {_off(verdict)} {where}"
    if not verdict.within(WRONG):
        remedy = f"leave it out, or set it to {better.steps}"
        if not better.within(WANTED):
            remedy = f"no number up to {MOST_CHOSEN} is fine enough"
            remedy += f'; set integration.method = "{EXACT.name}"'
        text = f"integration.steps_per_period = {verdict.steps} is too coarse: {text}; {remedy}"
    return text + _sensitive_ones(verdict)


def _off(verdict: Verdict) -> str:
    """Return the largest error in words."""
    largest = np.max(verdict.error)
    if not np.isfinite(largest):
        return "states leave the range of numbers"
    return (
        f"states are off by up to {largest:.1%}"
        if largest > 1e-3
        else (f"states are off by {largest:.0e} of their largest value at most")
    )


def _tried(lanes: int) -> str:
    """Return the number of trial lanes in words."""
    return f"{lanes} lane{'' if lanes == 1 else 's'} that {'was' if lanes == 1 else 'were'} tried"


def _sensitive_ones(verdict: Verdict) -> str:
    """Return the number of sensitive lanes in words."""
    count = np.count_nonzero(verdict.sensitive & (verdict.error > WANTED))
    if not count:
        return ""
    return (
        f"; in {count} of them any error grows more than {AMPLIFIED:g} times within these periods, "
        "as in chaos: with other steps their states differ, while averages over them do not"
    )


def _scale(section: Floats) -> Floats:
    """Return the scales of the states, (lanes, states)."""
    largest = np.max(np.abs(section), axis=1)
    least = SMALLEST_STATE * np.max(largest, axis=1, keepdims=True)
    scale: Floats = np.maximum(largest, least)
    return np.where(scale > 0.0, scale, 1.0)


def _apart(one: Floats, other: Floats, scale: Floats) -> Floats:
    """Return the largest scaled difference of states (lanes, states), (lanes,)."""
    with np.errstate(all="ignore"):
        apart = np.max(np.abs(one - other) / scale, axis=1)
    return np.where(np.isnan(apart), np.inf, apart)


def _tried_lanes(lanes: Lanes, steps: int) -> tuple[Integers, int]:
    """Return the numbers of the trial lanes, and the largest stability limit.

    There are fewer trial lanes if each takes many steps.
    """
    many = lanes.spread(LANES_COMPARED)
    fewest = fewest_stable_steps(lanes.system_of(many))
    count = int(np.clip(MOST_WORK / (3.0 * PERIODS * steps), 1, MOST_TRIED_LANES))
    return np.union1d(lanes.spread(count), many[np.argmax(fewest)]), int(np.max(fewest))
