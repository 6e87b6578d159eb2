"""The branches of a sweep: the curves of the periodic orbits it found, and their doublings."""

from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, integrate

from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import Curve, CurvePoint
from gearchaos.dynamics.branches import (
    HALVING,
    PERIOD_DOUBLING,
    TracedBranch,
    doubled_start,
    trace,
)
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.recomputing import computable
from gearchaos.engine.running import choose_threads
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.models import Configuration, swept_values
from gearchaos.models.registry import system_of
from gearchaos.outputs import names as known
from gearchaos.progress import say
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import require_labels

MOST_PERIODS = 8
"""Default of the longest period that is followed, in excitation periods."""

NEAR, SAME = 0.02, 1e-4
"""Largest distance of a motion, and of a closed orbit, from a branch on which it lies."""


class Branches(NamedTuple):
    """The branches of a sweep.

    Attributes
    ----------
    config : Configuration
        The configuration with which they were computed.
    parameter : str
        Name of the swept parameter.
    low, high : float
        The range of the parameter; shares of the way run from the first to the second.
    found : list of TracedBranch
        The branches.
    """

    config: Configuration
    parameter: str
    low: float
    high: float
    found: list[TracedBranch]

    def value(self, share: float) -> float:
        """Return the value of the parameter at a share of the way."""
        return self.low + share * (self.high - self.low)


class _Motion(NamedTuple):
    """A periodic motion: the share of the way, its section over a period, and its period."""

    share: float
    section: Floats
    period: int


def find_branches(
    result: Result,
    name: str = "the result",
    longest: int = MOST_PERIODS,
    threads: int | None = None,
) -> Branches:
    """Follow every periodic motion that a sweep found, through the whole range of the sweep.

    Parameters
    ----------
    result : Result
        Result with labels over one swept parameter, in any number of directions and starts.
    name : str
        Name of the result in messages.
    longest : int
        Longest period, in excitation periods.
    threads : int, optional
        Number of threads; by default all cores.

    Returns
    -------
    Branches
        The branches, those of the lowest values of the parameter first, each followed by those that
        begin at its period doublings.

    Raises
    ------
    ConfigurationError
        If the result is over two parameters, or over numbers with nothing between them.
    FileError
        If the result has no labels, or no configuration.
    """
    require_labels(result, name)
    swept = [axis for axis in result.axes if axis not in (known.START, known.DIRECTION)]
    config = computable(result, name).replace("start.carry", "none")
    parameter = config.sweep.parameter
    if len(swept) != 1 or known.axis_name(parameter) != swept[0]:
        raise ConfigurationError(
            f"{name}: has the axes {', '.join(result.axes)}; branches are those over one swept "
            "parameter: choose a value of the other with --at"
        )
    if parameter in config.discrete_parameters:
        raise ConfigurationError(
            f"{name}: nothing lies between two values of {parameter}; sweep another parameter"
        )
    choose_threads(threads)
    values = np.unique(swept_values(config.sweep))
    search = _Search(config, float(values[0]), float(values[-1]), longest)
    for motion in search.motions(result, swept[0]):
        check()
        search.follow(motion)
    return Branches(config, parameter, search.low, search.high, search.found)


class _Search:
    """The branches that are known so far; arguments as in `Branches`."""

    def __init__(self, config: Configuration, low: float, high: float, longest: int) -> None:
        self.config, self.low, self.high, self.longest = config, low, high, longest
        self.found: list[TracedBranch] = []
        self._plan = plan_of(config)

    def _system_at(self, shares: Floats) -> LaneSystem:
        """Return the systems at shares of the way (lanes,)."""
        values = self.low + shares * (self.high - self.low)
        return system_of(
            self.config, {self.config.sweep.parameter: values}, self.config.needed_effects
        )

    def motions(self, result: Result, axis: str) -> Iterator[_Motion]:
        """Yield the periodic motions of the result, in the order of the parameter."""
        period = result.lanes("period")
        (lanes,) = np.nonzero((period > 0) & (period <= self.longest))
        shares = (result.along(axis)[lanes] - self.low) / (self.high - self.low)
        lanes, shares = lanes[np.argsort(shares, kind="stable")], np.sort(shares, kind="stable")
        if not lanes.size:
            return
        states = result.lanes("end_state")[lanes]
        system = self._system_at(shares)
        periods = int(period[lanes].max()) * system.repeats_after
        plan = self._plan._replace(
            transient_periods=0, recorded_periods=periods, section_points=periods
        )
        sections = integrate(system, states, plan).every(system.repeats_after).section
        for lane, share, section in zip(lanes, shares, sections, strict=True):
            n = int(period[lane])
            yield _Motion(float(share), section[:n], n)

    def follow(self, motion: _Motion) -> None:
        """Follow the orbit of a motion, unless it lies on a known branch, and all its doublings."""
        if self._known(motion, NEAR):
            return
        waiting = deque([motion])
        while waiting:
            motion = waiting.popleft()
            curve = self._curve(motion)
            guess = np.append(motion.section[-1] / curve.scale, motion.share)
            start = curve.corrected(guess, np.append(np.zeros(guess.size - 1), 1.0))
            if start is None or self._known(self._motion_at(curve, start), SAME):
                continue
            self._add(trace(curve, start), waiting)

    def _add(self, branch: TracedBranch, waiting: "deque[_Motion]") -> None:
        """Add a branch unless it is known, and those that begin at its period doublings."""
        if self._found_before(branch):
            return
        self.found.append(branch)
        say(
            f"period {branch.period}: {len(branch.points)} orbits, "
            f"{len(branch.specials)} special points"
        )
        for end, reason in zip((branch.points[0], branch.points[-1]), branch.ends, strict=True):
            if reason == HALVING:
                middle = end.place[:-1] + end.halfway / 2.0
                section = (middle * branch.curve.scale)[np.newaxis]
                waiting.append(_Motion(end.share, section, branch.period // 2))
        if 2 * branch.period > self.longest:
            return
        for special in branch.specials:
            check()
            if special.kind == PERIOD_DOUBLING:
                start, doubled = doubled_start(branch.curve, special.point), branch.curve.doubled()
                if start is not None and not self._known(self._motion_at(doubled, start), SAME):
                    self._add(trace(doubled, start, one_way=True), waiting)

    def _curve(self, motion: _Motion) -> Curve:
        """Return the curve of orbits of the period of a motion."""
        given = self._system_at, self._plan, motion.period, motion.section[-1], motion.share
        return Curve.through(*given, contact=True)

    def _motion_at(self, curve: Curve, point: CurvePoint) -> _Motion:
        """Return the motion of a point of a curve."""
        return _Motion(point.share, curve.section(point), curve.periods)

    def _found_before(self, branch: TracedBranch) -> bool:
        """Whether most of some points in the middle of a branch lie on a branch that is known."""
        chosen = np.unique(np.linspace(0, len(branch.points) - 1, 7).astype(int)[1:-1])
        motions = [self._motion_at(branch.curve, branch.points[at]) for at in chosen]
        return 2 * sum(self._known(one, SAME) for one in motions) > len(motions)

    def _known(self, motion: _Motion, tolerance: float) -> bool:
        """Whether a motion lies on a branch that has been found."""
        return any(
            branch.period == motion.period and branch.holds(motion.share, motion.section, tolerance)
            for branch in self.found
        )
