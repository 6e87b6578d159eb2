"""The boundaries of a map: where its periodic orbits fold, double, turn or graze."""

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem, steps_taken

from gearchaos.arrays import Floats
from gearchaos.dynamics.boundaries import Located, TracedBoundary, trace_boundary, unstarted
from gearchaos.dynamics.boundary_equations import (
    PARAMETERS,
    Equations,
    OnBoundary,
    Reference,
)
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.dynamics.branches import Special, TracedBranch
from gearchaos.engine.branching import BranchSearch, flank_name
from gearchaos.engine.kept import variables_of
from gearchaos.engine.method_choice import for_continuation
from gearchaos.engine.provenance import provenance
from gearchaos.engine.recomputing import computable
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.running import one_thread, run
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.models import Configuration, swept_values
from gearchaos.models.registry import system_of
from gearchaos.outputs import names as known
from gearchaos.outputs.catalogue import SECTION_PART
from gearchaos.progress import progress, say
from gearchaos.records.boundary import BOUNDARY_KINDS, RESONANCES, Boundary, BoundaryPoint
from gearchaos.records.branch import BRANCH_POINT, GRAZING, NEIMARK_SACKER
from gearchaos.records.period import coordinate_scale
from gearchaos.results.files.boundary_file import BoundarySet
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import require_labels

LINES, PERIODS = 4, 1
"""Default of the lines across the map, and of the longest period."""

COARSE = 24
"""Values of each parameter of the map that is computed from a configuration."""

APPROXIMATE = 1e-4
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
        special points of these are the starts of boundaries.
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
    over = _Ranges.of(config)
    search = _BoundarySearch(
        over, plan_run(for_continuation(_small(config, PARAMETERS))), longest, result
    )
    places = [
        (number, float(share))
        for number in search.axes_of_lines()
        for share in (np.arange(lines) + 0.5) / lines
    ]
    with one_thread(), progress(len(places), unit="lines") as bar:
        try:
            for number, share in places:
                check()
                search.along_line(result, number, share)
                bar.update()
        except KeyboardInterrupt as interrupt:
            interrupt.add_note(f"{bar.n} of {len(places)} lines were searched")
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
    return run(_small(config, COARSE))


def _small(config: Configuration, count: int) -> Configuration:
    """Return a configuration with few values of its parameters over the same ranges."""
    for key, sweep in config.sweeps.items():
        values = swept_values(sweep)
        if values.size > count:
            chosen = np.linspace(values[0], values[-1], count).tolist()
            config = config.replace(key, {"parameter": sweep.parameter, "values": chosen})
    return config


class _Ranges(NamedTuple):
    """The ranges of both parameters: their names, and the lowest and the highest values."""

    config: Configuration
    parameters: tuple[str, ...]
    low: Floats
    high: Floats

    @classmethod
    def of(cls, config: Configuration) -> "_Ranges":
        """Return the ranges of the sweeps of a configuration."""
        values = [swept_values(sweep) for sweep in config.sweeps.values()]
        names = tuple(sweep.parameter for sweep in config.sweeps.values())
        low, high = (np.array([one[at] for one in values]) for at in (0, -1))
        return cls(config, names, low, high)

    def values(self, shares: Floats) -> Floats:
        """Return the values of both parameters at shares of the ranges, (..., 2)."""
        values: Floats = self.low + shares * (self.high - self.low)
        return values

    def system_at(self, shares: Floats) -> LaneSystem:
        """Return the systems of lanes at shares of both ranges, (lanes, 2)."""
        columns = dict(zip(self.parameters, self.values(shares).T, strict=True))
        return system_of(self.config, columns, self.config.needed_effects)

    def line(self, number: int, value: float) -> BranchRange:
        """Return the range of the other parameter where parameter ``number`` has a value."""
        name, other = self.parameters[number], self.parameters[1 - number]

        def systems(at: Floats) -> LaneSystem:
            values = {other: at, name: np.full(at.size, value)}
            return system_of(self.config, values, self.config.needed_effects)

        return BranchRange(systems, float(self.low[1 - number]), float(self.high[1 - number]))


class _BoundarySearch:
    """The boundaries that are known so far; ``result`` gives the scales of the states."""

    def __init__(self, over: _Ranges, run: RunPlan, longest: int, result: Result) -> None:
        self.over, self.run, self.longest = over, run, longest
        self.found: list[TracedBoundary] = []
        period, states = result.lanes("period"), result.lanes("end_state")
        moving = states[np.isfinite(states).all(axis=1) & (period > 0) & (period <= longest)]
        if not moving.size:
            moving = np.ones((1, states.shape[1]))
        # One scale for all boundaries: that of one motion would be too small along the curve.
        self.scale = coordinate_scale(moving[np.newaxis])[0]

    def axes_of_lines(self) -> list[int]:
        """Return the parameters that lines are drawn at: all, or those on which maps depend.

        Flow maps are made anew at every value of such a parameter.
        """
        return [*range(PARAMETERS)] if self.fixed < 0 else [self.fixed]

    def along_line(self, result: Result, number: int, share: float) -> None:
        """Trace the branches along a line at one value of a parameter, and follow boundaries."""
        axis = known.axis_name(self.over.parameters[number])
        wanted = float(self.over.values(np.full(PARAMETERS, share))[number])
        line = result.sel("nearest", **{axis: wanted})
        value = line.fixed[axis]
        # Where branches are traced, the line has exactly the value of its lanes.
        ends = self.over.low[number], self.over.high[number]
        place = (value - ends[0]) / (ends[1] - ends[0])
        branches = BranchSearch(
            self.over.line(number, value), self.run, self.longest, APPROXIMATE, self.scale
        )
        across = known.axis_name(self.over.parameters[1 - number])
        branches.follow(branches.motions(line, across))
        for branch in branches.found:
            for special in branch.specials:
                check()
                self._follow(branch, special, number, place)
        say(f"{axis} = {value:.6g}: {len(branches.found)} branches; {len(self.found)} boundaries")

    def _follow(self, branch: TracedBranch, special: Special, number: int, place: float) -> None:
        """Follow the boundary through a special point of a branch, unless it is known."""
        if special.kind == BRANCH_POINT:
            return
        usual, most = self.steps
        plan = branch.curve.plan._replace(contact=False, steps_per_period=usual)
        equations = Equations(
            self.over.system_at, plan, branch.period, self.scale, special.kind, fixed=self.fixed
        )
        if special.kind == GRAZING:
            equations = equations.grazing(special.flank, most)
        states, direction = self.scale.size, np.zeros(self.scale.size + PARAMETERS)
        direction[states + number] = 1.0
        shares = np.full(PARAMETERS, special.point.share)
        shares[number] = place
        guess = np.concatenate([special.point.place[:-1], shares])
        start = equations.begun(guess, direction)
        if start is None:
            self.found.append(unstarted(equations, guess, special.point))
            return
        self._add(equations, start)

    def _add(self, equations: Equations, start: OnBoundary) -> None:
        """Follow the boundary through a point, unless it is known, and what begins on it."""
        if any(_alike(one.equations, equations) and one.holds(start) for one in self.found):
            return
        boundary = trace_boundary(equations, start)
        self.found.append(boundary)
        if equations.kind == NEIMARK_SACKER:
            return
        turning = equations._replace(kind=NEIMARK_SACKER, flank=-1)
        for located in boundary.located:
            check()
            if located.kind in RESONANCES:
                # The curve of pairs with the product 1 passes through the resonance.
                point, pair = located.point, Reference(cosine=RESONANCES[located.kind])
                begun = turning.corrected(point.place, point.tangent, pair)
                if begun is not None and not self._passes(turning, begun):
                    self._add(turning, begun)

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
        sharing = METHODS[self.run.plan.method].sharing
        depends = []
        for number in range(PARAMETERS):
            shares = np.full((2, PARAMETERS), 0.5)
            shares[1, number] = 0.75
            depends.append(np.unique(sharing(self.over.system_at(shares))).size > 1)
        return depends.index(True) if sum(depends) == 1 else -1

    def described(self, result: Result) -> BoundarySet:
        """Return the boundaries as arrays with their descriptions."""
        run = self.run
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
            "configuration_resolved": self.over.config.resolved_toml(),
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


def _alike(one: Equations, other: Equations) -> bool:
    """Whether two boundaries are of the same kind, period and flank."""
    return (one.kind, one.periods, one.flank) == (other.kind, other.periods, other.flank)


def _rank(equations: Equations) -> tuple[int, int, int]:
    """Return the order of a boundary in the file: by period, kind and flank."""
    return equations.periods, BOUNDARY_KINDS.index(equations.kind), equations.flank
