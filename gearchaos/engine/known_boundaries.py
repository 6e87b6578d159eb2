"""The boundaries of a map that have been followed, and those that begin at them."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.dynamics.arclength import CurvePoint, repeats_sooner
from gearchaos.dynamics.boundaries import TracedBoundary, tracing, unstarted
from gearchaos.dynamics.boundary_equations import Equations, OnBoundary
from gearchaos.dynamics.boundary_passages import PARAMETERS, Following, Passed, Passing
from gearchaos.dynamics.boundary_tests import Reference
from gearchaos.dynamics.side_by_side import run, together
from gearchaos.engine.map_equations import MapEquations
from gearchaos.progress import count_of
from gearchaos.records.boundary import (
    GRAZING_FLIP,
    GRAZING_FOLD,
    GRAZING_NEIMARK_SACKER,
    RESONANCES,
)
from gearchaos.records.branch import FOLD, NEIMARK_SACKER, PERIOD_DOUBLING

Answers: TypeAlias = Callable[[Sequence[Passing]], Sequence[Passed]]
"""Returns the orbits that are requested."""

MEETING = {
    GRAZING_FOLD: FOLD,
    GRAZING_FLIP: PERIOD_DOUBLING,
    GRAZING_NEIMARK_SACKER: NEIMARK_SACKER,
}
"""The kind of the boundary that meets a grazing, by the kind of the point at which they meet."""

BESIDE_GRAZING = 1e-4
"""Distance from a grazing, in shares of the ranges, at which a curve that meets it is begun."""


class Begun(NamedTuple):
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


def beginning(
    equations: Equations, guess: Floats, direction: Floats, special: CurvePoint | None = None
) -> Following[Begun]:
    """Search the beginning of a boundary next to a guess, or to a special point of a branch."""
    start = yield from equations.beginning(guess, direction)
    return Begun(equations, start, guess, special)


class KnownBoundaries:
    """The boundaries that are known so far.

    ``equations`` are those of all boundaries of the map; ``answers`` returns the orbits that
    searches request.
    """

    def __init__(self, equations: MapEquations, answers: Answers) -> None:
        self.equations, self.answers = equations, answers
        self.found: list[TracedBoundary] = []

    @property
    def counted(self) -> str:
        """The number of boundaries in words."""
        return count_of(len(self.found), "boundary", "boundaries")

    def follow(self, searches: list[Following[Begun]]) -> None:
        """Follow the boundaries through points that lie on none that is known."""
        begun = run(together(searches), self.answers)
        new = self._unknown(begun)
        for one in begun:
            if one.start is None and one.special is not None and not self._is_at(one):
                self.found.append(unstarted(one.equations, one.guess, one.special))
        before = len(self.found)
        turning = [one for one in new if one.equations.kind == NEIMARK_SACKER]
        self._trace([one for one in new if one.equations.kind != NEIMARK_SACKER])
        # Curves of pairs end at resonances, where several multipliers may meet: they start there.
        self._trace([*self._turning(self.found[before:]), *turning])
        meeting = run(together(self._meeting_grazings(self.found[before:])), self.answers)
        self._trace(self._unknown(meeting))

    def _trace(self, begun: list[Begun]) -> None:
        """Follow the boundaries through some points of each kind side by side."""
        starts: list[tuple[Equations, list[OnBoundary]]] = []
        for one in begun:
            same = [some for equations, some in starts if _alike(equations, one.equations)]
            if one.start is not None and same:
                same[0].append(one.start)
            elif one.start is not None:
                starts.append((one.equations, [one.start]))
        traced = run(together([tracing(*one) for one in starts]), self.answers)
        for boundary in (one for some in traced for one in some):
            # Orbits of longer periods are the same at each of their section points. Points crowd
            # next to grazings, so that the middle is that of the length.
            positions = boundary.positions
            middle = boundary.points[int(np.argmin(np.abs(positions - positions[-1] / 2.0)))]
            if not run(self._held(Begun(boundary.equations, middle)), self.answers):
                self.found.append(boundary)

    def _unknown(self, begun: Sequence[Begun]) -> list[Begun]:
        """Return the points within both ranges that begin boundaries which are not known."""
        held = run(together([self._held(one) for one in begun]), self.answers)
        return [
            one
            for one, is_held in zip(begun, held, strict=True)
            if not is_held and one.within and not one.repeats_sooner
        ]

    def _held(self, begun: Begun) -> Following[bool]:
        """Search whether a point lies on a boundary that is known."""
        for one in self.found:
            if begun.start is None or not _alike(one.equations, begun.equations):
                continue
            if (yield from one.holding(begun.start)):
                return True
        return False

    def _is_at(self, begun: Begun) -> bool:
        """Whether the special point of a branch is the only point of a known boundary."""
        return any(
            one.is_at(begun.guess) and _alike(one.equations, begun.equations) for one in self.found
        )

    def _turning(self, boundaries: list[TracedBoundary]) -> list[Begun]:
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
                begun = Begun(turning, turning.corrected(point.place, point.tangent, pair))
                if begun.start is not None and not self._passes(turning, begun.start):
                    found.append(begun)
        return found

    def _meeting_grazings(self, boundaries: list[TracedBoundary]) -> list[Following[Begun]]:
        """Return the searches of the curves that meet grazings, on both sides of these."""
        searches = []
        for boundary in boundaries:
            for located in boundary.located:
                if located.kind not in MEETING:
                    continue
                meeting = self.equations.of(boundary.period, MEETING[located.kind])
                place, tangent = located.point.place, located.point.tangent
                across = np.zeros_like(tangent)
                across[-PARAMETERS:] = -tangent[-1], tangent[-2]
                across /= np.linalg.norm(across)
                searches += [
                    beginning(meeting, place + step * across, across)
                    for step in (-BESIDE_GRAZING, BESIDE_GRAZING)
                ]
        return searches

    def _passes(self, equations: Equations, start: OnBoundary) -> bool:
        """Whether a known boundary of the same kind passes by the beginning of another."""
        return any(
            _alike(one.equations, equations) and one.passes(start.place) for one in self.found
        )


def _alike(one: Equations, other: Equations) -> bool:
    """Whether two boundaries are of the same kind, period and flank."""
    return (one.kind, one.periods, one.flank) == (other.kind, other.periods, other.flank)
