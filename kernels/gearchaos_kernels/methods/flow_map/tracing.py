"""Extremes, means and mean squares of the signals of eight lanes along a step.

A step without crossings is one smooth piece of every signal; crossings divide it. On a piece a
signal is a polynomial, whose terms follow from the maps. Its values at the Gauss-Lobatto points of
the piece give the integrals. Where the largest of them comes near the largest value so far, the
turning point beside it is searched by Halley's method. Smallest values are those of the negative
signal.
"""

from typing import Any, NamedTuple

from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.memory.rows import STRIDE, VECTOR, constants, rows
from gearchaos_kernels.memory.vector_code import FLAGS, INTEGER
from gearchaos_kernels.methods.flow_map.layout import (
    TERMS,
    MethodRows,
    layout,
    layout_of,
    method_rows,
    method_rows_of,
)
from gearchaos_kernels.methods.flow_map.quadrature import PLACES, POINTS, WEIGHTS
from gearchaos_kernels.methods.flow_map.vectors import _inputs, _on_branches, _Writer
from gearchaos_kernels.recorders.loads import SIGNAL_ROWS, accumulated_of

_TOGETHER = 3
"""Linear functions summed at once: 16 registers of four numbers hold all that they need."""

_ITERATIONS = 2
"""Steps of Halley's method, which triples the number of right digits."""

_NEAR = 0.1
"""Share of the range of the values by which a turning point may exceed the largest of them.

The maps of a step converge only if a step is shorter than about half a cycle of the motion. Between
two of the points a crest then exceeds the larger value by less than half of this share.
"""


class Accumulated(NamedTuple):
    """The rows in which the signals of a lane are accumulated."""

    first: int
    size: int


accumulated_rows = constants(
    lambda scene: Accumulated(accumulated_of(scene), SIGNAL_ROWS * layout_of(scene).signals)
)
"""`Accumulated` of a scene, as constants of compiled code."""


@scalar
def trace_block(memory, slots, maps, maps_at, scene):
    """Accumulate the signals of all lanes whose gaps stay on their branches in the step."""
    first = method_rows(scene).piece
    for slot in range(0, slots, VECTOR):
        for n in range(slot, slot + VECTOR):
            stays = True
            if scene.resolved is not None:
                stays = memory[rows(scene).suspect * STRIDE + n] == 0.0
            memory[first * STRIDE + n] = -1.0
            memory[(first + 1) * STRIDE + n] = 1.0 if stays else -1.0
        trace_step(memory, slot, maps, maps_at, scene)


@scalar
def trace_step(memory, slot, maps, maps_at, scene):
    """Accumulate the signals of eight lanes along a whole step, or not those with empty pieces.

    The maps give the values of the signals directly. Polynomials are needed near extremes only.
    """
    for signal in range(layout(scene).signals):
        compute_values(memory, slot, maps, maps_at + signal * layout(scene).columns * POINTS, scene)
        if add_values(memory, slot, signal, scene) != 0:
            raise_in_step(memory, slot, signal, maps, maps_at, scene)


@part
def raise_in_step(memory, slot, signal, maps, maps_at, scene):
    """Raise the extremes of a signal of eight lanes by its turning points in a whole step."""
    compute_signal(memory, slot, maps, maps_at + signal * layout(scene).columns * TERMS, scene)
    raise_extremes(memory, slot, signal, scene)


@part
def trace_piece(memory, slot, maps, maps_at, scene):
    """Accumulate the signals of eight lanes along a piece of a step; it may be empty."""
    for signal in range(layout(scene).signals):
        compute_signal(memory, slot, maps, maps_at + signal * layout(scene).columns * TERMS, scene)
        evaluate_signal(memory, slot, scene)
        if add_values(memory, slot, signal, scene) != 0:
            raise_extremes(memory, slot, signal, scene)


def _linear(first: str, row: str, count: int) -> Any:
    """Return an intrinsic that stores ``count`` linear functions of the factors of a map.

    ``first``: the field of `Layout` with the place of their coefficients; ``row``: the field of
    `MethodRows` with their first row.
    """

    @intrinsic
    def compute(_typing, memory, slot, maps, maps_at, scene):
        place = layout_of(scene.scene)
        begin, target = getattr(place, first), getattr(method_rows_of(scene.scene), row)

        def apply(w, vector, branch_maps, mask):
            inputs = w.rows(vector, _inputs(scene.scene))
            for some in range(0, count, _TOGETHER):
                sums = [None] * min(_TOGETHER, count - some)
                for column, given in enumerate(inputs):
                    at = begin + column * count + some
                    for number, total in enumerate(sums):
                        factor = w.spread(branch_maps, at + number)
                        sums[number] = w.multiply_add(factor, given, total)
                for number, total in enumerate(sums):
                    w.put(total, vector, target + some + number, mask)

        given = memory, types.intp, maps, types.intp, scene
        return types.void(*given), _on_branches(scene.scene, apply)

    return compute


compute_signal = _linear("signal", "terms", TERMS)
"""Store the terms of a signal of eight lanes along the step, without its constant part.

Arguments: memory, slot, maps, place of the maps of the step plus that of the signal, scene.
"""

compute_values = _linear("values", "values", POINTS)
"""Store its values at the points of a whole step, with the same arguments."""


@intrinsic
def evaluate_signal(_typing, memory, slot, scene):
    """Store the values of a signal of eight lanes at the points of a piece, from its terms."""
    place = method_rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        piece = _Piece(w, vector, place)
        terms = w.rows(vector, range(place.terms, place.terms + TERMS))
        for number, at in enumerate(piece.places()):
            w.store(value_of(w, terms, at), vector, (place.values + number) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, scene), generate


@intrinsic
def add_values(_typing, memory, slot, signal, scene):
    """Add a piece of a signal to its integrals, and its values at the points to its extremes.

    Returns the mask of those of eight lanes in which a turning point may exceed an extreme.
    """
    place, first = method_rows_of(scene.scene), accumulated_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector, rows, mean = _of_signal(w, arguments, place.means)
        piece = _Piece(w, vector, place)
        values = piece.values(mean)
        for row, more in enumerate(piece.integrals(values), first + 2):
            w.store(w.add(w.load(rows, row * STRIDE), more), rows, row * STRIDE)
        near = [
            piece.near(values, w.load(rows, row * STRIDE), way)
            for row, way in ((first, 1.0), (first + 1, -1.0))
        ]
        return builder.zext(w.bits(builder.or_(*near)), INTEGER)

    return types.intp(memory, types.intp, types.intp, scene), generate


@intrinsic
def raise_extremes(_typing, memory, slot, signal, scene):
    """Raise the extremes of a signal of eight lanes by its turning points on a piece."""
    place, first = method_rows_of(scene.scene), accumulated_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector, rows, mean = _of_signal(w, arguments, place.means)
        piece = _Piece(w, vector, place)
        for row, way in ((first, 1.0), (first + 1, -1.0)):
            piece.raise_extreme(rows, row, mean, way)
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, scene), generate


def _of_signal(w: _Writer, arguments: Any, means: int) -> tuple[Any, Any, Any]:
    """Return the addresses of eight lanes and of the rows of a signal, and its constant part.

    ``arguments``: memory, slot, signal; ``means``: the row of the first constant part.
    """
    vector = w.element(0, arguments[1])
    mean = w.load(w.moved(vector, arguments[2], STRIDE), means * STRIDE)
    return vector, w.moved(vector, arguments[2], STRIDE * SIGNAL_ROWS), mean


def value_of(w: _Writer, terms: list[Any], at: Any) -> Any:
    """Return the values of eight polynomials at a place of each."""
    # Even and odd terms are summed independently, so that they do not wait for each other.
    square = w.times(at, at)
    parts = []
    for first in (0, 1):
        total = terms[TERMS - 2 + first]
        for term in range(TERMS - 4 + first, -1, -2):
            total = w.multiply_add(total, square, terms[term])
        parts.append(total)
    return w.multiply_add(parts[1], at, parts[0])


class _Piece:
    """Generates the instructions for a signal of eight lanes, each on a piece of the step."""

    def __init__(self, writer: _Writer, vector: Any, place: MethodRows) -> None:
        self.w, self.vector, self.place = writer, vector, place
        self.begin, self.end = writer.rows(vector, (place.piece, place.piece + 1))
        half = writer.constant(0.5)
        self.middle = writer.times(half, writer.add(self.begin, self.end))
        self.half = writer.times(half, writer.add(self.end, writer.negative(self.begin)))
        self.there = writer.greater(self.end, self.begin)

    def places(self) -> list[Any]:
        """Return the points of the piece."""
        w = self.w
        inner = [w.multiply_add(self.half, w.constant(at), self.middle) for at in PLACES[1:-1]]
        return [self.begin, *inner, self.end]

    def values(self, mean: Any) -> list[Any]:
        """Return the values of the signal at the points, with its constant part."""
        rows = range(self.place.values, self.place.values + POINTS)
        return [self.w.add(value, mean) for value in self.w.rows(self.vector, rows)]

    def integrals(self, values: list[Any]) -> list[Any]:
        """Return six times the integrals of the signal and of its square, in steps."""
        w = self.w
        total, squares = None, None
        for value, weight in zip(values, WEIGHTS, strict=True):
            # A step has length 2 in s.
            share = w.times(value, w.constant(3.0 * weight))
            total = share if total is None else w.add(total, share)
            squares = w.multiply_add(share, value, squares)
        nothing = w.constant(0.0)
        return [w.choose(self.there, w.times(one, self.half), nothing) for one in (total, squares)]

    def near(self, values: list[Any], known: Any, way: float) -> Any:
        """Return the mask of the lanes in which the signal may exceed its largest value so far.

        With ``way`` -1 it may fall below its smallest one.
        """
        w, highest, lowest = self.w, values[0], values[0]
        for value in values[1:]:
            highest = w.choose(w.greater(value, highest), value, highest)
            lowest = w.choose(w.smaller(value, lowest), value, lowest)
        margin = w.times(w.add(highest, w.negative(lowest)), w.constant(_NEAR))
        if way > 0.0:
            higher = w.greater(w.add(highest, margin), known)
        else:
            higher = w.smaller(w.add(lowest, w.negative(margin)), known)
        return w.builder.and_(self.there, higher)

    def raise_extreme(self, rows: Any, row: int, mean: Any, way: float) -> None:
        """Store the largest value of the signal, or with ``way`` -1 the smallest, in a row."""
        w = self.w
        exceeds = w.greater if way > 0.0 else w.smaller
        values, places = self.values(mean), self.places()
        known = w.load(rows, row * STRIDE)
        near = self.near(values, known, way)
        with w.builder.if_then(w.any(near)):
            best, at = values[0], places[0]
            for value, place in zip(values[1:], places[1:], strict=True):
                higher = exceeds(value, best)
                best, at = w.choose(higher, value, best), w.choose(higher, place, at)
            terms = w.rows(self.vector, range(self.place.terms, self.place.terms + TERMS))
            turn = w.add(value_of(w, terms, self.turning_point(terms, at)), mean)
            best = w.choose(exceeds(turn, best), turn, best)
            raised = w.builder.and_(near, exceeds(best, known))
            w.store(w.choose(raised, best, known), rows, row * STRIDE)

    def turning_point(self, terms: list[Any], at: Any) -> Any:
        """Return the turning points of the polynomials near a place, or a place of the piece."""
        w = self.w
        for _ in range(_ITERATIONS):
            slope, bend, twist = _derivatives(w, terms, at)
            # Halley's method; bend and twist are a half and a sixth of their derivatives.
            double = w.times(bend, w.constant(2.0))
            below = w.add(
                w.times(double, double), w.negative(w.times(w.times(slope, twist), w.constant(3.0)))
            )
            step = w.builder.fdiv(w.times(slope, double), below, flags=FLAGS)
            at = w.add(at, w.negative(step))
            # A place that is not a number becomes the begin of the piece.
            at = w.choose(w.greater(at, self.begin), at, self.begin)
            at = w.choose(w.smaller(at, self.end), at, self.end)
        return at


def _derivatives(w: _Writer, terms: list[Any], at: Any) -> tuple[Any, Any, Any]:
    """Return the slope, half the second and a sixth of the third derivative at a place."""
    nothing = w.constant(0.0)
    value, slope, bend, twist = terms[TERMS - 1], nothing, nothing, nothing
    for term in range(TERMS - 2, -1, -1):
        twist = w.multiply_add(twist, at, bend)
        bend = w.multiply_add(bend, at, slope)
        slope = w.multiply_add(slope, at, value)
        if term:
            value = w.multiply_add(value, at, terms[term])
    return slope, bend, twist
