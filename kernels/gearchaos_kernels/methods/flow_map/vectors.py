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

from gearchaos_kernels.compilation import FASTMATH, first_element
from gearchaos_kernels.memory.rows import BRANCH, STATE, STRIDE, VECTOR, rows_of
from gearchaos_kernels.methods.flow_map.layout import TERMS, aside_of, layout_of, method_rows_of
from gearchaos_kernels.scene import Scene, provider_of

_DOUBLE, _INTEGER, _INDEX = ir.DoubleType(), ir.IntType(types.intp.bitwidth), ir.IntType(32)
_FLAGS = tuple(sorted(FASTMATH))


def _inputs(scene: Scene) -> list[int]:
    """Return the rows of what is multiplied with a map: state before the step, and what forces."""
    place, before, forced = layout_of(scene), rows_of(scene).state_before, method_rows_of(scene)
    return [before + n for n in range(place.states)] + [
        forced.inputs + n for n in range(place.columns - place.states)
    ]


def _tangent_inputs(scene: Scene) -> range:
    """Return the rows of the tangent vector before the step."""
    first = rows_of(scene).tangent_before
    return range(first, first + layout_of(scene).states)


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
        """Return a mask of the lanes, of eight, in which a row equals a number."""
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
        """Return a sum of products as two independent partial sums, which run in parallel.

        Those of even and of odd numbers: leaving out columns of zeros changes no bit.
        """
        parts: list[Any] = [None, None]
        for number, factor in factors:
            parts[number % 2] = self.multiply_add(factor, terms[number], parts[number % 2])
        return self.builder.fadd(*parts, flags=_FLAGS)


@intrinsic
def keep_before(_typing, memory, slot, scene):
    """Copy eight lanes as they are before a step."""
    place, at = layout_of(scene.scene), rows_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes = w.element(0, arguments[1])
        for first in (STATE,) if scene.scene.tangent is None else (STATE, at.tangent):
            for line in range(first, first + place.states):
                w.store(w.load(lanes, line * STRIDE), lanes, (at.before + line) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, scene), generate


@intrinsic
def bound_bends(_typing, memory, slot, table, row, scene):
    """Bound how the gaps of eight lanes bend in a step."""
    place, margins = layout_of(scene.scene), method_rows_of(scene.scene).margins

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes, numbers = w.element(0, arguments[1]), w.element(2, arguments[3])
        if scene.scene.resolved is not None:
            sizes = [w.size(given) for given in w.rows(lanes, _inputs(scene.scene))]
            for element in range(place.elements):
                first = place.bounds + element * place.bound_size
                bends = [w.spread(numbers, first + column) for column in range(len(sizes))]
                w.store(w.sum(enumerate(bends), sizes), lanes, (margins + element) * STRIDE)
        return context.get_dummy_value()

    return types.void(memory, types.intp, table, types.intp, scene), generate


def _on_branches(scene: Scene, apply: Any) -> Any:
    """Make the body of an intrinsic that acts on eight lanes by the maps of their branches.

    ``apply(writer, lanes, maps, mask)``: for each set of branches on which some lanes are, with
    the addresses of the lanes and of the maps, and which of the lanes these are, None for all.
    """
    place, first = layout_of(scene), rows_of(scene).branches

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes = w.element(0, arguments[1])
        for number in range(place.branches):
            at = builder.add(arguments[3], _INTEGER(place.header + number * place.size))
            maps = w.element(2, at)
            if place.branches == 1:
                apply(w, lanes, maps, None)
                break
            mask = None
            for element in range(place.elements):
                engaged = 1.0 - (number >> element) % 2
                those = w.equal(lanes, first + BRANCH * element, engaged)
                mask = those if mask is None else builder.and_(mask, those)
            bits = builder.bitcast(mask, ir.IntType(VECTOR))
            with builder.if_then(builder.icmp_unsigned("!=", bits, bits.type(0))):
                apply(w, lanes, maps, mask)
        return context.get_dummy_value()

    return generate


@intrinsic
def move(_typing, memory, slot, table, row, scene):
    """Apply the map of its branches to each of eight lanes, state and tangent vector."""
    place, at = layout_of(scene.scene), rows_of(scene.scene)
    # What acts on nothing but itself has columns of zeros elsewhere.
    model = provider_of(scene.scene.model)
    states, elements = model.maps.apart(scene.scene.model)
    columns = {*states, *(place.states + 1 + element for element in elements)}

    def apply(w, lanes, maps, mask):
        given = {STATE: w.rows(lanes, _inputs(scene.scene))}
        if scene.scene.tangent is not None:
            given[at.tangent] = w.rows(lanes, _tangent_inputs(scene.scene))
        for line in range(place.states):
            factors = [
                (column, w.spread(maps, column * place.width + line))
                for column in range(place.columns)
                if line in states or column not in columns
            ]
            for target, inputs in given.items():
                value = w.sum([one for one in factors if one[0] < len(inputs)], inputs)
                w.put(value, lanes, target + line, mask)

    given = memory, types.intp, table, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def look_along(_typing, aside, slot, table, row, scene):
    """Compute the terms of all gaps along the step, without the mean error, as `move` does."""
    place, at = layout_of(scene.scene), aside_of(scene.scene)

    def apply(w, lanes, maps, mask):
        given = {0: w.rows(lanes, _inputs(scene.scene))}
        if scene.scene.tangent is not None:
            given[at.tangent_terms] = w.rows(lanes, _tangent_inputs(scene.scene))
        for element in range(place.elements):
            first = place.gap + element * place.columns * TERMS
            for term in range(TERMS):
                factors = [
                    (column, w.spread(maps, first + column * TERMS + term))
                    for column in range(place.columns)
                ]
                for target, inputs in given.items():
                    value = w.sum(factors[: len(inputs)], inputs)
                    row = at.gaps + element * at.gap_rows + target + term
                    w.put(value, lanes, row, mask)

    given = aside, types.intp, table, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def add_switch(_typing, aside, slot, table, row, scene):
    """Carry eight lanes to their branches: move state and tangent vector at the step's beginning.

    To them is added the integral from -1 to the moment of crossing of the `SWITCH` of the new
    branch, sum_k s^k p_k, times the gap: each p_k times what `sum_along` has made of it.
    """
    place, at, block = layout_of(scene.scene), aside_of(scene.scene), rows_of(scene.scene)

    def apply(w, lanes, maps, mask):
        given = {block.state_before: w.rows(lanes, range(at.sums, at.sums + TERMS))}
        if scene.scene.tangent is not None:
            sums = range(at.tangent_sums, at.tangent_sums + TERMS)
            given[block.tangent_before] = w.rows(lanes, sums)
        for element in range(place.elements):
            those = mask
            if place.elements > 1:
                those = w.builder.and_(mask, w.equal(lanes, at.element, float(element)))
            first = place.switch + element * TERMS * place.width
            for line in range(place.states):
                factors = [
                    (k, w.spread(maps, first + k * place.width + line)) for k in range(TERMS)
                ]
                for target, sums in given.items():
                    before = w.load(lanes, (target + line) * STRIDE)
                    value = w.builder.fadd(before, w.sum(factors, sums), flags=_FLAGS)
                    w.put(value, lanes, target + line, those)

    given = aside, types.intp, table, types.intp, scene
    return types.void(*given), _on_branches(scene.scene, apply)


@intrinsic
def sum_along(_typing, aside, scene):
    """Integrate what pushes eight lanes that cross, times s^k, from -1 to the moment of that.

    That is, for every k, the sum of the terms j, each times the integral of s^(j + k).
    """
    place, at = layout_of(scene.scene), aside_of(scene.scene)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lanes = w.element(0, _INTEGER(0))
        after, factor, edge = w.rows(lanes, (at.after, at.factor, at.edge))
        powers, integrals = {1: after}, []
        for n in range(1, 2 * TERMS):
            if n > 1:
                powers[n] = builder.fmul(powers[n // 2], powers[n - n // 2])
            begin = w.constant(-((-1.0) ** n) / n)
            integrals.append(w.multiply_add(powers[n], w.constant(1.0 / n), begin))
        given = {0: at.sums}
        if scene.scene.tangent is not None:
            given[at.tangent_terms] = at.tangent_sums
        for source, target in given.items():
            terms = w.rows(lanes, range(at.gaps + source, at.gaps + source + TERMS))
            for element in range(1, place.elements):
                first = at.gaps + element * at.gap_rows + source
                others = w.rows(lanes, range(first, first + TERMS))
                those = w.equal(lanes, at.element, float(element))
                terms = [builder.select(those, *pair) for pair in zip(others, terms, strict=True)]
            if source == 0:
                terms[0] = builder.fsub(terms[0], edge, flags=_FLAGS)
            for k in range(TERMS):
                value = w.sum(enumerate(terms), integrals[k:])
                w.put(builder.fmul(value, factor, flags=_FLAGS), lanes, target + k, None)
        return context.get_dummy_value()

    return types.void(aside, scene), generate


@intrinsic
def copy_lane(_typing, memory, slot, aside, n, scene):
    """Copy what a lane that crosses needs of itself to a place aside."""
    place, at, forced = layout_of(scene.scene), rows_of(scene.scene), method_rows_of(scene.scene)
    model = provider_of(scene.scene.model)
    copied = [*range(at.state_before, at.state_before + place.states)]
    if scene.scene.tangent is not None:
        copied += range(at.tangent_before, at.tangent_before + place.states)
    copied += [at.coefficients + column for column in model.gap_columns(scene.scene.model)]
    copied += range(at.branches, at.branches + BRANCH * place.elements)
    copied += [at.suspect]
    copied += range(forced.inputs, forced.inputs + place.columns - place.states)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        source, target = w.element(0, arguments[1]), w.element(2, arguments[3])
        for row in copied:
            at_row = [_INTEGER(row * STRIDE)]
            number = builder.load(builder.gep(source, at_row))
            builder.store(number, builder.gep(target, at_row))
        return context.get_dummy_value()

    return types.void(memory, types.intp, aside, types.intp, scene), generate


@intrinsic
def margins_of(_typing, memory, slot, scene):
    """Return how far each gap of a lane may stray from its cubic, a tuple."""
    first, count = method_rows_of(scene.scene).margins, layout_of(scene.scene).elements
    margins = types.UniTuple(types.float64, count)

    def generate(context, builder, signature, arguments):
        w = _Writer(context, builder, signature, arguments)
        lane = w.element(0, arguments[1])
        found = [
            builder.load(builder.gep(lane, [_INTEGER((first + element) * STRIDE)]))
            for element in range(count)
        ]
        return context.make_tuple(builder, margins, found)

    return margins(memory, types.intp, scene), generate


def _combination(forced: bool) -> Any:
    """Make a function that sums the columns of a map, each times an input of a lane."""

    @intrinsic
    def combine(_typing, numbers, target, inputs, table, at, scene):
        place = layout_of(scene.scene)
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

        return types.void(numbers, types.intp, types.intp, table, types.intp, scene), generate

    return combine


end_of = _combination(forced=True)
"""State at the end of the step: numbers, target, inputs, table, at, scene."""
tangent_end_of = _combination(forced=False)
"""The same of a tangent vector."""
