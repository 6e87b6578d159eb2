"""The arithmetic of flow maps, written as vectors of eight: lanes, or rows of a state.

A map is applied to eight lanes at once, its numbers the same for all of them (`move`), and so is
what carries lanes over a crossing. What a lane with maps of its own needs are sums of columns, each
a vector along a state (`combine`). The compiler finds neither by itself.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import FASTMATH, first_element
from gearchaos_kernels.flow_layout import (
    AFTER,
    AXIALLY,
    BOUNDS,
    EDGE,
    FACTOR,
    GAP,
    GAPS,
    HEADER,
    SUMS,
    TANGENT_SUMS,
    TANGENT_TERMS,
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


def _inputs(place: Layout) -> list[int]:
    """Return the rows of what is multiplied with a map: state before the step, and the forces."""
    return [rows.STATE_BEFORE + n for n in range(place.states)] + [
        rows.FORCES + n for n in range(place.columns - place.states)
    ]


def _tangent_inputs(place: Layout) -> range:
    """Return the rows of the tangent vector before the step."""
    return range(rows.TANGENT_BEFORE, rows.TANGENT_BEFORE + place.states)


class _Writer:
    """Writes the instructions of one function: loads, stores and sums of vectors."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        self.context, self.builder = context, builder
        self.arguments = tuple(zip(signature.args, arguments, strict=True))

    def element(self, number: int, at: Any) -> Any:
        """Return the address of an element of the array that is this argument."""
        kind, array = self.arguments[number]
        first = first_element(self.context, self.builder, kind, array)
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

    def rows(self, lanes: Any, numbers: Iterable[int]) -> list[Any]:
        """Load rows of eight lanes."""
        return [self.load(lanes, row * STRIDE) for row in numbers]

    def put(self, value: Any, lanes: Any, row: int, mask: Any) -> None:
        """Store a row of eight lanes, or of those of a mask."""
        if mask is not None:
            value = self.builder.select(mask, value, self.load(lanes, row * STRIDE))
        self.store(value, lanes, row * STRIDE)

    def equal(self, lanes: Any, row: int, number: float) -> Any:
        """Return of which of eight lanes a row is a number."""
        given = self.load(lanes, row * STRIDE)
        return self.builder.fcmp_ordered("==", given, self.constant(number))

    def spread(self, pointer: Any, at: int, width: int = VECTOR) -> Any:
        """Load a number, and return a vector of it."""
        return self.splat(self.builder.load(self.builder.gep(pointer, [_INTEGER(at)])), width)

    def splat(self, number: Any, width: int = VECTOR) -> Any:
        """Return a vector of one number."""
        nothing = ir.Constant(ir.VectorType(_DOUBLE, width), ir.Undefined)
        first = self.builder.insert_element(nothing, number, _INDEX(0))
        order = ir.Constant(ir.VectorType(_INDEX, width), [_INDEX(0)] * width)
        return self.builder.shuffle_vector(first, nothing, order)

    def constant(self, number: float) -> Any:
        """Return a vector of one known number."""
        return ir.Constant(ir.VectorType(_DOUBLE, VECTOR), [number] * VECTOR)

    def size(self, vector: Any) -> Any:
        """Return the sizes of the numbers of a vector."""
        kind = vector.type
        name = f"llvm.fabs.v{kind.count}f64"
        module = self.builder.module
        declared = module.globals.get(name)
        fabs = declared or ir.Function(module, ir.FunctionType(kind, [kind]), name)
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


@intrinsic
def keep_before(_typing, memory, slot, present):
    """Copy eight lanes as they are before a step."""
    there, place = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes = w.element(0, arguments[1])
        for first in (rows.STATE,) if there.tangent is None else (rows.STATE, rows.TANGENT):
            for line in range(first, first + place.states):
                w.store(w.load(lanes, line * STRIDE), lanes, (rows.BEFORE + line) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, present), generate


@intrinsic
def bound_bends(_typing, memory, slot, table, row, present):
    """Bound how the gaps of eight lanes bend in a step."""
    there, place = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes, numbers = w.element(0, arguments[1]), w.element(2, arguments[3])
        if there.resolved is not None:
            sizes = [w.size(given) for given in w.rows(lanes, _inputs(place))]
            for number, bound in enumerate(BOUNDS[: place.ways]):
                bends = [w.spread(numbers, bound + column) for column in range(len(sizes))]
                w.store(w.sum(enumerate(bends), sizes), lanes, (rows.MARGINS + number) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, table, types.intp, present), generate


def _on_branches(present: Any, apply: Any) -> Any:
    """Make the body of an intrinsic that acts on eight lanes by the maps of their branches.

    ``apply(writer, lanes, maps, mask)``: for each pair of branches on which some lanes are, with
    the addresses of the lanes and of the maps, and which of the lanes these are, None for all.
    """
    place = _scene(present)[1]

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes = w.element(0, arguments[1])
        for pair in range(place.pairs):
            at = builder.add(arguments[3], _INTEGER(HEADER + pair * place.size))
            maps = w.element(2, at)
            if place.pairs == 1:
                apply(w, lanes, maps, None)
                break
            mask = w.equal(lanes, rows.TANGENTIAL_BRANCH, 1.0 - pair % 2)
            if place.ways > 1:
                mask = builder.and_(mask, w.equal(lanes, rows.AXIAL_BRANCH, 1.0 - pair // 2))
            bits = builder.bitcast(mask, ir.IntType(VECTOR))
            with builder.if_then(builder.icmp_unsigned("!=", bits, bits.type(0))):
                apply(w, lanes, maps, mask)
        return context.get_dummy_value()

    return generate


@intrinsic
def move(_typing, memory, slot, table, row, present):
    """Apply the map of its branches to each of eight lanes, state and tangent vector."""
    there, place = _scene(present)

    def apply(w, lanes, maps, mask):
        given = {rows.STATE: w.rows(lanes, _inputs(place))}
        if there.tangent is not None:
            given[rows.TANGENT] = w.rows(lanes, _tangent_inputs(place))
        # The axial pair and the offset of its flank act on nothing else.
        axial = place.states - 4 * (place.ways - 1)
        apart = {*range(axial, place.states), place.states + 2} if place.ways > 1 else set()
        for line in range(place.states):
            factors = [
                (column, w.spread(maps, column * place.width + line))
                for column in range(place.columns)
                if line >= axial or column not in apart
            ]
            for target, inputs in given.items():
                value = w.sum([one for one in factors if one[0] < len(inputs)], inputs)
                w.put(value, lanes, target + line, mask)

    given = memory, types.intp, table, types.intp, present
    return types.void(*given), _on_branches(present, apply)


@intrinsic
def look_along(_typing, aside, slot, table, row, present):
    """Compute the terms of all gaps along the step, without the mean error, as `move` does."""
    there, place = _scene(present)

    def apply(w, lanes, maps, mask):
        given = {0: w.rows(lanes, _inputs(place))}
        if there.tangent is not None:
            given[TANGENT_TERMS] = w.rows(lanes, _tangent_inputs(place))
        for way in range(place.ways):
            first = place.gap + way * place.columns * TERMS
            for term in range(TERMS):
                factors = [
                    (column, w.spread(maps, first + column * TERMS + term))
                    for column in range(place.columns)
                ]
                for target, inputs in given.items():
                    value = w.sum(factors[: len(inputs)], inputs)
                    w.put(value, lanes, GAPS + way * GAP + target + term, mask)

    given = aside, types.intp, table, types.intp, present
    return types.void(*given), _on_branches(present, apply)


@intrinsic
def add_switch(_typing, aside, slot, table, row, present):
    """Carry eight lanes to their branches: move state and tangent vector at the step's beginning.

    To them is added the integral from -1 to the moment of crossing of the `SWITCH` of the new
    branch, sum_k s^k p_k, times the gap: each p_k times what `sum_along` has made of it.
    """
    there, place = _scene(present)

    def apply(w, lanes, maps, mask):
        given = {rows.STATE_BEFORE: w.rows(lanes, range(SUMS, SUMS + TERMS))}
        if there.tangent is not None:
            given[rows.TANGENT_BEFORE] = w.rows(lanes, range(TANGENT_SUMS, TANGENT_SUMS + TERMS))
        for way in range(place.ways):
            those = mask
            if place.ways > 1:
                axially = w.equal(lanes, AXIALLY, float(way))
                those = w.builder.and_(mask, axially)
            first = place.switch + way * TERMS * place.width
            for line in range(place.states):
                factors = [
                    (k, w.spread(maps, first + k * place.width + line)) for k in range(TERMS)
                ]
                for target, sums in given.items():
                    before = w.load(lanes, (target + line) * STRIDE)
                    value = w.builder.fadd(before, w.sum(factors, sums), flags=_FLAGS)
                    w.put(value, lanes, target + line, those)

    given = aside, types.intp, table, types.intp, present
    return types.void(*given), _on_branches(present, apply)


@intrinsic
def sum_along(_typing, aside, present):
    """Integrate what pushes eight lanes that cross, times s^k, from -1 to the moment of that.

    That is, for every k, the sum of the terms j, each times the integral of s^(j + k).
    """
    there, place = _scene(present)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes = w.element(0, _INTEGER(0))
        after, factor, edge = w.rows(lanes, (AFTER, FACTOR, EDGE))
        powers, integrals = {1: after}, []
        for n in range(1, 2 * TERMS):
            if n > 1:
                powers[n] = builder.fmul(powers[n // 2], powers[n - n // 2])
            begin = w.constant(-((-1.0) ** n) / n)
            integrals.append(w.multiply_add(powers[n], w.constant(1.0 / n), begin))
        given = {0: SUMS} if there.tangent is None else {0: SUMS, TANGENT_TERMS: TANGENT_SUMS}
        for source, target in given.items():
            terms = w.rows(lanes, range(GAPS + source, GAPS + source + TERMS))
            if place.ways > 1:
                axial = w.rows(lanes, range(GAPS + GAP + source, GAPS + GAP + source + TERMS))
                those = w.equal(lanes, AXIALLY, 1.0)
                terms = [builder.select(those, *pair) for pair in zip(axial, terms, strict=True)]
            if source == 0:
                terms[0] = builder.fsub(terms[0], edge, flags=_FLAGS)
            for k in range(TERMS):
                value = w.sum(enumerate(terms), integrals[k:])
                w.put(builder.fmul(value, factor, flags=_FLAGS), lanes, target + k, None)
        return context.get_dummy_value()

    return types.void(aside, present), generate


def _combination(forced: bool) -> Any:
    """Make a function that sums the columns of a map, each times an input of a lane."""

    @intrinsic
    def combine(_typing, numbers, target, inputs, table, at, present):
        place = _scene(present)[1]
        columns = range(place.columns if forced else place.states)

        def generate(context, builder, signature, arguments):
            w = _Writer(context, builder, signature, arguments)
            result, given = w.element(0, arguments[1]), w.element(0, arguments[2])
            map_ = w.element(3, arguments[4])
            for first in range(0, place.width, VECTOR):
                size = min(VECTOR, place.width)
                factors = [w.spread(given, column, size) for column in columns]
                terms = [w.load(map_, column * place.width + first, size) for column in columns]
                w.store(w.sum(enumerate(factors), terms), result, first)
            return context.get_dummy_value()

        return types.void(numbers, types.intp, types.intp, table, types.intp, present), generate

    return combine


end_of = _combination(forced=True)
"""State at the end of the step: numbers, target, inputs, table, at, present."""
tangent_end_of = _combination(forced=False)
"""The same of a tangent vector."""
