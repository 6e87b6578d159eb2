"""The branches of a sweep: the curves of the periodic orbits it found, and their doublings."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, integrate

from gearchaos.arrays import Floats, Integers
from gearchaos.dynamics.arclength import Curve, CurvePoint, along_the_way
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.dynamics.branch_specials import LOCATED
from gearchaos.dynamics.branches import (
    SIDEWAYS,
    Special,
    TracedBranch,
    doubled_start,
    tracing,
)
from gearchaos.dynamics.curve_defects import Finding, defects_of
from gearchaos.dynamics.orbits import exponents_of
from gearchaos.dynamics.side_by_side import counting, run, together
from gearchaos.engine.kept import recorded_quantities, variables_of
from gearchaos.engine.method_choice import for_continuation
from gearchaos.engine.orbit_metadata import metadata_of, states_of
from gearchaos.engine.recomputing import computable
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.running import one_thread
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.models import Configuration, swept_values
from gearchaos.models.registry import system_of
from gearchaos.outputs import names as known
from gearchaos.outputs.variable import Variable
from gearchaos.progress import progress, say
from gearchaos.records.branch import HALVING, PERIOD_DOUBLING, PeriodicBranch, SpecialPoint
from gearchaos.records.period import coordinate_scale
from gearchaos.results.files.branch_file import BranchSet
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import require_labels

MOST_PERIODS = 8
"""Default of the longest period that is followed, in excitation periods."""

NEAR, SAME = 0.02, 1e-4
"""Largest distance of a motion, and of a closed orbit, from its branch."""

AMID = np.array([0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95])
"""Shares of the arclength of a branch at which it is compared with known ones."""

KNOWN = 0.8
"""Least share of the compared points that lie on known branches if a branch is known."""


class _Motion(NamedTuple):
    """A periodic motion: the share of the way, its section over a period, and its period."""

    share: float
    section: Floats
    period: int


def require_range(config: Configuration, name: str) -> None:
    """Raise ConfigurationError if a sweep has one value only; ``name``: the result in messages."""
    for table, sweep in config.sweeps.items():
        if np.ptp(swept_values(sweep)) == 0.0:
            raise ConfigurationError(
                f"{name}: {table} has one value of {sweep.parameter}, and orbits are followed over "
                "a range; give a sweep of two values or more"
            )


def find_branches(
    result: Result,
    name: str = "the result",
    longest: int = MOST_PERIODS,
    keep: Callable[[BranchSet], None] | None = None,
) -> BranchSet:
    """Follow every periodic motion that a sweep found, through the whole range of the sweep.

    Parameters
    ----------
    result : Result
        Result with labels over one swept parameter, in any number of directions and starts.
    name : str
        Name of the result in messages.
    longest : int
        Longest period, in excitation periods.
    keep : callable, optional
        Called with the branches found so far if the search is interrupted.

    Returns
    -------
    BranchSet
        The branches, those of the shortest period first, and of the lowest values of the parameter
        among them. Contact and loads of the orbits are computed if the sweep has them.

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
    values = np.unique(swept_values(config.sweep))
    require_range(config, name)

    def systems(at: Floats) -> LaneSystem:
        return system_of(config, {parameter: at}, config.needed_effects)

    over = BranchRange(systems, float(values[0]), float(values[-1]))
    search = BranchSearch(over, plan_run(for_continuation(config, over.own_maps)), longest)
    with one_thread(), progress(None, unit="orbits") as bar:
        try:
            search.follow(search.motions(result, swept[0]), bar.update)
        except KeyboardInterrupt as interrupt:
            if keep is not None and search.found:
                keep(_described(search, result.variables[swept[0]]))
            elif not search.found:
                interrupt.add_note("no branch was complete, and nothing is kept")
            raise
        return _described(search, result.variables[swept[0]])


class BranchSearch:
    """The branches that are known so far; arguments as in `find_branches`.

    ``located``: length of the stretch of a branch in which a special point is located; ``scale``
    (states,): scales of the states, by default those of the motions.
    """

    def __init__(
        self,
        over: BranchRange,
        run: RunPlan,
        longest: int,
        located: float = LOCATED,
        scale: Floats | None = None,
    ) -> None:
        self.over, self.run, self.longest, self.located = over, run, longest, located
        self.found: list[TracedBranch] = []
        self._scale = scale

    def motions(self, result: Result, axis: str) -> list[_Motion]:
        """Return the periodic motions of the result, in the order of the parameter."""
        period = result.lanes("period")
        (lanes,) = np.nonzero((period > 0) & (period <= self.longest))
        shares = self.over.share(result.along(axis)[lanes])
        lanes, shares = lanes[np.argsort(shares, kind="stable")], np.sort(shares, kind="stable")
        if not lanes.size:
            return []
        periods = period[lanes].tolist()
        sections = self._sections(result.lanes("end_state")[lanes], shares, period[lanes])
        # One scale for all branches: that of one motion would be too small along the branch.
        if self._scale is None:
            self._scale = coordinate_scale(np.concatenate(sections)[np.newaxis])[0]
        return [
            _Motion(*of_motion)
            for of_motion in zip(shares.tolist(), sections, periods, strict=True)
        ]

    def _sections(self, states: Floats, shares: Floats, periods: Integers) -> list[Floats]:
        """Return the section of every settled motion over its period, each (period, states).

        That of period 1 has one point, which is known; only the others are integrated.
        """
        sections = [state[np.newaxis] for state in states]
        (longer,) = np.nonzero(periods > 1)
        if longer.size:
            system = self.over.system_at(shares[longer])
            whole = int(periods.max()) * system.repeats_after
            plan = self.run.plan._replace(
                steps_per_period=self.over.steps_of_maps(self.run.plan),
                transient_periods=0,
                recorded_periods=whole,
                section_points=whole,
                # The kernel is then that of the branches.
                tangent=True,
                loads=False,
                states=(),
                orders=(),
            )
            outcome = integrate(system, states[longer], plan).every(system.repeats_after)
            for lane, section in zip(longer.tolist(), outcome.section, strict=True):
                sections[lane] = section[: periods[lane]]
        return sections

    def follow(self, motions: Sequence[_Motion], count: Callable[[int], object]) -> None:
        """Follow the orbits of motions that lie on no known branch, with doublings.

        ``count`` receives the numbers of orbits that are computed.
        """
        run(self.following(motions), counting(defects_of, count))

    def following(self, motions: Sequence[_Motion]) -> Finding[None]:
        """Return the search of `follow`.

        One motion of every period at a time: others of the period may lie on the same branch.
        """
        known = 0
        while motions:
            # Only branches found since then may hold more of them.
            held = yield from together([self._holds(one, NEAR, known) for one in motions])
            motions = [one for one, is_held in zip(motions, held, strict=True) if not is_held]
            known = len(self.found)
            middle = _middle_of_each_period(motions)
            yield from self._following(middle)
            motions = [one for one in motions if not any(one is other for other in middle)]

    def _following(self, motions: Sequence[_Motion]) -> Finding[None]:
        """Follow the orbits of motions, then what begins or ends on them, side by side."""
        assert self._scale is not None, "motions() gives the scales"
        waiting = [
            self._from_motion(self.over.curve(self.run.plan, motion.period, self._scale), motion)
            for motion in motions
        ]
        while waiting:
            check()
            branches = yield from together(waiting)
            waiting = []
            for branch in branches:
                if branch is not None and not (yield from self._found_before(branch)):
                    waiting += self._added(branch)

    def _from_motion(self, curve: Curve, motion: _Motion) -> Finding[TracedBranch | None]:
        """Search the branch of a motion; None if its orbit is not found or known."""
        guess = np.append(motion.section[-1] / curve.scale, motion.share)
        start = yield from curve.correcting(guess, along_the_way(guess.size - 1))
        if start is not None and start.half_return < SIDEWAYS:
            half = self.over.curve(self.run.plan, motion.period // 2, curve.scale)
            motion = _Motion(start.share, start.section[: half.periods], half.periods)
            return (yield from self._from_motion(half, motion))
        return (yield from self._traced(curve, start))

    def _from_doubling(self, curve: Curve, special: Special) -> Finding[TracedBranch | None]:
        """Search the branch that begins at a period doubling; None if it is not found or known."""
        start = yield from doubled_start(curve, special.point)
        if start is None:
            value = float(self.over.value(np.array(special.point.share)))
            say(
                f"no orbit of period {2 * curve.periods} is found next to the period doubling at "
                f"{value:.10g}"
            )
        return (yield from self._traced(curve.doubled(), start))

    def _traced(self, curve: Curve, start: CurvePoint | None) -> Finding[TracedBranch | None]:
        """Follow a branch from one of its points, unless it is known."""
        if start is None or (yield from self._holds(_motion_at(curve, start), SAME)):
            return None
        return (yield from tracing(curve, start, self.located))

    def _added(self, branch: TracedBranch) -> Iterator[Finding[TracedBranch | None]]:
        """Add a branch, and yield searches of those that begin or end on it."""
        self.found.append(branch)
        say(
            f"period {branch.period}: {len(branch.points)} orbits, "
            f"{len(branch.specials)} special points"
        )
        for end, reason in zip((branch.points[0], branch.points[-1]), branch.ends, strict=True):
            if reason == HALVING:
                middle = end.place[:-1] + end.halfway / 2.0
                section = (middle * branch.curve.scale)[np.newaxis]
                half = self.over.curve(self.run.plan, branch.period // 2, branch.curve.scale)
                yield self._from_motion(half, _Motion(end.share, section, branch.period // 2))
        for special in branch.specials if 2 * branch.period <= self.longest else ():
            if special.kind == PERIOD_DOUBLING:
                yield self._from_doubling(branch.curve, special)

    def _found_before(self, branch: TracedBranch) -> Finding[bool]:
        """Search whether nearly all of some points amid a branch lie on branches that are known.

        A branch that continues where another one has been lost is not known.
        """
        lengths = branch.positions[-1] * AMID
        chosen = np.unique(
            np.searchsorted(branch.positions, lengths).clip(0, len(branch.points) - 1)
        )
        motions = [_motion_at(branch.curve, branch.points[at]) for at in chosen]
        held = yield from together([self._holds(one, SAME) for one in motions])
        return sum(held) >= KNOWN * len(motions)

    def _holds(self, motion: _Motion, tolerance: float, first: int = 0) -> Finding[bool]:
        """Search whether a motion lies on a branch that has been found, from the first on."""
        for branch in self.found[first:]:
            if branch.period == motion.period and (
                yield from branch.holds(motion.share, motion.section, tolerance)
            ):
                return True
        return False


def _middle_of_each_period(motions: Sequence[_Motion]) -> list[_Motion]:
    """Return one motion of every period, of the shortest first.

    From the middle of its range a branch is followed in both directions for about the same time.
    """
    by_period: dict[int, list[_Motion]] = {}
    for motion in motions:
        by_period.setdefault(motion.period, []).append(motion)
    return [same[len(same) // 2] for _, same in sorted(by_period.items())]


def _motion_at(curve: Curve, point: CurvePoint) -> _Motion:
    """Return the motion of a point of a curve."""
    return _Motion(point.share, point.section, curve.periods)


def _described(search: BranchSearch, parameter: Variable) -> BranchSet:
    """Return the branches of a search as arrays with their descriptions."""
    run = search.run
    branches = sorted(
        (arrays_of_branch(search.over, one, run) for one in search.found),
        key=lambda one: (one.period, float(one.value.min())),
    )
    of_orbits = {name for one in branches for name in one.quantities}
    quantities = tuple(one for one in variables_of(run) if one.name in of_orbits)
    facts = metadata_of(run, run.config, search.longest)
    return BranchSet(parameter, states_of(run), tuple(branches), facts, quantities)


def arrays_of_branch(over: BranchRange, branch: TracedBranch, run: RunPlan) -> PeriodicBranch:
    """Return a traced branch as arrays, with contact and loads if the plan of the run has them."""
    points, shares = branch.points, branch.places[:, -1]
    system = over.system_at(shares)
    multipliers = np.array([one.multipliers for one in points])
    return PeriodicBranch(
        branch.period,
        over.value(shares),
        branch.positions,
        np.array([one.section for one in points]),
        multipliers,
        exponents_of(
            system, run.plan, branch.places[:, :-1] * branch.curve.scale, multipliers, branch.period
        ),
        tuple(
            SpecialPoint(
                one.kind,
                float(over.value(np.array(one.point.share))),
                one.position,
                one.point.section,
                one.point.multipliers,
                flank_name(run, one.flank),
            )
            for one in branch.specials
        ),
        branch.ends,
        _quantities(run, system, branch),
    )


def flank_name(run: RunPlan, number: int) -> str:
    """Return the name of a flank of an element, such as "mesh, back flank"; empty for none."""
    if number < 0:
        return ""
    element, back = divmod(number, 2)
    flank = f"{'back' if back else 'driving'} flank"
    return f"{run.elements[element]}, {run.lanes.model.catalogue.worded(flank)}"


def _quantities(run: RunPlan, system: LaneSystem, branch: TracedBranch) -> dict[str, Floats]:
    """Return contact and loads of all orbits of a branch by output, each (points,)."""
    if not (run.plan.contact or run.plan.loads):
        return {}
    whole = branch.curve.plan.recorded_periods
    plan = run.plan._replace(
        steps_per_period=branch.curve.plan.steps_per_period,
        transient_periods=0,
        recorded_periods=whole,
        section_points=0,
        states=(),
        orders=(),
    )
    states = branch.places[:, :-1] * branch.curve.scale
    outcome = integrate(system, states, plan)
    found = recorded_quantities(replace(run, plan=plan), system, outcome)
    return {name: values.astype(np.float64) for name, values in found.items()}
