"""The arithmetic of flow maps, written as vectors of eight: lanes, or rows of a state.

A map is applied to eight lanes at once, its numbers the same for all of them (`move`). What a lane
that crosses needs alone are sums of columns, each a vector along a state or along the terms of a
polynomial (`combine`, `add_switch`). The compiler finds neither by itself.
"""

import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import FASTMATH
from gearchaos_kernels.flow_layout import (
    BOUNDS,
    INPUTS,
    TANGENT_GAP,
    TANGENT_INPUTS,
    TERMS,
    Layout,
    layout,
)
from gearchaos_kernels.rows import STRIDE

VECTOR = 8
"""Lanes of a vector."""

_DOUBLE, _INTEGER, _INDEX = ir.DoubleType(), ir.IntType(types.intp.bitwidth), ir.IntType(32)
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
        return self.repeat(self.builder.insert_element(nothing, number, _INDEX(0)), 0, width)

    def repeat(self, vector: Any, number: int, width: int) -> Any:
        """Return a vector of one number of another vector."""
        return self.pick(vector, vector, [number] * width)

    def pick(self, vector: Any, following: Any, places: Iterable[int]) -> Any:
        """Return numbers of a vector and the one behind it, by their places."""
        order = [_INDEX(place) for place in places]
        chosen = ir.Constant(ir.VectorType(_INDEX, len(order)), order)
        return self.builder.shuffle_vector(vector, following, chosen)

    def constant(self, numbers: Iterable[float]) -> Any:
        """Return a vector of known numbers."""
        values = [float(number) for number in numbers]
        return ir.Constant(ir.VectorType(_DOUBLE, len(values)), values)

    def size(self, vector: Any) -> Any:
        """Return the sizes of the numbers of a vector."""
        kind = vector.type
        name = f"llvm.fabs.v{kind.count}f64"
        function = ir.FunctionType(kind, [kind])
        fabs = cgutils.get_or_insert_function(self.builder.module, function, name)
        return self.builder.call(fabs, [vector])

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
        for first in (rows.STATE,) if there.tangent is None else (rows.STATE, rows.TANGENT):
            for line in range(first, first + place.states):
                w.store(w.load(lanes, line * STRIDE), lanes, (rows.BEFORE + line) * STRIDE)
        if there.resolved is not None:
            inputs = _inputs(rows.STATE, place)
            sizes = [w.size(w.load(lanes, row * STRIDE)) for row in inputs]
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
"""Terms of a gap without the mean pitch error."""
tangent_gap_along = _combination(of_state=False, forced=False)
"""Terms of what a tangent vector adds to a gap."""


def _integrals(w: _Writer, place: Any) -> list[Any]:
    """Return the integrals from -1 to a place of s^0 to s^(2 TERMS - 1), in vectors."""
    order = np.arange(1, VECTOR + 1)
    ones = w.constant(np.ones(VECTOR))
    powers, power = ones, w.splat(place)
    for bit in (1, 2, 4, 8):
        has = ir.Constant(ir.VectorType(ir.IntType(1), VECTOR), [int(n & bit > 0) for n in order])
        powers = w.builder.fmul(powers, w.builder.select(has, power, ones))
        last, power = power, w.builder.fmul(power, power)
    results = []
    for _ in range(2 * TERMS // VECTOR):
        begin = w.constant(-((-1.0) ** order) / order)
        results.append(w.multiply_add(powers, w.constant(1.0 / order), begin))
        powers = w.builder.fmul(powers, last)
        order = order + VECTOR
    return results


@intrinsic
def add_switch(_typing, work, own, gap, moment, factor, table, at, present):
    """Carry a lane to another branch: move its state, and tangent vector, at the step's beginning.

    To the state is added the factor times the integral from -1 to the moment of the `SWITCH` of the
    new branch, sum_k s^k p_k, times the gap: p_k times the sum of the terms j of the gap, each
    times the integral of s^(j + k).
    """
    there, scene = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        columns = w.element(5, arguments[6])
        integrals = _integrals(w, arguments[3])
        # Eight integrals from every order on.
        windows = [
            w.pick(one, following, range(first, first + VECTOR))
            for one, following in itertools.pairwise(integrals)
            for first in range(VECTOR)
        ]
        sources = {INPUTS: arguments[2]}
        if there.tangent is not None:
            sources[TANGENT_INPUTS] = builder.add(arguments[1], _INTEGER(TANGENT_GAP))
        sums = {}
        for target, source in sources.items():
            numbers = w.element(0, source)
            factors = [(term, w.spread(numbers, term)) for term in range(TERMS)]
            sums[target] = [w.sum(factors, windows[k:]) for k in range(0, TERMS, VECTOR)]
        for first, size in _pieces(scene.width):
            # Of a narrow state several columns stand in a vector, one behind the other.
            beside = VECTOR // size
            places, order = range(0, TERMS, beside), np.repeat(np.arange(beside), size)
            terms = [w.load(columns, k * scene.width + first) for k in places]
            for target, given in sums.items():
                pointer = w.element(0, builder.add(arguments[1], _INTEGER(target + first)))
                factors = [
                    w.pick(given[k // VECTOR], given[k // VECTOR], k % VECTOR + order)
                    for k in places
                ]
                change = w.sum(enumerate(factors), terms)
                while change.type.count > size:
                    half = change.type.count // 2
                    ends = (
                        w.pick(change, change, range(half)),
                        w.pick(change, change, range(half, 2 * half)),
                    )
                    change = builder.fadd(*ends, flags=_FLAGS)
                factor = w.splat(arguments[4], size)
                w.store(w.multiply_add(factor, change, w.load(pointer, 0, size)), pointer, 0)
        return context.get_dummy_value()

    numbers = work, types.intp, types.intp, types.float64, types.float64, table, types.intp
    return types.void(*numbers, present), generate


def _sums(w: _Writer, vectors: list[Any]) -> Any:
    """Return the sum of the numbers of every vector, as one vector."""
    vectors = vectors + [w.constant(np.zeros(VECTOR))] * (VECTOR - len(vectors))
    while len(vectors) > 1:
        # Numbers that belong to the same sum stay side by side.
        vectors = [
            w.builder.fadd(*(w.pick(*pair, range(side, 2 * VECTOR, 2)) for side in (0, 1)))
            for pair in zip(vectors[::2], vectors[1::2], strict=True)
        ]
    return vectors[0]


@intrinsic
def margins_of(_typing, work, inputs, table, row):
    """Bound by how much either gap of a lane bends in a step, as `keep_before` does."""

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        given, numbers = w.element(0, arguments[1]), w.element(2, arguments[3])
        parts: list[Any] = [None] * len(BOUNDS)
        for first in range(0, TERMS, VECTOR):
            size = w.size(w.load(given, first))
            bounds = [w.load(numbers, bound + first) for bound in BOUNDS]
            parts = [w.multiply_add(size, *pair) for pair in zip(bounds, parts, strict=True)]
        sums = _sums(w, parts)
        results = [builder.extract_element(sums, _INDEX(number)) for number in range(len(BOUNDS))]
        return context.make_tuple(builder, signature.return_type, results)

    return types.UniTuple(types.float64, 2)(work, types.intp, table, types.intp), generate
