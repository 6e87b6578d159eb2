"""The boundaries of a map: where its periodic orbits fold, double, turn or graze."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from gearchaos.arrays import Complex, Floats, Integers, Mask
from gearchaos.dynamics.arclength import Curve, along_the_way
from gearchaos.dynamics.boundary_passages import PARAMETERS, Following, Passing, passed_of
from gearchaos.dynamics.branches import Special, TracedBranch
from gearchaos.dynamics.branches import tracing as tracing_branch
from gearchaos.dynamics.curve_defects import Finding, defects_of
from gearchaos.dynamics.side_by_side import Found, counting, run, together
from gearchaos.engine.boundary_description import described
from gearchaos.engine.branching import BranchSearch, require_range
from gearchaos.engine.known_boundaries import Begun, KnownBoundaries, beginning
from gearchaos.engine.map_changes import DOUBLES, JUMP, Changes, MapChange, changes_of
from gearchaos.engine.map_equations import MapEquations
from gearchaos.engine.map_lines import Line, Ranges
from gearchaos.engine.method_choice import for_continuation
from gearchaos.engine.recomputing import computable
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.running import one_thread
from gearchaos.engine.running import run as compute
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.models import Configuration, swept_values
from gearchaos.outputs import names as known
from gearchaos.progress import count_of, progress, say
from gearchaos.records.branch import (
    BRANCH_POINT,
    FOLD,
    GRAZING,
    LONGEST_GRAZING,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
)
from gearchaos.records.period import coordinate_scale
from gearchaos.results.files.boundary_file import BoundarySet
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import require_labels

LINES, PERIODS = 4, 1
"""Default of the lines across the map, and of the longest period."""

SIDE_BY_SIDE = 8
"""Number of lines that are searched side by side."""

COARSE = 24
"""Values of each parameter of the map that is computed from a configuration."""

SIDES = "driving", "back"
"""The flanks of an element in the order of their numbers."""

NEAR_FOLD = 0.3
"""Least real multiplier of a motion in a cell that may lie next to a fold."""

APPROXIMATE = 1e-7
"""Length of the stretch of a branch in which a start is located; the equations then correct it."""


def find_boundaries(
    result: Result,
    name: str = "the result",
    longest: int = PERIODS,
    lines: int = LINES,
    keep: Callable[[BoundarySet], None] | None = None,
) -> BoundarySet:
    """Follow the boundaries of the periodic orbits of a map, over the ranges of both parameters.

    Parameters
    ----------
    result : Result
        Result with labels over two swept parameters.
    name : str
        Name of the result in messages.
    longest : int
        Longest period, in excitation periods.
    lines : int
        Number of lines across the map in each direction. Branches are traced along each, and the
        special points of these are starts of boundaries, besides the changes of the map.
    keep : callable, optional
        Called with the boundaries found so far if the search is interrupted.

    Returns
    -------
    BoundarySet
        The boundaries, by kind and period.

    Raises
    ------
    ConfigurationError
        If the result is not over two parameters, or over numbers with nothing between them.
    FileError
        If the result has no labels, or no configuration.
    """
    require_labels(result, name)
    swept = [axis for axis in result.axes if axis not in known.UNSWEPT]
    config = computable(result, name).replace("start.carry", "none")
    parameters = [sweep.parameter for sweep in config.sweeps.values()]
    if len(swept) != PARAMETERS or {known.axis_name(one) for one in parameters} != {*swept}:
        raise ConfigurationError(
            f"{name}: has the axes {', '.join(result.axes) or 'none'}; boundaries are curves over "
            "two swept parameters: add [second_sweep], or choose values of further axes with --at"
        )
    if whole := [one for one in parameters if one in config.discrete_parameters]:
        raise ConfigurationError(
            f"{name}: nothing lies between two values of {whole[0]}; sweep another parameter"
        )
    require_range(config, name)
    over = Ranges.of(config)
    small = for_continuation(
        _small(config, PARAMETERS), lambda method: any(over.maps_depend(method))
    )
    searched = 0
    with one_thread(), progress(None, unit="orbits") as bar:
        search = _BoundarySearch(over, plan_run(small), longest, result, bar.update)
        places = search.lines(lines)
        try:
            search.begin_with_changes(result)
            for first in range(0, len(places), SIDE_BY_SIDE):
                check()
                some = places[first : first + SIDE_BY_SIDE]
                branches = search.along_lines(result, some)
                searched += len(some)
                traced = count_of(branches, "branch", "branches")
                say(f"{count_of(len(some), 'line')}: {traced}; {search.boundaries.counted}")
            search.from_changes()
            say(f"{search.boundaries.counted} in all")
        except KeyboardInterrupt as interrupt:
            interrupt.add_note(f"{searched} of {len(places)} lines were searched")
            if keep is not None and search.boundaries.found:
                keep(search.described(result))
            raise
        return search.described(result)


def coarse_map(config: Configuration) -> Result:
    """Compute the map of a configuration with few values of each of its two parameters.

    Raises ConfigurationError if it has no second sweep.
    """
    if config.second_sweep is None:
        raise ConfigurationError(
            f"{config.source}: has no [second_sweep]; boundaries are curves over two swept "
            "parameters: add it, or run gearchaos branches"
        )
    return compute(_small(config, COARSE))


def _small(config: Configuration, count: int) -> Configuration:
    """Return a configuration with few values of its parameters over the same ranges."""
    for key, sweep in config.sweeps.items():
        values = swept_values(sweep)
        if values.size > count:
            chosen = np.linspace(values[0], values[-1], count).tolist()
            config = config.replace(key, {"parameter": sweep.parameter, "values": chosen})
    return config


class _BoundarySearch:
    """Search boundaries from special points of branches along lines, and from changes of a map.

    ``result`` gives the scales of the states; ``count`` receives the numbers of orbits that are
    computed.
    """

    def __init__(
        self,
        over: Ranges,
        run: RunPlan,
        longest: int,
        result: Result,
        count: Callable[[int], object],
    ) -> None:
        self.over, self.run, self.longest = over, run, longest
        self.left: Changes
        self._answers, self._defects = counting(passed_of, count), counting(defects_of, count)
        period, states = result.lanes("period"), result.lanes("end_state")
        moving = states[np.isfinite(states).all(axis=1) & (period > 0) & (period <= longest)]
        if not moving.size:
            moving = np.ones((1, states.shape[1]))
        # One scale for all boundaries: that of one motion would be too small along the curve.
        self.scale = coordinate_scale(moving[np.newaxis])[0]
        self.equations = MapEquations(over, run, self.scale)
        self.boundaries = KnownBoundaries(self.equations, self._answers)

    def described(self, result: Result) -> BoundarySet:
        """Return the boundaries found so far as arrays with their descriptions."""
        return described(self.boundaries.found, self.over, self.run, self.longest, result)

    def lines(self, count: int) -> list[tuple[int, float]]:
        """Return the lines across the map: the parameter that each has one value of, and its share.

        ``count``: number of lines in each direction. Along a parameter on which flow maps depend,
        they are made anew at every value, so that one line in the middle has to do.
        """
        counts = [
            count if self.equations.fixed in (one, -1) else min(count, 1)
            for one in range(PARAMETERS)
        ]
        return [
            (one, (at + 0.5) / counts[one])
            for one in range(PARAMETERS)
            for at in range(counts[one])
        ]

    def along_lines(self, result: Result, places: Sequence[tuple[int, float]]) -> int:
        """Trace the branches along lines, and follow boundaries from them and from changes.

        ``places``: for each line the parameter that it has one value of, and the share of its
        range. Returns the number of branches.
        """
        branches = [*self._branches(result, places)]
        self._follow_with_changes(self._from_branches(branches))
        return len(branches)

    def _from_branches(
        self, branches: Sequence[tuple[Line, TracedBranch]]
    ) -> list[Following[Begun]]:
        """Return the searches of boundaries at the special points of branches along lines."""
        return [
            self._from_special(branch, special, line)
            for line, branch in branches
            for special in branch.specials
            if special.kind != BRANCH_POINT
        ]

    def _branches(
        self, result: Result, places: Sequence[tuple[int, float]]
    ) -> Iterator[tuple[Line, TracedBranch]]:
        """Trace the branches along lines side by side, and yield each with its line."""
        lines, of_lines = self._lines(result, places)
        searches = list[tuple[BranchSearch, Finding[None]]]()
        for number, (line, of_line) in enumerate(zip(lines, of_lines, strict=True)):
            over = self.over.line(line, number, lines)
            search = BranchSearch(over, self.run, self.longest, APPROXIMATE, self.scale)
            across = known.axis_name(self.over.parameters[1 - line.number])
            searches.append((search, search.following(search.motions(of_line, across))))
        plan = self.run.plan
        pending = [(search.over.steps_of_maps(plan), one) for search, one in searches]
        self._traced_together(pending)
        for line, (search, _) in zip(lines, searches, strict=True):
            axis = known.axis_name(self.over.parameters[line.number])
            traced = count_of(len(search.found), "branch", "branches")
            say(f"{axis} = {line.value:.6g}: {traced}")
            for branch in search.found:
                yield line, branch

    def _lines(
        self, result: Result, places: Sequence[tuple[int, float]]
    ) -> tuple[list[Line], list[Result]]:
        """Return the lines of a map that are nearest to some places, and what it has on them.

        ``places``: see `along_lines`.
        """
        lines, of_lines = [], []
        for number, share in places:
            axis = known.axis_name(self.over.parameters[number])
            wanted = float(self.over.values(np.full(PARAMETERS, share))[number])
            of_line = result.sel("nearest", **{axis: wanted})
            # Where branches are traced, the line has exactly the value of its lanes.
            lines.append(self.over.whole(number, of_line.fixed[axis]))
            of_lines.append(of_line)
        return lines, of_lines

    def begin_with_changes(self, result: Result) -> None:
        """Find the changes of the motion between neighbouring cells of a map."""
        axes = [known.axis_name(one) for one in self.over.parameters]
        ends = np.array([self.over.low, self.over.high])
        impacts = [f"impacts_{side}_{element}" for element in self.run.elements for side in SIDES]
        if any(name not in result.variables for name in impacts):
            impacts = []
        found = changes_of(result, axes, ends, self.longest, impacts)
        long = found.period * self.run.lanes.repeats_after > LONGEST_GRAZING
        self.left = found.of((found.flank < 0) | ~long)
        say(f"{len(self.left.flank)} changes of the map")

    def from_changes(self) -> None:
        """Follow boundaries from changes of the map until those left lead to none."""
        before = -1
        while before < len(self.boundaries.found) and self.left.flank.size:
            check()
            before = len(self.boundaries.found)
            self._follow_with_changes([])

    def _follow_with_changes(self, searches: list[Following[Begun]]) -> None:
        """Follow boundaries through some points, and from changes that are beside none."""
        before, left = len(self.boundaries.found), self.left
        chosen = (
            left.spread(self.equations.fixed) if left.flank.size else np.zeros(0, dtype=np.intp)
        )
        leading = self._multipliers(left.of(chosen))
        jumps = (left.flank[chosen] == JUMP) | _double_elsewhere(left.flank[chosen], leading)
        jumping, changing = left.of(chosen[jumps]), left.of(chosen[~jumps])
        self.boundaries.follow(
            [
                *searches,
                *self._from_branches(self._across(jumping)),
                *self._from_changes(changing, leading[~jumps]),
            ]
        )
        open_still = np.ones(left.flank.size, dtype=bool)
        open_still[chosen] = False
        for one in self.boundaries.found[before:]:
            same = left.flank == one.equations.flank
            if one.equations.kind != GRAZING:
                same |= left.flank == JUMP
            if one.equations.kind == PERIOD_DOUBLING:
                same |= left.flank == DOUBLES
            open_still &= ~(same & (left.period == one.period) & left.beside(one.shares))
        self.left = left.of(open_still)

    def _across(self, jumps: Changes) -> list[tuple[Line, TracedBranch]]:
        """Trace the branch of each motion that jumps, across its cell and the next ones."""
        changes = [*jumps.each()]
        lines, searches = [self.over.across(one) for one in changes], []
        for number, (line, one) in enumerate(zip(lines, changes, strict=True)):
            over = self.over.line(line, number, lines)
            curve = over.curve(self.run.plan, one.period, self.scale)
            guess = np.append(one.state / self.scale, self.over.along(line, one.shares))
            searches.append((curve.plan.steps_per_period, _through(curve, guess)))
        traced = self._traced_together(searches)
        return [(line, one) for line, one in zip(lines, traced, strict=True) if one is not None]

    def _traced_together(self, searches: Sequence[tuple[int, Finding[Found]]]) -> list[Found]:
        """Return the results of searches along lines; those with equal steps share calls.

        Each has the number of steps per period that its curves take.
        """
        found: dict[int, Found] = {}
        for steps in sorted({one for one, _ in searches}):
            same = [at for at, (one, _) in enumerate(searches) if one == steps]
            results = run(together([searches[at][1] for at in same]), self._defects)
            found.update(zip(same, results, strict=True))
        return [found[at] for at in range(len(searches))]

    def _multipliers(self, changes: Changes) -> Complex:
        """Return the multipliers of the motions next to changes of a map, (changes, states).

        NaN where impacts change or the motion jumps: its multipliers are not needed.
        """
        found = np.full((changes.flank.size, self.scale.size), np.nan, dtype=np.complex128)
        (needed,) = np.nonzero((changes.flank == -1) | (changes.flank == DOUBLES))
        requests = [
            Passing(
                self.equations.of(one.period, FOLD),
                np.append(one.state / self.scale, one.shares),
            )
            for one in changes.of(needed).each()
        ]
        for number, passed in zip(needed.tolist(), self._answers(requests), strict=True):
            found[number] = passed.multipliers
        return found

    def _from_changes(self, changes: Changes, multipliers: Complex) -> list[Following[Begun]]:
        """Return the searches of boundaries next to changes of a map; see `_multipliers`."""
        return [
            self._from_change(one, kind)
            for one, values in zip(changes.each(), multipliers, strict=True)
            for kind in _kinds(one, values)
        ]

    def _from_change(self, change: MapChange, kind: str) -> Following[Begun]:
        """Search the point of a boundary next to a change of a map."""
        equations = self.equations.of(change.period, kind, change.flank)
        guess = np.append(change.state / self.scale, change.shares)
        return beginning(equations, guess, self.equations.along(change.number))

    def _from_special(self, branch: TracedBranch, special: Special, line: Line) -> Following[Begun]:
        """Search the point of a boundary at a special point of a branch."""
        equations = self.equations.of(branch.period, special.kind, special.flank)
        shares = self.over.shares(line, special.point.share)
        guess = np.concatenate([special.point.place[:-1], shares])
        return beginning(equations, guess, self.equations.along(line.number), special.point)


def _through(curve: Curve, guess: Floats) -> Finding[TracedBranch | None]:
    """Search the branch through a motion, if its orbit is found."""
    start = yield from curve.correcting(guess, along_the_way(guess.size - 1))
    if start is None or not 0.0 <= start.share <= 1.0:
        return None
    return (yield from tracing_branch(curve, start, located=APPROXIMATE))


def _double_elsewhere(flank: Integers, multipliers: Complex) -> Mask:
    """Return where the period doubles next to a motion whose leading multiplier is no negative one.

    The doubling lies further away than a corrected guess reaches: the branch is traced to it.
    ``flank``: see `MapChange`; ``multipliers``: (changes, states).
    """
    leading = multipliers[:, 0]
    elsewhere: Mask = (flank == DOUBLES) & ~((leading.imag == 0.0) & (leading.real < 0.0))
    return elsewhere


def _kinds(change: MapChange, values: Complex) -> list[str]:
    """Return the kinds of boundaries that may be near a motion with multipliers (states,)."""
    if change.flank >= 0:
        return [GRAZING]
    if not np.isfinite(values).all():
        return []
    leading = complex(values[0])
    found = [FOLD] if np.any((values.imag == 0.0) & (values.real > NEAR_FOLD)) else []
    if leading.imag:
        found.append(NEIMARK_SACKER)
    elif leading.real < 0.0:
        found.append(PERIOD_DOUBLING)
    return found
