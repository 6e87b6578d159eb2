"""The number of Runge-Kutta steps per mesh period that a scene needs, tried on some of its lanes.

Some lanes are integrated from their start over a few mesh periods with N and with 2 N steps; what
differs is the error of N steps. It falls 16 times when N is doubled.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Plan, Status, integrate

from gearchaos.arrays import Floats, Integers, Mask
from gearchaos.configuration.methods import EXACT
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.steps import coarse_steps
from gearchaos.interrupts import check

PERIODS = 12
"""Mesh periods that are tried: fast modes have been excited, and chaos has grown little."""

MOST_TRIED_LANES = (
    48  # Lanes that are tried, spread evenly over the sweep, and the one with the fastest mode.
)
LANES_COMPARED = 2048  # Lanes among which that one is looked for.

WRONG = 1e-2
"""Error from which on steps are too coarse, as a part of the largest value of each state."""

WANTED = WRONG / 10.0
"""Error with which a choice is content: lanes beside those that are tried may be worse."""

MOST_CHOSEN = 25_600  # More steps are chosen where stability needs them, and for nothing else.
MOST_WORK = 2e7  # Steps of all lanes together, about a second of one core.

DISTURBANCE = 1e-8  # Of every state at the start, as a part of the largest value of all states.

AMPLIFIED = 1e2
"""Growth of a disturbance beyond which its lane counts as sensitive: more error is then granted.

Chaos makes any error of a step grow, so that no number of steps would be enough for long.
"""

SMALLEST_STATE = 1e-9
"""Largest value of a state, as a part of that of all states, below which its error is not judged.

What is zero but for rounding has no relative error.
"""


class Verdict(NamedTuple):
    """Steps per period, their error in each lane that was tried, and which lanes are sensitive."""

    steps: int
    error: Floats
    granted: Floats

    @property
    def sensitive(self) -> Mask:
        """Lanes in which a disturbance grows so much that their error may be larger."""
        return self.granted > 1.0

    def within(self, error: float) -> bool:
        """Whether no lane has a larger error, sensitive ones as much as is granted to them."""
        return bool(np.all(self.error <= error * self.granted))


def steps_for_exponents(lanes: Lanes, steps: int) -> int:
    """Double a number of steps until it shifts no Lyapunov exponent, or there are too many."""
    while coarse_steps(lanes, steps) and 2 * steps <= MOST_CHOSEN:
        steps *= 2
    return steps


class Trial:
    """Some lanes of a sweep, integrated from their start with different numbers of steps.

    ``plan``: of the sweep; its kernel is used, so that nothing else is compiled. The lanes depend
    on the sweep alone, and so does the choice: shards, workers and threads agree on it.
    ``limit``: fewest steps with which RK4 is stable.
    """

    def __init__(self, lanes: Lanes, plan: Plan) -> None:
        # Only whole records have whole cycles of an order.
        self._plan = plan._replace(
            transient_periods=0, recorded_periods=PERIODS, section_points=PERIODS, orders=()
        )
        self.numbers, self.limit = _tried_lanes(lanes, plan.steps_per_period)
        self._system, self._start = lanes.system_of(self.numbers), lanes.start_of(self.numbers)
        self._known: dict[int, Floats] = {}

    def verdict(self, steps: int) -> Verdict:
        """Judge a number of steps per period against twice as many."""
        coarse, fine = self._section(steps), self._section(2 * steps)
        error = _apart(coarse[:, -1], fine[:, -1], _scale(fine))
        # What leaves the range of numbers with either has no error, but ends with its own status.
        error[np.isnan(fine).any(axis=(1, 2)) & np.isnan(coarse).any(axis=(1, 2))] = 0.0
        granted = np.ones(error.size)
        if np.any(error > WANTED):
            granted = np.maximum(1.0, self._growth / AMPLIFIED)
        return Verdict(steps, error, granted)

    def chosen(self, steps: int, error: float = WANTED) -> Verdict:
        """Double a number of steps until the error is small enough, or there are too many."""
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
        check()
        outcome = integrate(self._system, start, self._plan._replace(steps_per_period=steps))
        sound = (outcome.status == Status.OK)[:, np.newaxis, np.newaxis]
        return np.where(sound, outcome.section, np.nan)

    @cached_property
    def _growth(self) -> Floats:
        """How many times a disturbance of the start grows, with the finest steps so far, (lanes,).

        It is NaN where a lane leaves the range of numbers.
        """
        steps = max(self._known)
        section = self._known[steps]
        # One scale for all: a state that hardly moves is no sign of sensitivity.
        largest = np.nan_to_num(np.max(_scale(section), axis=1, keepdims=True), nan=1.0)
        disturbed = self._integrated(steps, self._start + DISTURBANCE * largest)
        found = _apart(disturbed[:, -1], section[:, -1], largest) / DISTURBANCE
        return np.where(np.isfinite(found), found, 1.0)


def judged_steps(lanes: Lanes, plan: Plan) -> tuple[Plan, str]:
    """Return a plan with the steps that a sweep needs, and what to say of them.

    Those of the plan are kept where the configuration gives a number; the note then says whether
    they are too coarse.
    """
    trial = Trial(lanes, plan)
    if lanes.config.integration.steps_per_period is None:
        chosen = trial.chosen(plan.steps_per_period)
        return plan._replace(steps_per_period=chosen.steps), choice_note(chosen, trial.limit)
    given = trial.verdict(plan.steps_per_period)
    better = given if given.within(WRONG) else trial.chosen(given.steps)
    return plan, coarse_note(given, better)


def choice_note(verdict: Verdict, limit: int) -> str:
    """Word which number of steps was chosen, and why."""
    lanes = verdict.error.size
    chosen = "chosen for this scene"
    if not verdict.within(WANTED):
        chosen = f'the most that are chosen; integration.method = "{EXACT.name}" is more exact'
    return (
        f"integration.steps_per_period = {verdict.steps}, {chosen}: RK4 is stable "
        f"from {limit} on, and after {PERIODS} mesh periods {_off(verdict)} in {_tried(lanes)}"
        f"{_sensitive_ones(verdict)}"
    )


def coarse_note(verdict: Verdict, better: Verdict) -> str:
    """Word that the given number of steps is too coarse; empty where it is not.

    ``better``: the verdict on the steps that would be fine enough.
    """
    wrong = verdict.error > WRONG
    if not wrong.any():
        return ""
    where = f"in {np.count_nonzero(wrong)} of {_tried(verdict.error.size)}"
    text = f"after {PERIODS} mesh periods {_off(verdict)} {where}"
    if not verdict.within(WRONG):
        remedy = f"leave it out, or set it to {better.steps}"
        if not better.within(WANTED):
            remedy = f"no number up to {MOST_CHOSEN} is fine enough"
            remedy += f'; set integration.method = "{EXACT.name}"'
        text = f"integration.steps_per_period = {verdict.steps} is too coarse: {text}; {remedy}"
    return text + _sensitive_ones(verdict)


def _off(verdict: Verdict) -> str:
    largest = np.max(verdict.error)
    if not np.isfinite(largest):
        return "states leave the range of numbers"
    return (
        f"states are off by up to {largest:.1%}"
        if largest > 1e-3
        else (f"states are off by {largest:.0e} of their largest value at most")
    )


def _tried(lanes: int) -> str:
    return f"{lanes} lane{'' if lanes == 1 else 's'} that {'was' if lanes == 1 else 'were'} tried"


def _sensitive_ones(verdict: Verdict) -> str:
    count = np.count_nonzero(verdict.sensitive & (verdict.error > WANTED))
    if not count:
        return ""
    return (
        f"; {count} of them amplif{'ies' if count == 1 else 'y'} any difference more than "
        f"{AMPLIFIED:g} times within these periods, so that the path depends on the step, and only "
        "averages over it do not"
    )


def _scale(section: Floats) -> Floats:
    """Return what errors of the states are parts of, (lanes, states)."""
    largest = np.max(np.abs(section), axis=1)
    least = SMALLEST_STATE * np.max(largest, axis=1, keepdims=True)
    scale: Floats = np.maximum(largest, least)
    return np.where(scale > 0.0, scale, 1.0)


def _apart(one: Floats, other: Floats, scale: Floats) -> Floats:
    """Return how far states are apart in parts of their scale, the largest of them, (lanes,)."""
    with np.errstate(all="ignore"):
        apart = np.max(np.abs(one - other) / scale, axis=1)
    return np.where(np.isnan(apart), np.inf, apart)


def _tried_lanes(lanes: Lanes, steps: int) -> tuple[Integers, int]:
    """Return the numbers of the lanes that are tried, and the stability limit of the fastest one.

    They are fewer where each takes many steps.
    """
    many = lanes.spread(LANES_COMPARED)
    fewest = fewest_stable_steps(lanes.system_of(many))
    count = int(np.clip(MOST_WORK / (3.0 * PERIODS * steps), 1, MOST_TRIED_LANES))
    return np.union1d(lanes.spread(count), many[np.argmax(fewest)]), int(np.max(fewest))
