"""The arithmetic of flow maps, written as vectors of eight: lanes, or rows of a state.

A map is applied to eight lanes at once, its numbers the same for all of them (`move`). What a lane
that crosses needs alone are sums of columns, each a vector along a state or along the terms of a
polynomial (`combine`, `add_switch`). The compiler finds neither by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gearchaos_kernels.block_memory import (
    AXIAL_BRANCH,
    BEFORE,
    FORCES,
    MARGINS,
    STATE,
    STRIDE,
    TANGENT,
    TANGENTIAL_BRANCH,
)
from gearchaos_kernels.compilation import FASTMATH
from gearchaos_kernels.flow_layout import BOUND_Y, BOUND_Z, TERMS, Layout, layout

VECTOR = 8
"""Lanes of a vector."""

INPUTS, TANGENT_INPUTS, GAP_Y, GAP_Z, TANGENT_GAP, RESULT, WORK = 0, 16, 32, 48, 64, 80, 96
"""Where the numbers of a lane that crosses stand: state and forces, tangent vector, the gaps along
the step as polynomials, what the tangent vector adds to one of them, the state or tangent vector at
the end of the step; and how many numbers that are."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_DOUBLE = ir.DoubleType()
_FLAGS = tuple(sorted(FASTMATH))


class _Scene:
    """Layout and effects of a scene, read off the type of its flags."""

    def __init__(self, present: Any) -> None:
        flags = dict(zip(present.fields, present.types, strict=True))
        there = {name: None if kind is types.none else () for name, kind in flags.items()}
        self.present = present.instance_class(**there)
        self.layout: Layout = layout.py_func(self.present)

    @property
    def forces(self) -> list[int]:
        """Rows of what forces a lane, in the order of the columns of a map."""
        p = self.present
        there = (True, True, p.axial, p.pitch_error, p.phase)
        return [FORCES + n for n, flag in enumerate(there) if flag is True or flag is not None]


class _Writer:
    """Writes the instructions of one function: loads, stores and sums of vectors."""

    def __init__(self, context: Any, builder: Any) -> None:
        self.context, self.builder = context, builder

    def data(self, kind: Any, array: Any) -> Any:
        """Return the first address of an array."""
        return self.context.make_array(kind)(self.context, self.builder, array).data

    def element(self, signature: Any, arguments: Any, number: int) -> Any:
        """Return the address in an array argument that the argument behind it counts."""
        array = self.data(signature.args[number], arguments[number])
        return self.builder.gep(array, [arguments[number + 1]])

    def at(self, pointer: Any, index: Any, more: int = 0) -> Any:
        """Return the address of an element."""
        index = self.builder.add(index, ir.Constant(index.type, more))
        return self.builder.gep(pointer, [index])

    def load(self, pointer: Any, width: int) -> Any:
        """Load a vector."""
        kind = ir.VectorType(_DOUBLE, width).as_pointer()
        return self.builder.load(self.builder.bitcast(pointer, kind), align=8)

    def store(self, value: Any, pointer: Any) -> None:
        """Store a vector."""
        self.builder.store(value, self.builder.bitcast(pointer, value.type.as_pointer()), align=8)

    def splat(self, number: Any, width: int) -> Any:
        """Return a vector of one number."""
        kind = ir.VectorType(_DOUBLE, width)
        one = self.builder.insert_element(
            ir.Constant(kind, ir.Undefined), number, ir.Constant(ir.IntType(32), 0)
        )
        order = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
        return self.builder.shuffle_vector(one, ir.Constant(kind, ir.Undefined), order)

    def constant(self, numbers: Iterable[float]) -> Any:
        """Return a vector of known numbers."""
        values = [float(number) for number in numbers]
        return ir.Constant(ir.VectorType(_DOUBLE, len(values)), values)

    def multiply_add(self, a: Any, b: Any, c: Any) -> Any:
        """Return a b + c, with c None for nothing."""
        product = self.builder.fmul(a, b, flags=_FLAGS)
        return product if c is None else self.builder.fadd(product, c, flags=_FLAGS)

    def add(self, a: Any, b: Any) -> Any:
        """Return a + b, either None for nothing."""
        if a is None or b is None:
            return b if a is None else a
        return self.builder.fadd(a, b, flags=_FLAGS)

    def sum(
        self, factors: Sequence[Any], terms: Sequence[Any], columns: Sequence[int] | None = None
    ) -> Any:
        """Return a sum of products, as two sums that do not wait for each other.

        Those of even and of odd columns: leaving out columns of zeros changes no bit.
        """
        parts: list[Any] = [None, None]
        numbers = range(len(factors)) if columns is None else columns
        for number, factor, term in zip(numbers, factors, terms, strict=True):
            parts[number % 2] = self.multiply_add(factor, term, parts[number % 2])
        return self.add(*parts)


def _pieces(width: int) -> list[tuple[int, int]]:
    """Cut a width into vectors: where each begins and how wide it is."""
    return [(at, min(VECTOR, width - at)) for at in range(0, width, VECTOR)]


@intrinsic
def keep_before(_typing: Any, memory: Any, slot: Any, table: Any, row: Any, present: Any) -> Any:
    """Copy eight lanes as they are before a step, and bound how their gaps bend in it."""
    scene = _Scene(present)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        w = _Writer(context, builder)
        lanes, numbers = (w.element(signature, arguments, array) for array in (0, 2))
        zero = ir.Constant(arguments[1].type, 0)
        kind = ir.VectorType(_DOUBLE, VECTOR)
        name = f"llvm.fabs.v{VECTOR}f64"
        fabs = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), name)
        sizes = []
        for line in range(scene.layout.states):
            value = w.load(w.at(lanes, zero, (STATE + line) * STRIDE), VECTOR)
            w.store(value, w.at(lanes, zero, (BEFORE + STATE + line) * STRIDE))
            sizes.append(builder.call(fabs, [value]))
            if scene.present.tangent is not None:
                value = w.load(w.at(lanes, zero, (TANGENT + line) * STRIDE), VECTOR)
                w.store(value, w.at(lanes, zero, (BEFORE + TANGENT + line) * STRIDE))
        if scene.present.resolved is not None:
            for line in scene.forces:
                value = w.load(w.at(lanes, zero, line * STRIDE), VECTOR)
                sizes.append(builder.call(fabs, [value]))
            for number in range(1 if scene.present.axial is None else 2):
                first = (BOUND_Y, BOUND_Z)[number]
                factors = [
                    w.splat(builder.load(w.at(numbers, zero, first + column)), VECTOR)
                    for column in range(len(sizes))
                ]
                w.store(w.sum(factors, sizes), w.at(lanes, zero, (MARGINS + number) * STRIDE))
        return context.get_dummy_value()

    return types.void(memory, types.intp, table, types.intp, present), generate


@intrinsic
def move(
    _typing: Any,
    memory: Any,
    slot: Any,
    table: Any,
    at: Any,
    engaged_y: Any,
    engaged_z: Any,
    present: Any,
) -> Any:
    """Apply a map to those of eight lanes that are on its branches, state and tangent vector."""
    scene = _Scene(present)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        w = _Writer(context, builder)
        lanes, numbers = (w.element(signature, arguments, array) for array in (0, 2))
        zero = ir.Constant(arguments[1].type, 0)
        place, mask = scene.layout, None
        if place.pairs > 1:
            for row, engaged in ((TANGENTIAL_BRANCH, 4), (AXIAL_BRANCH, 5))[
                : 1 if scene.present.axial is None else 2
            ]:
                found = w.load(w.at(lanes, zero, row * STRIDE), VECTOR)
                same = builder.fcmp_ordered("==", found, w.splat(arguments[engaged], VECTOR))
                mask = same if mask is None else builder.and_(mask, same)

        def apply() -> None:
            before = [BEFORE + STATE + line for line in range(place.states)]
            inputs = [w.load(w.at(lanes, zero, r * STRIDE), VECTOR) for r in before + scene.forces]
            tangents = []
            if scene.present.tangent is not None:
                tangents = [
                    w.load(w.at(lanes, zero, (BEFORE + TANGENT + line) * STRIDE), VECTOR)
                    for line in range(place.states)
                ]
            # The axial pair and the offset of its flank act on nothing else.
            axial, apart = place.states, set[int]()
            if scene.present.axial is not None:
                axial = place.states - 4
                apart = {*range(axial, place.states), place.states + 2}
            for line in range(place.states):
                there = [c for c in range(place.columns) if line >= axial or c not in apart]
                factors = {
                    column: w.splat(
                        builder.load(w.at(numbers, zero, place.end + column * place.width + line)),
                        VECTOR,
                    )
                    for column in there
                }
                for row, given in ((STATE, inputs), (TANGENT, tangents)):
                    used = [column for column in there if column < len(given)]
                    if not used:
                        continue
                    value = w.sum([factors[c] for c in used], [given[c] for c in used], used)
                    target = w.at(lanes, zero, (row + line) * STRIDE)
                    if mask is not None:
                        value = builder.select(mask, value, w.load(target, VECTOR))
                    w.store(value, target)

        if mask is None:
            apply()
        else:
            bits = builder.bitcast(mask, ir.IntType(VECTOR))
            with builder.if_then(builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))):
                apply()
        return context.get_dummy_value()

    signature = types.void(
        memory, types.intp, table, types.intp, types.float64, types.float64, present
    )
    return signature, generate


def _combination(of_state: bool, forced: bool) -> Any:
    """Make a function that sums the columns of a map, each times an input of a lane."""

    @intrinsic
    def combine(
        _typing: Any, work: Any, target: Any, inputs: Any, table: Any, at: Any, present: Any
    ) -> Any:
        place = _Scene(present).layout
        width = place.width if of_state else TERMS
        count = place.columns if forced else place.states

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            w = _Writer(context, builder)
            numbers = w.data(signature.args[0], arguments[0])
            columns = w.data(signature.args[3], arguments[3])
            given = [builder.load(w.at(numbers, arguments[2], column)) for column in range(count)]
            for first, size in _pieces(width):
                terms = [
                    w.load(w.at(columns, arguments[4], column * width + first), size)
                    for column in range(count)
                ]
                value = w.sum([w.splat(number, size) for number in given], terms)
                w.store(value, w.at(numbers, arguments[1], first))
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
def add_switch(
    _typing: Any,
    work: Any,
    gap: Any,
    moment: Any,
    factor: Any,
    table: Any,
    at: Any,
    present: Any,
) -> Any:
    """Carry a lane to another branch: move its state, and tangent vector, at the step's beginning.

    To the state is added the factor times the integral from -1 to the moment of the `SWITCH` of the
    new branch times the polynomial at ``gap`` in the work of the lane, by Gauss's rule.
    """
    scene = _Scene(present)
    width = scene.layout.width

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        w = _Writer(context, builder)
        numbers = w.data(signature.args[0], arguments[0])
        columns = w.data(signature.args[4], arguments[4])
        zero = ir.Constant(arguments[1].type, 0)
        one = ir.Constant(_DOUBLE, 1.0)
        half = builder.fmul(builder.fadd(arguments[2], one), ir.Constant(_DOUBLE, 0.5))
        scale = builder.fmul(half, arguments[3])
        sources = [(INPUTS, arguments[1])]
        if scene.present.tangent is not None:
            sources.append((TANGENT_INPUTS, ir.Constant(arguments[1].type, TANGENT_GAP)))
        nodes: list[Any] = []
        weighted: list[list[Any]] = [[] for _ in sources]
        for first, size in _pieces(len(_NODES)):
            shifted = w.constant(_NODES[first : first + size] + 1.0)
            place = w.multiply_add(shifted, w.splat(half, size), w.constant([-1.0] * size))
            weights = builder.fmul(w.constant(_WEIGHTS[first : first + size]), w.splat(scale, size))
            values = []
            for _, source in sources:
                value = None
                for term in range(TERMS - 1, -1, -1):
                    number = w.splat(builder.load(w.at(numbers, source, term)), size)
                    value = number if value is None else w.multiply_add(value, place, number)
                values.append(builder.fmul(value, weights, flags=_FLAGS))
            for number in range(size):
                index = ir.Constant(ir.IntType(32), number)
                nodes.append(builder.extract_element(place, index))
                for kept, value in zip(weighted, values, strict=True):
                    kept.append(builder.extract_element(value, index))
        for first, size in _pieces(width):
            wide = [w.splat(node, size) for node in nodes]
            sums: list[Any] = [None] * len(nodes)
            for term in range(TERMS - 1, -1, -1):
                row = w.load(w.at(columns, arguments[5], term * width + first), size)
                sums = [
                    row if value is None else w.multiply_add(value, node, row)
                    for value, node in zip(sums, wide, strict=True)
                ]
            for (target, _), factors in zip(sources, weighted, strict=True):
                pointer = w.at(numbers, zero, target + first)
                change = w.sum([w.splat(factor, size) for factor in factors], sums)
                w.store(w.add(w.load(pointer, size), change), pointer)
        return context.get_dummy_value()

    signature = types.void(
        work, types.intp, types.float64, types.float64, table, types.intp, present
    )
    return signature, generate


@intrinsic
def value_and_slope(_typing: Any, work: Any, at: Any, place: Any) -> Any:
    """Evaluate a polynomial in the work of a lane, and its derivative, by its even and odd part."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        w = _Writer(context, builder)
        numbers = w.data(signature.args[0], arguments[0])
        s = arguments[2]
        square = builder.fmul(s, s)
        terms = [builder.load(w.at(numbers, arguments[1], term)) for term in range(TERMS)]
        slopes = [
            builder.fmul(terms[term], ir.Constant(_DOUBLE, float(term))) for term in range(1, TERMS)
        ]
        results = []
        for series in (terms, slopes):
            parts = []
            for first in (0, 1):
                value = None
                for term in reversed(series[first::2]):
                    value = term if value is None else w.multiply_add(value, square, term)
                parts.append(value)
            results.append(w.multiply_add(parts[1], s, parts[0]))
        return context.make_tuple(builder, signature.return_type, results)

    return types.UniTuple(types.float64, 2)(work, types.intp, types.float64), generate
