"""The arithmetic of flow maps, written as vectors of eight: lanes, or rows of a state.

A map is applied to eight lanes at once, its numbers the same for all of them (`move`). What a lane
that crosses needs alone are sums of columns, each a vector along a state or along the terms of a
polynomial (`combine`, `add_switch`). The compiler finds neither by itself.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import FASTMATH
from gearchaos_kernels.flow_layout import BOUNDS, TERMS, Layout, layout
from gearchaos_kernels.rows import STRIDE

VECTOR = 8
"""Lanes of a vector."""

INPUTS, TANGENT_INPUTS, GAPS, TANGENT_GAP, RESULT, WORK = 0, 16, (32, 48), 64, 80, 96
"""Where the numbers of a lane that crosses stand: state and forces, tangent vector, the gaps along
the step as polynomials, what the tangent vector adds to one of them, the state or tangent vector at
the end of the step; and how many numbers that are."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_DOUBLE, _INTEGER = ir.DoubleType(), ir.IntType(types.intp.bitwidth)
_FLAGS = tuple(sorted(FASTMATH))


def _scene(kind: Any) -> tuple[Any, Layout]:
    """Read effects and layout of a scene off the type of its flags."""
    present = kind.instance_class(*(None if flag is types.none else True for flag in kind.types))
    return present, layout.py_func(present)


def _inputs(first: int, place: Layout) -> list[int]:
    """Return the rows of what is multiplied with a map: a state, and what forces a lane."""
    return [first + n for n in range(place.states)] + [
        rows.FORCES + n for n in range(place.columns - place.states)
    ]


class _Writer:
    """Writes the instructions of one function: loads, stores and sums of vectors."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        self.context, self.builder = context, builder
        self.arguments = tuple(zip(signature.args, arguments, strict=True))

    def element(self, number: int, at: Any) -> Any:
        """Return the address of an element of the array that is this argument."""
        kind, array = self.arguments[number]
        first = self.context.make_array(kind)(self.context, self.builder, array).data
        return self.builder.gep(first, [at])

    def load(self, pointer: Any, at: int, width: int = VECTOR) -> Any:
        """Load a vector so many numbers behind an address."""
        kind = ir.VectorType(_DOUBLE, width).as_pointer()
        place = self.builder.gep(pointer, [_INTEGER(at)])
        return self.builder.load(self.builder.bitcast(place, kind), align=8)

    def store(self, value: Any, pointer: Any, at: int) -> None:
        """Store a vector so many numbers behind an address."""
        place = self.builder.gep(pointer, [_INTEGER(at)])
        self.builder.store(value, self.builder.bitcast(place, value.type.as_pointer()), align=8)

    def spread(self, pointer: Any, at: int, width: int = VECTOR) -> Any:
        """Load a number, and return a vector of it."""
        return self.splat(self.builder.load(self.builder.gep(pointer, [_INTEGER(at)])), width)

    def splat(self, number: Any, width: int = VECTOR) -> Any:
        """Return a vector of one number."""
        nothing = ir.Constant(ir.VectorType(_DOUBLE, width), ir.Undefined)
        one = self.builder.insert_element(nothing, number, ir.IntType(32)(0))
        order = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
        return self.builder.shuffle_vector(one, nothing, order)

    def constant(self, numbers: Iterable[float]) -> Any:
        """Return a vector of known numbers."""
        values = [float(number) for number in numbers]
        return ir.Constant(ir.VectorType(_DOUBLE, len(values)), values)

    def multiply_add(self, a: Any, b: Any, c: Any) -> Any:
        """Return a b + c, with c None for nothing."""
        product = self.builder.fmul(a, b, flags=_FLAGS)
        return product if c is None else self.builder.fadd(product, c, flags=_FLAGS)

    def sum(self, factors: Iterable[tuple[int, Any]], terms: Sequence[Any]) -> Any:
        """Return a sum of products with numbered terms, as two that do not wait for each other.

        Those of even and of odd numbers: leaving out columns of zeros changes no bit.
        """
        parts: list[Any] = [None, None]
        for number, factor in factors:
            parts[number % 2] = self.multiply_add(factor, terms[number], parts[number % 2])
        return self.builder.fadd(*parts, flags=_FLAGS)

    def polynomial(self, terms: Sequence[Any], place: Any) -> Any:
        """Return the value of a polynomial by Horner's rule."""
        value = terms[-1]
        for term in terms[-2::-1]:
            value = self.multiply_add(value, place, term)
        return value


def _pieces(width: int) -> list[tuple[int, int]]:
    """Cut a width into vectors: where each begins and how wide it is."""
    return [(at, min(VECTOR, width - at)) for at in range(0, width, VECTOR)]


@intrinsic
def keep_before(_typing, memory, slot, table, row, present):
    """Copy eight lanes as they are before a step, and bound how their gaps bend in it."""
    there, place = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes, numbers = w.element(0, arguments[1]), w.element(2, arguments[3])
        kind = ir.VectorType(_DOUBLE, VECTOR)
        name = f"llvm.fabs.v{VECTOR}f64"
        fabs = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), name)
        for first in (rows.STATE,) if there.tangent is None else (rows.STATE, rows.TANGENT):
            for line in range(first, first + place.states):
                w.store(w.load(lanes, line * STRIDE), lanes, (rows.BEFORE + line) * STRIDE)
        if there.resolved is not None:
            inputs = _inputs(rows.STATE, place)
            sizes = [builder.call(fabs, [w.load(lanes, row * STRIDE)]) for row in inputs]
            for number, bound in enumerate(BOUNDS[: place.ways]):
                bends = [w.spread(numbers, bound + column) for column in range(len(sizes))]
                w.store(w.sum(enumerate(bends), sizes), lanes, (rows.MARGINS + number) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, table, types.intp, present), generate


@intrinsic
def move(_typing, memory, slot, table, at, engaged_y, engaged_z, present):
    """Apply a map to those of eight lanes that are on its branches, state and tangent vector."""
    there, place = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes, numbers = w.element(0, arguments[1]), w.element(2, arguments[3])

        def apply(mask):
            read = {rows.STATE: _inputs(rows.STATE_BEFORE, place)}
            if there.tangent is not None:
                read[rows.TANGENT] = [rows.TANGENT_BEFORE + line for line in range(place.states)]
            given = {
                target: [w.load(lanes, row * STRIDE) for row in sources]
                for target, sources in read.items()
            }
            # The axial pair and the offset of its flank act on nothing else.
            axial = place.states - 4 * (place.ways - 1)
            apart = {*range(axial, place.states), place.states + 2} if place.ways > 1 else set()
            for line in range(place.states):
                factors = [
                    (column, w.spread(numbers, column * place.width + line))
                    for column in range(place.columns)
                    if line >= axial or column not in apart
                ]
                for target, inputs in given.items():
                    value = w.sum([one for one in factors if one[0] < len(inputs)], inputs)
                    if mask is not None:
                        value = builder.select(mask, value, w.load(lanes, (target + line) * STRIDE))
                    w.store(value, lanes, (target + line) * STRIDE)

        if place.pairs == 1:
            apply(None)
        else:
            engaged = {rows.TANGENTIAL_BRANCH: arguments[4], rows.AXIAL_BRANCH: arguments[5]}
            same = [
                builder.fcmp_ordered("==", w.load(lanes, row * STRIDE), w.splat(number))
                for row, number in engaged.items()
            ]
            mask = same[0] if place.ways == 1 else builder.and_(*same)
            bits = builder.bitcast(mask, ir.IntType(VECTOR))
            with builder.if_then(builder.icmp_unsigned("!=", bits, bits.type(0))):
                apply(mask)
        return context.get_dummy_value()

    numbers = memory, types.intp, table, types.intp, types.float64, types.float64
    return types.void(*numbers, present), generate


def _combination(of_state: bool, forced: bool) -> Any:
    """Make a function that sums the columns of a map, each times an input of a lane."""

    @intrinsic
    def combine(_typing, work, target, inputs, table, at, present):
        place = _scene(present)[1]
        width = place.width if of_state else TERMS
        columns = range(place.columns if forced else place.states)

        def generate(context, builder, signature, arguments):
            w = _Writer(context, builder, signature, arguments)
            result, given = w.element(0, arguments[1]), w.element(0, arguments[2])
            numbers = w.element(3, arguments[4])
            for first, size in _pieces(width):
                factors = [w.spread(given, column, size) for column in columns]
                terms = [w.load(numbers, column * width + first, size) for column in columns]
                w.store(w.sum(enumerate(factors), terms), result, first)
            return context.get_dummy_value()

        return types.void(work, types.intp, types.intp, table, types.intp, present), generate

    return combine


end_of = _combination(of_state=True, forced=True)
"""State at the end of the step: work, target, inputs, table, at, present."""
tangent_end_of = _combination(of_state=True, forced=False)
"""The same of a tangent vector."""
gap_along = _combination(of_state=False, forced=True)
"""Terms of a gap along the step."""
tangent_gap_along = _combination(of_state=False, forced=False)
"""Terms of what a tangent vector adds to a gap."""


@intrinsic
def add_switch(_typing, work, gap, moment, factor, table, at, present):
    """Carry a lane to another branch: move its state, and tangent vector, at the step's beginning.

    To the state is added the factor times the integral from -1 to the moment of the `SWITCH` of the
    new branch times the polynomial at ``gap`` in the work of the lane, by Gauss's rule.
    """
    there, scene = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        columns = w.element(4, arguments[5])
        half = builder.fmul(builder.fadd(arguments[2], _DOUBLE(1.0)), _DOUBLE(0.5))
        scale = builder.fmul(half, arguments[3])
        sources = {INPUTS: arguments[1]}
        if there.tangent is not None:
            sources[TANGENT_INPUTS] = _INTEGER(TANGENT_GAP)
        nodes: list[Any] = []
        weighted: dict[int, list[Any]] = {target: [] for target in sources}
        for first, size in _pieces(len(_NODES)):
            shifted = w.constant(_NODES[first : first + size] + 1.0)
            place = w.multiply_add(shifted, w.splat(half, size), w.constant([-1.0] * size))
            nodes += (builder.extract_element(place, ir.IntType(32)(n)) for n in range(size))
            weights = builder.fmul(w.constant(_WEIGHTS[first : first + size]), w.splat(scale, size))
            for target, source in sources.items():
                numbers = w.element(0, source)
                terms = [w.spread(numbers, term, size) for term in range(TERMS)]
                value = builder.fmul(w.polynomial(terms, place), weights, flags=_FLAGS)
                for number in range(size):
                    weighted[target].append(builder.extract_element(value, ir.IntType(32)(number)))
        for first, size in _pieces(scene.width):
            wide = [w.splat(node, size) for node in nodes]
            *others, last = (w.load(columns, n * scene.width + first, size) for n in range(TERMS))
            sums = [last] * len(wide)
            # Term by term: a register holds the sum of each node, and a row is needed once.
            for row in reversed(others):
                sums = [w.multiply_add(*pair, row) for pair in zip(sums, wide, strict=True)]
            for target, factors in weighted.items():
                pointer = w.element(0, _INTEGER(target + first))
                change = w.sum(enumerate(w.splat(factor, size) for factor in factors), sums)
                moved = builder.fadd(w.load(pointer, 0, size), change, flags=_FLAGS)
                w.store(moved, pointer, 0)
        return context.get_dummy_value()

    numbers = work, types.intp, types.float64, types.float64, table, types.intp
    return types.void(*numbers, present), generate


@intrinsic
def value_and_slope(_typing, work, at, place):
    """Evaluate a polynomial in the work of a lane, and its derivative, by four parts of each."""

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        numbers, s = w.element(0, arguments[1]), arguments[2]
        square = builder.fmul(s, s)
        fourth = builder.fmul(square, square)
        terms = [builder.load(builder.gep(numbers, [_INTEGER(term)])) for term in range(TERMS)]
        slopes = [builder.fmul(terms[term], _DOUBLE(float(term))) for term in range(1, TERMS)]
        results = []
        for series in (terms, slopes):
            parts = [w.polynomial(series[first::4], fourth) for first in range(4)]
            low, high = (w.multiply_add(parts[n + 1], s, parts[n]) for n in (0, 2))
            results.append(w.multiply_add(high, square, low))
        return context.make_tuple(builder, signature.return_type, results)

    return types.UniTuple(types.float64, 2)(work, types.intp, types.float64), generate
