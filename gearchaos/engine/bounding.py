"""The boundaries of a map: where its periodic orbits fold, double, turn or graze."""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import steps_taken

from gearchaos.arrays import Complex, Floats, Integers, Mask
from gearchaos.dynamics.arclength import Curve, CurvePoint, along_the_way, repeats_sooner
from gearchaos.dynamics.boundaries import Located, TracedBoundary, tracing, unstarted
from gearchaos.dynamics.boundary_equations import Equations, OnBoundary
from gearchaos.dynamics.boundary_passages import PARAMETERS, Following, Passing, passed_of
from gearchaos.dynamics.boundary_tests import Reference
from gearchaos.dynamics.branch_range import only_map_parameter
from gearchaos.dynamics.branches import Special, TracedBranch
from gearchaos.dynamics.branches import tracing as tracing_branch
from gearchaos.dynamics.curve_defects import Finding, defects_of
from gearchaos.dynamics.side_by_side import Found, counting, run, together
from gearchaos.engine.branching import BranchSearch, flank_name, require_range
from gearchaos.engine.kept import variables_of
from gearchaos.engine.map_changes import DOUBLES, JUMP, Changes, MapChange, changes_of
from gearchaos.engine.map_lines import Line, Ranges
from gearchaos.engine.method_choice import for_continuation
from gearchaos.engine.provenance import provenance
from gearchaos.engine.recomputing import computable
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.running import one_thread
from gearchaos.engine.running import run as compute
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.models import Configuration, swept_values
from gearchaos.outputs import names as known
from gearchaos.outputs.catalogue import SECTION_PART
from gearchaos.progress import count_of, progress, say
from gearchaos.records.boundary import (
    BOUNDARY_KINDS,
    GRAZING_FLIP,
    GRAZING_FOLD,
    GRAZING_NEIMARK_SACKER,
    RESONANCES,
    Boundary,
    BoundaryPoint,
)
from gearchaos.records.branch import (
    BRANCH_POINT,
    FOLD,
    GRAZING,
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

MEETING = {
    GRAZING_FOLD: FOLD,
    GRAZING_FLIP: PERIOD_DOUBLING,
    GRAZING_NEIMARK_SACKER: NEIMARK_SACKER,
}
"""The kind of the boundary that meets a grazing, by the kind of the point at which they meet."""

BESIDE_GRAZING = 1e-4
"""Distance from a grazing, in shares of the ranges, at which a curve that meets it is begun."""

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
                found = count_of(len(search.found), "boundary", "boundaries")
                say(f"{count_of(len(some), 'line')}: {traced}; {found}")
            search.from_changes()
        except KeyboardInterrupt as interrupt:
            interrupt.add_note(f"{searched} of {len(places)} lines were searched")
            if keep is not None and search.found:
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


class _Begun(NamedTuple):
    """The beginning of a boundary: the point that was found, from a guess or a special point."""

    equations: Equations
    start: OnBoundary | None
    guess: Floats = np.zeros(0)
    special: CurvePoint | None = None

    @property
    def within(self) -> bool:
        """Whether the point lies within both ranges."""
        shares = np.full(1, np.nan) if self.start is None else self.start.shares
        return bool(np.all((shares >= 0.0) & (shares <= 1.0)))

    @property
    def repeats_sooner(self) -> bool:
        """Whether the point is an orbit of a shorter period, whose boundaries are others."""
        if self.start is None:
            return False
        return repeats_sooner(self.start.section, self.equations.scale)


def _beginning(
    equations: Equations, guess: Floats, direction: Floats, special: CurvePoint | None = None
) -> Following[_Begun]:
    """Search the beginning of a boundary next to a guess, or to a special point of a branch."""
    start = yield from equations.beginning(guess, direction)
    return _Begun(equations, start, guess, special)


class _BoundarySearch:
    """The boundaries that are known so far.

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
        self.found: list[TracedBoundary] = []
        self.left: Changes
        self._answers, self._defects = counting(passed_of, count), counting(defects_of, count)
        period, states = result.lanes("period"), result.lanes("end_state")
        moving = states[np.isfinite(states).all(axis=1) & (period > 0) & (period <= longest)]
        if not moving.size:
            moving = np.ones((1, states.shape[1]))
        # One scale for all boundaries: that of one motion would be too small along the curve.
        self.scale = coordinate_scale(moving[np.newaxis])[0]

    def lines(self, count: int) -> list[tuple[int, float]]:
        """Return the lines across the map: the parameter that each has one value of, and its share.

        ``count``: number of lines in each direction. Along a parameter on which flow maps depend,
        they are made anew at every value, so that one line in the middle has to do.
        """
        counts = [count if self.fixed in (one, -1) else min(count, 1) for one in range(PARAMETERS)]
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
    ) -> list[Following["_Begun"]]:
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
        self.left = changes_of(result, axes, ends, self.longest, impacts)
        say(f"{len(self.left.flank)} changes of the map")

    def from_changes(self) -> None:
        """Follow boundaries from changes of the map until those left lead to none."""
        before = -1
        while before < len(self.found) and self.left.flank.size:
            check()
            before = len(self.found)
            self._follow_with_changes([])

    def _follow_with_changes(self, searches: list[Following["_Begun"]]) -> None:
        """Follow boundaries through some points, and from changes that are beside none."""
        before, left = len(self.found), self.left
        chosen = left.spread(self.fixed) if left.flank.size else np.zeros(0, dtype=np.intp)
        leading = self._multipliers(left.of(chosen))
        jumps = (left.flank[chosen] == JUMP) | _double_elsewhere(left.flank[chosen], leading)
        jumping, changing = left.of(chosen[jumps]), left.of(chosen[~jumps])
        self._follow(
            [
                *searches,
                *self._from_branches(self._across(jumping)),
                *self._from_changes(changing, leading[~jumps]),
            ]
        )
        open_still = np.ones(left.flank.size, dtype=bool)
        open_still[chosen] = False
        for one in self.found[before:]:
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
                self._equations(one.period, FOLD),
                np.append(one.state / self.scale, one.shares),
            )
            for one in changes.of(needed).each()
        ]
        for number, passed in zip(needed.tolist(), self._answers(requests), strict=True):
            found[number] = passed.multipliers
        return found

    def _from_changes(self, changes: Changes, multipliers: Complex) -> list[Following["_Begun"]]:
        """Return the searches of boundaries next to changes of a map; see `_multipliers`."""
        return [
            self._from_change(one, kind)
            for one, values in zip(changes.each(), multipliers, strict=True)
            for kind in _kinds(one, values)
        ]

    def _equations(self, period: int, kind: str, flank: int = -1) -> Equations:
        """Return the equations of a boundary."""
        usual, most = self.steps
        plan = self.run.plan._replace(steps_per_period=usual)
        plan = plan.over(period * self.run.lanes.repeats_after)
        plan = plan._replace(interpolated=self.interpolated)
        equations = Equations(self.over.system_at, plan, period, self.scale, kind, fixed=self.fixed)
        return equations.grazing(flank, most) if kind == GRAZING else equations

    def _from_change(self, change: MapChange, kind: str) -> Following["_Begun"]:
        """Search the point of a boundary next to a change of a map."""
        equations = self._equations(change.period, kind, change.flank)
        guess = np.append(change.state / self.scale, change.shares)
        return _beginning(equations, guess, self._along(change.number))

    def _from_special(
        self, branch: TracedBranch, special: Special, line: Line
    ) -> Following["_Begun"]:
        """Search the point of a boundary at a special point of a branch."""
        equations = self._equations(branch.period, special.kind, special.flank)
        shares = self.over.shares(line, special.point.share)
        guess = np.concatenate([special.point.place[:-1], shares])
        return _beginning(equations, guess, self._along(line.number), special.point)

    def _along(self, number: int) -> Floats:
        """Return the direction in which a parameter alone grows, (states + 2,)."""
        direction = np.zeros(self.scale.size + PARAMETERS)
        direction[self.scale.size + number] = 1.0
        return direction

    def _follow(self, searches: list[Following["_Begun"]]) -> None:
        """Follow the boundaries through points that lie on none that is known."""
        begun = run(together(searches), self._answers)
        new = self._unknown(begun)
        for one in begun:
            if one.start is None and one.special is not None:
                self.found.append(unstarted(one.equations, one.guess, one.special))
        before = len(self.found)
        turning = [one for one in new if one.equations.kind == NEIMARK_SACKER]
        self._trace([one for one in new if one.equations.kind != NEIMARK_SACKER])
        # Curves of pairs end at resonances, where several multipliers may meet: they start there.
        self._trace([*self._turning(self.found[before:]), *turning])
        meeting = run(together(self._meeting_grazings(self.found[before:])), self._answers)
        self._trace(self._unknown(meeting))

    def _trace(self, begun: list["_Begun"]) -> None:
        """Follow the boundaries through some points of each kind side by side."""
        starts: list[tuple[Equations, list[OnBoundary]]] = []
        for one in begun:
            same = [some for equations, some in starts if _alike(equations, one.equations)]
            if one.start is not None and same:
                same[0].append(one.start)
            elif one.start is not None:
                starts.append((one.equations, [one.start]))
        traced = run(together([tracing(*one) for one in starts]), self._answers)
        for boundary in (one for some in traced for one in some):
            # Orbits of longer periods are the same at each of their section points. Points crowd
            # next to grazings, so that the middle is that of the length.
            positions = boundary.positions
            middle = boundary.points[int(np.argmin(np.abs(positions - positions[-1] / 2.0)))]
            if not run(self._held(_Begun(boundary.equations, middle)), self._answers):
                self.found.append(boundary)

    def _unknown(self, begun: Sequence["_Begun"]) -> list["_Begun"]:
        """Return the points within both ranges that begin boundaries which are not known."""
        held = run(together([self._held(one) for one in begun]), self._answers)
        return [
            one
            for one, is_held in zip(begun, held, strict=True)
            if not is_held and one.within and not one.repeats_sooner
        ]

    def _held(self, begun: "_Begun") -> Following[bool]:
        """Search whether a point lies on a boundary that is known."""
        for one in self.found:
            if begun.start is None or not _alike(one.equations, begun.equations):
                continue
            if (yield from one.holding(begun.start)):
                return True
        return False

    def _turning(self, boundaries: list[TracedBoundary]) -> list["_Begun"]:
        """Return points of curves of pairs with the product 1, at resonances on boundaries."""
        found = []
        for boundary in boundaries:
            if boundary.equations.kind == NEIMARK_SACKER:
                continue
            turning = boundary.equations._replace(kind=NEIMARK_SACKER, flank=-1)
            for located in boundary.located:
                if located.kind not in RESONANCES:
                    continue
                point, pair = located.point, Reference(cosine=RESONANCES[located.kind])
                begun = _Begun(turning, turning.corrected(point.place, point.tangent, pair))
                if begun.start is not None and not self._passes(turning, begun.start):
                    found.append(begun)
        return found

    def _meeting_grazings(self, boundaries: list[TracedBoundary]) -> list[Following["_Begun"]]:
        """Return the searches of the curves that meet grazings, on both sides of these."""
        searches = []
        for boundary in boundaries:
            for located in boundary.located:
                if located.kind not in MEETING:
                    continue
                meeting = self._equations(boundary.period, MEETING[located.kind])
                place, tangent = located.point.place, located.point.tangent
                across = np.zeros_like(tangent)
                across[-PARAMETERS:] = -tangent[-1], tangent[-2]
                across /= np.linalg.norm(across)
                searches += [
                    _beginning(meeting, place + step * across, across)
                    for step in (-BESIDE_GRAZING, BESIDE_GRAZING)
                ]
        return searches

    def _passes(self, equations: Equations, start: OnBoundary) -> bool:
        """Whether a known boundary of the same kind passes by the beginning of another."""
        return any(
            _alike(one.equations, equations) and one.passes(start.place) for one in self.found
        )

    @cached_property
    def steps(self) -> tuple[int, int]:
        """The usual number of steps per period that the method takes, and the largest."""
        places = [np.array([[a, b]]) for a in (0.0, 0.3, 0.6, 1.0) for b in (0.0, 1.0)]
        taken = [steps_taken(self.over.system_at(one), self.run.plan) for one in places]
        return sorted(taken)[len(taken) // 2], max(taken)

    @cached_property
    def fixed(self) -> int:
        """The only parameter on which flow maps depend, -1 if they depend on both or on none."""
        depend = self.over.maps_depend(self.run.plan.method)
        return depend.index(True) if sum(depend) == 1 else -1

    @cached_property
    def interpolated(self) -> int:
        """The parameter between whose values flow maps are interpolated; see `Plan`."""
        if self.fixed < 0:
            return -1
        shares = np.full((2, PARAMETERS), 0.5)
        shares[1, self.fixed] = 0.75
        return only_map_parameter(self.over.system_at(shares))

    def described(self, result: Result) -> BoundarySet:
        """Return the boundaries as arrays with their descriptions."""
        run, config = self.run, self.over.config
        if config.integration.method != run.config.integration.method:
            config = config.integrated_by(run.config.integration.method)
        order = sorted(self.found, key=lambda one: (_rank(one.equations), one.ends[0]))
        sections = run.lanes.model.catalogue.variables((), {SECTION_PART: run.lanes.states})
        states = tuple(one for one in sections if one.name.startswith(known.SECTION))
        named = {one.name: one for one in variables_of(run)} | dict(result.variables)
        parameters = tuple(named[known.axis_name(one)] for one in self.over.parameters)
        facts = {
            "title": run.config.title,
            "model": run.config.kind,
            "effects": " ".join(run.config.scene.effects),
            "method": run.config.integration.method,
            "steps_per_period": run.plan.steps_per_period,
            "excitation_period": run.lanes.repeats_after,
            "longest_period": self.longest,
            **provenance(0.0),
            "configuration_resolved": config.resolved_toml(),
        }
        del facts["wall_time_seconds"]
        return BoundarySet(parameters, states, tuple(self._arrays(order)), facts)

    def _arrays(self, boundaries: list[TracedBoundary]) -> Iterator[Boundary]:
        """Yield traced boundaries as arrays."""
        for one in boundaries:
            states = one.equations.scale.size
            yield Boundary(
                one.equations.kind,
                one.equations.periods,
                flank_name(self.run, one.equations.flank),
                self.over.values(one.places[:, states:]),
                one.positions,
                np.array([at.section for at in one.points]),
                np.array([at.multipliers for at in one.points]),
                tuple(self._point(one, located) for located in one.located),
                one.ends,
            )

    def _point(self, boundary: TracedBoundary, located: Located) -> BoundaryPoint:
        """Return a point of codimension 2 as it is stored."""
        return BoundaryPoint(
            located.kind,
            self.over.values(located.point.shares),
            float(boundary.positions[located.number]),
            located.point.multipliers,
        )


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


def _alike(one: Equations, other: Equations) -> bool:
    """Whether two boundaries are of the same kind, period and flank."""
    return (one.kind, one.periods, one.flank) == (other.kind, other.periods, other.flank)


def _rank(equations: Equations) -> tuple[int, int, int]:
    """Return the order of a boundary in the file: by period, kind and flank."""
    return equations.periods, BOUNDARY_KINDS.index(equations.kind), equations.flank
