"""Branches of periodic orbits over a parameter, as they are computed, stored and drawn."""

from collections.abc import Mapping
from math import prod
from typing import Any, NamedTuple

from gearchaos.arrays import Complex, Floats, Mask

FOLD, BRANCH_POINT = "fold", "branch point"
PERIOD_DOUBLING, NEIMARK_SACKER = "period doubling", "Neimark-Sacker"
GRAZING = "grazing"
SPECIAL_KINDS = (FOLD, BRANCH_POINT, PERIOD_DOUBLING, NEIMARK_SACKER, GRAZING)
"""Kinds of special points of a branch."""

MEANINGS = {
    FOLD: "two orbits meet and end, and the branch turns back",
    BRANCH_POINT: "another branch of the same period crosses",
    PERIOD_DOUBLING: "a multiplier passes -1, and a branch of twice the period begins",
    NEIMARK_SACKER: "a complex pair of multipliers passes the unit circle, and quasi-periodic "
    "motions begin",
    GRAZING: "the orbit touches a flank with zero speed, so that it gains or loses a contact",
}
"""Event at each kind of special point."""

EDGE, CLOSED_CURVE = "edge of the range", "closes on itself"
HALVING = "meets the orbit of half its period"
TOO_MANY = "too many points"
LOST = "no orbit found however short the step"
IN_ERRORS = "lost in the errors of the method: take shorter steps, or flow maps"
GROWS = "grows to 100 times the scale of its states"
BRANCH_ENDS = (EDGE, CLOSED_CURVE, HALVING, TOO_MANY, LOST, IN_ERRORS, GROWS)
"""Reasons why a branch ends."""

STEPPED = "rk4"
"""The method whose orbits depend on its steps."""


LONGEST_GRAZING = 100
"""Most mesh periods of an orbit whose grazings are looked for.

Longer ones, as of teeth with errors of their own, graze a flank at nearly every value.
"""


def notes_of(metadata: Mapping[str, Any]) -> list[str]:
    """Return the notes below a table of special points.

    ``metadata``: that of the branches or boundaries, with ``method``, ``steps_per_period``,
    ``excitation_period`` and ``longest_period``.
    """
    notes = []
    longest = (int(metadata.get(name, 1)) for name in ("excitation_period", "longest_period"))
    if prod(longest) > LONGEST_GRAZING:
        notes.append(
            f"grazings of orbits of more than {LONGEST_GRAZING} mesh periods are not looked for: "
            "such orbits graze a flank at nearly every value"
        )
    if metadata.get("method") == STEPPED:
        steps = int(metadata["steps_per_period"])
        notes.append(
            f"these are orbits of RK4 with {steps} steps per period; near grazings the last "
            "printed digits are not reliable: compare with integration.steps_per_period = "
            f"{2 * steps}"
        )
    return notes


class SpecialPoint(NamedTuple):
    """A special point of a branch.

    Attributes
    ----------
    kind : str
        One of `SPECIAL_KINDS`.
    value : float
        Value of the parameter.
    arclength : float
        Where it lies on the branch.
    section : array, shape (period, states)
        Section points of the orbit, dimensionless; the last one is the state at mesh phase 0.
    multipliers : array of complex, shape (states,)
        Floquet multipliers, largest modulus first.
    flank : str
        For a grazing, the element and the flank that it begins or ceases to meet; else empty.
    """

    kind: str
    value: float
    arclength: float
    section: Floats
    multipliers: Complex
    flank: str = ""


class PeriodicBranch(NamedTuple):
    """A branch of periodic orbits of one period, stable and unstable.

    Attributes
    ----------
    period : int
        Period in excitation periods.
    value : array, shape (points,)
        Values of the parameter, in the order of the branch.
    arclength : array, shape (points,)
        Length of the branch up to each point: states relative to the largest ones of the sweep,
        the parameter relative to its range.
    section : array, shape (points, period, states)
        Section points of each orbit, dimensionless; the last one is the state at mesh phase 0.
    multipliers : array of complex, shape (points, states)
        Floquet multipliers, largest modulus first.
    exponent : array, shape (points,)
        Largest Lyapunov exponent of each orbit, per unit of tau.
    specials : tuple of SpecialPoint
        Its special points, in the order of the branch.
    ends : tuple of str
        Why it ends at its first and at its last point, each one of `BRANCH_ENDS`.
    quantities : dict of str to array, shape (points,)
        Contact and loads of each orbit, by the name of the output.
    """

    period: int
    value: Floats
    arclength: Floats
    section: Floats
    multipliers: Complex
    exponent: Floats
    specials: tuple[SpecialPoint, ...]
    ends: tuple[str, str]
    quantities: dict[str, Floats]

    @property
    def stable(self) -> Mask:
        """Whether all multipliers of an orbit lie inside the unit circle, (points,)."""
        inside: Mask = abs(self.multipliers[:, 0]) < 1.0
        return inside
