"""The layout of a block of lanes in memory: which row contains which number.

A lane is one point of the batch. A block contains up to ``LANES`` lanes, each in its *slot*. It is
a structure of arrays: in one flat array, row r of a slot is element ``r * STRIDE + slot``. With one
base pointer and constant distances, the compiler can prove that the loop over slots vectorises.

Displacements and rates of a state alternate, one row each, in the scaled coordinates of the model.
Rates are per step (h times d/d tau).
"""

from functools import cache
from itertools import accumulate
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
"""Distance between rows, such that rows are not a multiple of 4096 bytes apart (cache sets).

A method may use the slots beyond the lanes, see `Method.workspace`.
"""


class State(NamedTuple):
    """Scaled displacements and rates of one lane, or those of its tangent vector."""

    position: Any
    rate: Any


class ContactBranch(NamedTuple):
    """One linear piece of a clearance function: deflection = engaged * gap - offset.

    Attributes
    ----------
    engaged : float
        1 on a flank, 0 between the flanks.
    offset : float
        The gap at which the flank is met, with its sign; 0 between the flanks.
    floor, ceiling : float
        The gaps between which the piece is valid.
    """

    engaged: float
    offset: float
    floor: float
    ceiling: float


BRANCH = len(ContactBranch._fields)
"""Rows of one branch."""

STATE = 0
"""First row of the state."""


class Rows(NamedTuple):
    """First rows of the parts of a block.

    Attributes
    ----------
    tangent : int
        Tangent vector; the state begins at row 0.
    state_before, tangent_before : int
        State and tangent vector before the step, each `before` rows further.
    coefficients : int
        Coefficients of the lane.
    branches : int
        Active branch of each element, `BRANCH` rows each.
    suspect : int
        Sum of 2**element over the elements that may have left their branches in the step.
    growth : int
        Logarithm of the growth of the tangent vector since the beginning of the mesh period.
    crossings : int
        Number of recorded crossings, the smallest speed at one of them, and the number of steps
        with more than `MOST_CROSSINGS`.
    model, method, recorders, control : int
        Rows that the model, the method, the recorders and a controller use for themselves.
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
    control: int
    total: int

    @property
    def before(self) -> int:
        """Distance from a row of state or tangent vector to its value before the step."""
        return self.state_before


class ControlRows(NamedTuple):
    """First rows of what a controller stores of every lane.

    Attributes
    ----------
    varied : int
        Variation of the input along the tangent vector, scaled as the steady input of a lane.
    known, known_varied : int
        What the controller knows of the state of every lane, and the same of the tangent vector,
        as lines: that of slot s begins with number s * line. An estimate stays there.
    earlier, earlier_varied : int
        States of earlier mesh periods for a delayed feedback, and their variation.
    end : int
        The row after the last one.
    delay : int
        Mesh periods of a delayed feedback.
    states : int
        Number of states: a constant, so that loops over it are unrolled.
    line : int
        Numbers from one line to the next, see `line_of`.
    """

    varied: int
    known: int
    known_varied: int
    earlier: int
    earlier_varied: int
    end: int
    delay: int
    states: int
    line: int


def line_of(states: int) -> int:
    """Return the length of a line: the states of a lane side by side, filled up to vectors."""
    return -(-states // VECTOR) * VECTOR


def control_rows_of(scene: Scene) -> ControlRows:
    """Return the rows that a controller uses in a block."""
    first = accumulate(_control_sizes(scene), initial=rows_of(scene).control)
    delay, states = scene.feedback.delay, scene.feedback.states
    return ControlRows._make([*first, delay, states, line_of(states)])


def _control_sizes(scene: Scene) -> list[int]:
    """Return the number of rows of each part of what a controller stores."""
    if scene.control is None:
        return []
    line = line_of(scene.feedback.states)
    lines = -(-LANES * line // STRIDE)
    earlier = scene.feedback.delay * scene.feedback.states
    return [1, lines, lines, earlier, earlier]


@cache
def rows_of(scene: Scene) -> Rows:
    """Return the first rows of the parts of a block of a scene."""
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
        "control": sum(_control_sizes(scene)),
    }
    first, at = {}, 0
    for name, size in sizes.items():
        first[name] = at
        at += size
    del first["state"]
    return Rows(**first, total=at)


def constants(record: Any) -> Any:
    """Return an intrinsic that returns a record of integers that depend on the scene only."""

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
"""`Rows` of a scene, as constants of compiled code."""

control_rows = constants(control_rows_of)
"""`ControlRows` of a scene, as constants of compiled code."""
