"""What a block of lanes holds, and which row holds which number.

A lane is one point of the batch. A block holds ``LANES`` of them, each in a *slot*, as a structure
of arrays: one flat array in which row r of a slot is element ``r * STRIDE + slot``. With one base
pointer and constant distances the compiler can prove that the loop over slots vectorises.

States are displacements and rates in turn, one row each, in the scaled coordinates of the model;
rates are displacements per step (h times d/d tau).
"""

from functools import cache
from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.scene import Scene, provider_of

VECTOR = 8
"""Lanes of one vector: a cache line of numbers, which the widest registers hold."""

LANES = 4 * VECTOR
"""Slots of one block: a few vectors wide, small enough for the first-level cache."""

STRIDE = LANES + 8
"""Distance between rows: no two rows fall on the same cache set at a distance of 4096 bytes."""


class State(NamedTuple):
    """Scaled displacements and rates of one lane, or those of its tangent vector."""

    position: Any
    rate: Any


class Branch(NamedTuple):
    """One linear piece of a clearance function, and the gaps between which it holds.

    There the deflection is ``engaged * gap - offset``.
    """

    engaged: float
    offset: float
    floor: float
    ceiling: float


BRANCH = len(Branch._fields)
"""Rows of one branch."""

STATE = 0
"""First row of the state."""


class Rows(NamedTuple):
    """First rows of what a block holds of a scene.

    Attributes
    ----------
    tangent : int
        Of the tangent vector; the state begins at row 0.
    state_before, tangent_before : int
        Of both as they were before the step, `before` rows further on.
    coefficients : int
        Of the lane's coefficients.
    branches : int
        Of the active branch of each element.
    suspect : int
        The elements that may have left their branches in a step: the sum of 2**element.
    growth : int
        Logarithm of the growth of the tangent vector since the period began.
    crossings : int
        Clearance boundaries crossed while recorded; then the smallest speed at one of them, then
        the steps with too many.
    model, method, recorders : int
        Of what each of them keeps for itself.
    total : int
        Number of rows.
    """

    tangent: int
    state_before: int
    tangent_before: int
    coefficients: int
    branches: int
    suspect: int
    growth: int
    crossings: int
    model: int
    method: int
    recorders: int
    total: int

    @property
    def before(self) -> int:
        """Distance from a row of state or tangent vector to that before the step."""
        return self.state_before


@cache
def rows_of(scene: Scene) -> Rows:
    """Return the first rows of what a block holds of a scene."""
    model = provider_of(scene.model)
    states = model.states(scene.model)
    elements = model.elements(scene.model)
    sizes = {
        "state": states,
        "tangent": states,
        "state_before": states,
        "tangent_before": states,
        "coefficients": len(model.lane._fields),
        "branches": BRANCH * elements,
        "suspect": 1,
        "growth": 1,
        "crossings": 3,
        "model": model.rows(scene.model),
        "method": provider_of(scene.method).rows(scene),
        "recorders": provider_of(scene.recorders).rows(scene),
    }
    first, at = {}, 0
    for name, size in sizes.items():
        first[name] = at
        at += size
    del first["state"]
    return Rows(**first, total=at)


def constants(record: Any) -> Any:
    """Return an intrinsic that gives a record of whole numbers which the scene decides."""

    @intrinsic
    def constant(_typing_context: Any, scene: Any) -> Any:
        numbers = record(scene.scene)
        kind = types.NamedUniTuple(types.intp, len(numbers), type(numbers))
        integer = ir.IntType(types.intp.bitwidth)

        def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            return context.make_tuple(builder, kind, [integer(number) for number in numbers])

        return kind(scene), generate

    return constant


rows = constants(rows_of)
"""The first rows of a scene, as constants of compiled code."""
