"""Extremes, means and mean squares of the signals of eight lanes along a step.

A step without crossings is one smooth piece of every signal; crossings divide it. On a piece a
signal is a polynomial, whose terms follow from the maps. Its values at the Gauss-Lobatto points of
the piece give the integrals. Where the largest of them comes near the largest value so far, the
turning point beside it is searched by Halley's method. Smallest values are those of the negative
signal.
"""

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import part, scalar
from gearchaos_kernels.memory.rows import STRIDE, VECTOR, constants, rows
from gearchaos_kernels.memory.vector_code import FLAGS
from gearchaos_kernels.methods.flow_map.layout import (
    TERMS,
    layout,
    layout_of,
    method_rows,
    method_rows_of,
)
from gearchaos_kernels.methods.flow_map.vectors import _inputs, _on_branches, _Writer
from gearchaos_kernels.recorders.loads import SIGNAL_ROWS, accumulated_of

_POINTS = 9
"""Number of Gauss-Lobatto points. The rule is exact up to the last term of a signal."""

_ITERATIONS = 2
"""Steps of Halley's method, which triples the number of right digits."""

_NEAR = 0.1
"""Share of the range of the values by which a turning point may exceed the largest of them.

The maps of a step converge only if a step is shorter than about half a cycle of the motion. Between
two of the points a crest then exceeds the larger value by less than half of this share.
"""


def _gauss_lobatto(count: int) -> tuple[list[float], list[float]]:
    """Return points and weights of the Gauss-Lobatto rule from -1 to 1."""
    last = np.polynomial.legendre.Legendre.basis(count - 1)
    points = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    weights = 2.0 / (count * (count - 1) * last(points) ** 2)
    return points.tolist(), weights.tolist()


_PLACES, _WEIGHTS = _gauss_lobatto(_POINTS)


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
        trace_piece(memory, slot, maps, maps_at, scene)


@part
def trace_piece(memory, slot, maps, maps_at, scene):
    """Accumulate the signals of eight lanes along a piece of a step; it may be empty."""
    for signal in range(layout(scene).signals):
        compute_signal(memory, slot, maps, maps_at + signal * layout(scene).columns * TERMS, scene)
        add_piece(memory, slot, signal, scene)


@intrinsic
def compute_signal(_typing, memory, slot, maps, maps_at, scene):
    """Store the terms of a signal of eight lanes along the step, without its constant part."""
    place, first = layout_of(scene.scene), method_rows_of(scene.scene).terms

    def apply(w, vector, branch_maps, mask):
        inputs = w.rows(vector, _inputs(scene.scene))
        for term in range(TERMS):
            factors = [
                (column, w.spread(branch_maps, place.signal + column * TERMS + term))
                for column in range(place.columns)
            ]
            w.put(w.sum(factors, inputs), vector, first + term, mask)

    given = memory, types.intp, maps, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def add_piece(_typing, memory, slot, signal, scene):
    """Accumulate a signal of eight lanes along a piece, whose terms have been stored."""
    place = method_rows_of(scene.scene)
    first = accumulated_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        vector = w.element(0, arguments[1])
        stride = ir.Constant(arguments[2].type, STRIDE)
        mean = builder.gep(vector, [builder.mul(arguments[2], stride)])
        signal_rows = ir.Constant(arguments[2].type, STRIDE * SIGNAL_ROWS)
        rows = builder.gep(vector, [builder.mul(arguments[2], signal_rows)])
        terms = w.rows(vector, range(place.terms, place.terms + TERMS))
        terms[0] = w.add(terms[0], w.load(mean, place.means * STRIDE))
        begin, end = w.rows(vector, (place.piece, place.piece + 1))
        piece = _Piece(w, terms, begin, end)
        values = [piece.value(at) for at in piece.places]
        for row, more in enumerate(piece.integrals(values), first + 2):
            w.store(w.add(w.load(rows, row * STRIDE), more), rows, row * STRIDE)
        for row, way in ((first, 1.0), (first + 1, -1.0)):
            piece.raise_extreme(rows, row, values, way)
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, scene), generate


class _Piece:
    """Generates the instructions for the polynomials of eight lanes on a piece each."""

    def __init__(self, writer: _Writer, terms: list, begin: object, end: object) -> None:
        self.w, self.terms, self.begin, self.end = writer, terms, begin, end
        half = writer.constant(0.5)
        middle = writer.times(half, writer.add(begin, end))
        self.half = writer.times(half, writer.add(end, writer.negative(begin)))
        self.there = writer.greater(end, begin)
        inner = [
            writer.multiply_add(self.half, writer.constant(place), middle)
            for place in _PLACES[1:-1]
        ]
        self.places = [begin, *inner, end]

    def value(self, at: object) -> object:
        """Return the polynomials at a place of each lane."""
        # Even and odd terms are summed independently, so that they do not wait for each other.
        square = self.w.times(at, at)
        parts = []
        for first in (0, 1):
            total = self.terms[TERMS - 2 + first]
            for term in range(TERMS - 4 + first, -1, -2):
                total = self.w.multiply_add(total, square, self.terms[term])
            parts.append(total)
        return self.w.multiply_add(parts[1], at, parts[0])

    def integrals(self, values: list) -> list:
        """Return six times the integrals of the polynomials and of their squares, in steps."""
        w = self.w
        total, squares = None, None
        for value, weight in zip(values, _WEIGHTS, strict=True):
            # A step has length 2 in s.
            share = w.times(value, w.constant(3.0 * weight))
            total = share if total is None else w.add(total, share)
            squares = w.multiply_add(share, value, squares)
        nothing = w.constant(0.0)
        return [w.choose(self.there, w.times(one, self.half), nothing) for one in (total, squares)]

    def raise_extreme(self, rows: object, row: int, values: list, way: float) -> None:
        """Store the largest value of the polynomials, or with ``way`` -1 the smallest, in a row."""
        w, builder = self.w, self.w.builder
        exceeds = w.greater if way > 0.0 else w.smaller
        best, at, worst = values[0], self.places[0], values[0]
        for value, place in zip(values[1:], self.places[1:], strict=True):
            higher = exceeds(value, best)
            best, at = w.choose(higher, value, best), w.choose(higher, place, at)
            worst = w.choose(exceeds(worst, value), value, worst)
        known = w.load(rows, row * STRIDE)
        reach = w.multiply_add(w.add(best, w.negative(worst)), w.constant(_NEAR), best)
        near = builder.and_(self.there, exceeds(reach, known))
        bits = builder.bitcast(near, ir.IntType(VECTOR))
        with builder.if_then(builder.icmp_unsigned("!=", bits, bits.type(0)), likely=False):
            turn = self.value(self.turning_point(at))
            best = w.choose(exceeds(turn, best), turn, best)
            raised = builder.and_(near, exceeds(best, known))
            w.store(w.choose(raised, best, known), rows, row * STRIDE)

    def turning_point(self, at: object) -> object:
        """Return the turning points of the polynomials near a place, or a place of the piece."""
        w = self.w
        for _ in range(_ITERATIONS):
            slope, bend, twist = self.derivatives(at)
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

    def derivatives(self, at: object) -> tuple:
        """Return the slope, half the second and a sixth of the third derivative at a place."""
        w = self.w
        nothing = w.constant(0.0)
        value, slope, bend, twist = self.terms[TERMS - 1], nothing, nothing, nothing
        for term in range(TERMS - 2, -1, -1):
            twist = w.multiply_add(twist, at, bend)
            bend = w.multiply_add(bend, at, slope)
            slope = w.multiply_add(slope, at, value)
            if term:
                value = w.multiply_add(value, at, self.terms[term])
        return slope, bend, twist
