"""Numbers of one lane side by side, as explicit vectors along its states.

Such a line is filled up with zeros to whole vectors.

An estimate is predicted by matrices that every lane has of its own. A vector of lanes would have to
collect their numbers one by one, but those of one lane are neighbours.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import FASTMATH, first_element
from gearchaos_kernels.memory.rows import STRIDE, line_of

_DOUBLE = ir.DoubleType()
_FLAGS = tuple(sorted(FASTMATH))


class _Line:
    """Generates loads, stores and sums of lines of a scene."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        self.context, self.builder = context, builder
        self.arguments = tuple(zip(signature.args, arguments, strict=True))
        self.states = signature.args[-1].scene.feedback.states
        self.width = line_of(self.states)
        self.kind = ir.VectorType(_DOUBLE, self.width)

    def address(self, array: int, at: int, further: int = 0) -> Any:
        """Return the address of a number of an array; both are arguments, given by position."""
        kind, value = self.arguments[array]
        place = self.arguments[at][1]
        place = self.builder.add(place, ir.Constant(place.type, further))
        first = first_element(self.context, self.builder, kind, value)
        return self.builder.gep(first, [place])

    def parts(self, number: int) -> list[int]:
        """Return the positions of the parts of an argument that is a tuple."""
        kind, value = self.arguments[number]
        parts = [
            (one, self.builder.extract_value(value, part)) for part, one in enumerate(kind.types)
        ]
        first = len(self.arguments)
        self.arguments += tuple(parts)
        return list(range(first, first + len(parts)))

    def load(self, array: int, at: int, further: int = 0) -> Any:
        """Load a vector."""
        place = self.address(array, at, further)
        return self.builder.load(self.builder.bitcast(place, self.kind.as_pointer()), align=8)

    def load_states(self, array: int, at: int) -> Any:
        """Load numbers of all states that are not filled up, and fill them up."""
        kind = ir.VectorType(_DOUBLE, self.states)
        place = self.builder.bitcast(self.address(array, at), kind.as_pointer())
        index = ir.IntType(32)
        order = [index(min(number, self.states)) for number in range(self.width)]
        return self.builder.shuffle_vector(
            self.builder.load(place, align=8),
            ir.Constant(kind, [0.0] * self.states),
            ir.Constant(ir.VectorType(index, self.width), order),
        )

    def store(self, vector: Any, array: int, at: int) -> None:
        """Store a vector."""
        place = self.builder.bitcast(self.address(array, at), self.kind.as_pointer())
        self.builder.store(vector, place, align=8)

    def spread(self, vector: Any, number: int) -> Any:
        """Return a vector whose components all equal one component of a vector."""
        index = ir.IntType(32)
        order = ir.Constant(ir.VectorType(index, self.width), [index(number)] * self.width)
        return self.builder.shuffle_vector(vector, ir.Constant(self.kind, ir.Undefined), order)

    def gather(self, array: int, states: int, scales: int) -> Any:
        """Collect the states of one slot, times their scales.

        ``states``: the first row, and the slot; ``scales``: an array, and where they begin in it.
        """
        row, slot = self.parts(states)
        first = self.builder.mul(self.arguments[row][1], self.arguments[row][1].type(STRIDE))
        first = self.builder.add(first, self.arguments[slot][1])
        self.arguments += ((types.intp, first),)
        begin = len(self.arguments) - 1
        vector = ir.Constant(self.kind, [0.0] * self.width)
        for number in range(self.states):
            one = self.builder.load(self.address(array, begin, number * STRIDE))
            vector = self.builder.insert_element(vector, one, ir.IntType(32)(number))
        return self.builder.fmul(vector, self.load_states(*self.parts(scales)), flags=_FLAGS)

    def total(self, vector: Any) -> Any:
        """Return the sum of the components of a vector, in pairs."""
        parts = [
            self.builder.extract_element(vector, ir.IntType(32)(number))
            for number in range(self.states)
        ]
        while len(parts) > 1:
            odd = parts[len(parts) // 2 * 2 :]
            pairs = zip(parts[0::2], parts[1::2], strict=False)
            parts = [self.builder.fadd(a, b, flags=_FLAGS) for a, b in pairs] + odd
        return parts[0]

    def number(self, array: int, place: Any, further: int = 0) -> Any:
        """Load one number of an array, at a place that is known at run time, or from its begin."""
        kind, value = self.arguments[array]
        first = first_element(self.context, self.builder, kind, value)
        place = ir.IntType(64)(further) if place is None else place
        return self.builder.load(self.builder.gep(first, [place]))

    def spread_number(self, number: Any) -> Any:
        """Return a vector whose components all equal a number."""
        nothing = ir.Constant(self.kind, ir.Undefined)
        return self.spread(self.builder.insert_element(nothing, number, ir.IntType(32)(0)), 0)

    def argument(self, number: int) -> Any:
        """Return a vector whose components all equal an argument."""
        return self.spread_number(self.arguments[number][1])

    def multiply_add(self, a: Any, b: Any, c: Any) -> Any:
        """Return a b + c."""
        return self.builder.fadd(c, self.builder.fmul(a, b, flags=_FLAGS), flags=_FLAGS)

    def times(self, array: int, at: int, factors: Any, first: Any) -> Any:
        """Return a vector plus the columns of a matrix times the components of another one.

        Even and odd columns are summed apart, in parallel.
        """
        begin = self.builder.mul(self.arguments[at][1], self.arguments[at][1].type(self.states))
        self.arguments += ((types.intp, begin),)
        number_of_begin = len(self.arguments) - 1
        sums = [first, ir.Constant(self.kind, [0.0] * self.width)]
        for number in range(self.states):
            factor = self.spread(factors, number)
            column = self.load(array, number_of_begin, number * self.width)
            sums[number % 2] = self.multiply_add(column, factor, sums[number % 2])
        return self.builder.fadd(*sums, flags=_FLAGS)


@intrinsic
def gather_line(_typing, memory, target, states, scales, scene):
    """Store the states of one slot, times their scales; see `_Line.gather`."""

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        line.store(line.gather(0, 2, 3), 0, 1)
        return context.get_dummy_value()

    return types.void(memory, types.intp, states, scales, scene), generate


@intrinsic
def add_line(_typing, memory, target, factor, array, at, scene):
    """Add the numbers of an array, from a place on, times a factor."""

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        total = line.multiply_add(line.load(3, 4), line.argument(2), line.load(0, 1))
        line.store(total, 0, 1)
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.float64, array, types.intp, scene), generate


@intrinsic
def scale_line(_typing, memory, target, factor, scene):
    """Multiply the numbers of one state by a factor."""

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        line.store(builder.fmul(line.load(0, 1), line.argument(2), flags=_FLAGS), 0, 1)
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.float64, scene), generate


@intrinsic
def product_of_line(_typing, memory, source, array, at, scene):
    """Return the scalar product of the numbers of one state and those of an array."""

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        return line.total(builder.fmul(line.load(0, 1), line.load(2, 3), flags=_FLAGS))

    return types.float64(memory, types.intp, array, types.intp, scene), generate


@intrinsic
def product_of_deviation(_typing, memory, source, points, array, at, scene):
    """Return the same of the deviation of one state from a point, which has the same place."""

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        deviation = builder.fsub(line.load(0, 1), line.load(2, 4), flags=_FLAGS)
        return line.total(builder.fmul(deviation, line.load(3, 4), flags=_FLAGS))

    return types.float64(memory, types.intp, points, array, types.intp, scene), generate


@intrinsic
def correct_line(_typing, memory, target, states, scales, measured, correction, scene):
    """Correct an estimate z by measured states y of a slot without noise: z + L (y - z).

    ``states`` and ``scales``: see `_Line.gather`; ``measured``: numbers of the measured states;
    ``correction``: the columns of L after each other, and where they begin.
    """

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        row, slot = line.parts(2)
        sizes, first_size = line.parts(3)
        columns, begin = line.parts(5)
        total = line.load(0, 1)
        for signal in range(signature.args[-1].scene.feedback.signals):
            state = line.number(4, None, signal)
            place = builder.add(line.arguments[row][1], state)
            place = builder.mul(place, place.type(STRIDE))
            value = line.number(0, builder.add(place, line.arguments[slot][1]))
            size = line.number(sizes, builder.add(line.arguments[first_size][1], state))
            estimate = line.number(0, builder.add(line.arguments[1][1], state))
            error = builder.fsub(builder.fmul(value, size, flags=_FLAGS), estimate, flags=_FLAGS)
            column = line.load(columns, begin, signal * line.width)
            total = line.multiply_add(column, line.spread_number(error), total)
        line.store(total, 0, 1)
        return context.get_dummy_value()

    given = memory, types.intp, states, scales, measured, correction, scene
    return types.void(*given), generate


@intrinsic
def predict_line(_typing, memory, target, points, maps, effort, scene):
    """Replace an estimate z by what follows it: r' + b u + A (z - r).

    ``points``: the points of the orbit, and the places of r and r' among them; ``maps``: vectors b,
    and matrices A whose columns follow each other, both in the order of the points.
    """

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        orbit, place, then = line.parts(2)
        responses, columns = line.parts(3)
        deviation = builder.fsub(line.load(0, 1), line.load(orbit, place), flags=_FLAGS)
        total = line.times(columns, place, deviation, line.load(orbit, then))
        # Last, because the input takes long to compute.
        total = line.multiply_add(line.load(responses, place), line.argument(4), total)
        line.store(total, 0, 1)
        return context.get_dummy_value()

    place = types.intp
    return types.void(memory, place, points, maps, types.float64, scene), generate


@intrinsic
def vary_line(_typing, memory, target, place, maps, varied, scene):
    """Replace the variation of an estimate in the same way: b times that of u, and A that of z."""

    def generate(context, builder, signature, arguments):
        line = _Line(context, builder, signature, arguments)
        responses, columns = line.parts(3)
        nothing = ir.Constant(line.kind, [0.0] * line.width)
        total = line.times(columns, 2, line.load(0, 1), nothing)
        total = line.multiply_add(line.load(responses, 2), line.argument(4), total)
        line.store(total, 0, 1)
        return context.get_dummy_value()

    place = types.intp
    return types.void(memory, place, place, maps, types.float64, scene), generate
