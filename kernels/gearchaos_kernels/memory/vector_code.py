"""Instructions on vectors of eight lanes, for loops that LLVM does not vectorise by itself."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import alloca_once_value, for_range

from gearchaos_kernels.compilation import FASTMATH, first_element
from gearchaos_kernels.memory.rows import STRIDE, VECTOR

DOUBLE, INTEGER = ir.DoubleType(), ir.IntType(types.intp.bitwidth)
"""Types of numbers and of indices."""

FLAGS = tuple(sorted(FASTMATH))
"""Flags of all operations on numbers."""

_INDEX = ir.IntType(32)


class VectorCode:
    """Generates the instructions of one function: loads, stores and sums of vectors."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        self.context, self.builder = context, builder
        self.arguments = tuple(zip(signature.args, arguments, strict=True))

    def element(self, number: int, at: Any) -> Any:
        """Return the address of an element of an array; ``number``: which argument it is."""
        kind, array = self.arguments[number]
        first = first_element(self.context, self.builder, kind, array)
        return self.builder.gep(first, [at])

    def moved(self, pointer: Any, count: Any, stride: int = 1) -> Any:
        """Return an address, count * stride numbers further; ``count`` is known at run time."""
        return self.builder.gep(pointer, [self.builder.mul(count, INTEGER(stride))])

    def load(self, pointer: Any, at: int, width: int = VECTOR) -> Any:
        """Load a vector that begins ``at`` numbers after an address."""
        kind = ir.VectorType(DOUBLE, width).as_pointer()
        place = self.builder.gep(pointer, [INTEGER(at)])
        return self.builder.load(self.builder.bitcast(place, kind), align=8)

    def store(self, value: Any, pointer: Any, at: int) -> None:
        """Store a vector that begins ``at`` numbers after an address."""
        place = self.builder.gep(pointer, [INTEGER(at)])
        self.builder.store(value, self.builder.bitcast(place, value.type.as_pointer()), align=8)

    def rows(self, vector: Any, numbers: Iterable[int]) -> list[Any]:
        """Load rows of eight lanes."""
        return [self.load(vector, row * STRIDE) for row in numbers]

    def put(self, value: Any, vector: Any, row: int, mask: Any) -> None:
        """Store a row of eight lanes, or of the lanes of a mask."""
        if mask is not None:
            value = self.builder.select(mask, value, self.load(vector, row * STRIDE))
        self.store(value, vector, row * STRIDE)

    def equal(self, vector: Any, row: int, number: float) -> Any:
        """Return the mask of those of eight lanes in which a row equals a number."""
        given = self.load(vector, row * STRIDE)
        return self.builder.fcmp_ordered("==", given, self.constant(number))

    def bits(self, mask: Any) -> Any:
        """Return a mask of eight lanes as an integer, a bit for each of them."""
        return self.builder.bitcast(mask, ir.IntType(VECTOR))

    def any(self, mask: Any) -> Any:
        """Return whether a mask contains any of eight lanes."""
        bits = self.bits(mask)
        return self.builder.icmp_unsigned("!=", bits, bits.type(0))

    def spread(self, pointer: Any, at: int, width: int = VECTOR) -> Any:
        """Load a number and return a vector whose components all equal it."""
        return self.splat(self.builder.load(self.builder.gep(pointer, [INTEGER(at)])), width)

    def splat(self, number: Any, width: int = VECTOR, of: Any = DOUBLE) -> Any:
        """Return a vector whose components all equal a number."""
        nothing = ir.Constant(ir.VectorType(of, width), ir.Undefined)
        first = self.builder.insert_element(nothing, number, _INDEX(0))
        order = ir.Constant(ir.VectorType(_INDEX, width), [_INDEX(0)] * width)
        return self.builder.shuffle_vector(first, nothing, order)

    def constant(self, number: float) -> Any:
        """Return a vector whose components all equal a constant."""
        return ir.Constant(ir.VectorType(DOUBLE, VECTOR), [number] * VECTOR)

    def add(self, a: Any, b: Any) -> Any:
        """Return a + b."""
        return self.builder.fadd(a, b, flags=FLAGS)

    def times(self, a: Any, b: Any) -> Any:
        """Return a b."""
        return self.builder.fmul(a, b, flags=FLAGS)

    def negative(self, a: Any) -> Any:
        """Return -a."""
        return self.builder.fneg(a, flags=FLAGS)

    def greater(self, a: Any, b: Any) -> Any:
        """Return the mask of the components in which a exceeds b."""
        return self.builder.fcmp_ordered(">", a, b)

    def smaller(self, a: Any, b: Any) -> Any:
        """Return the mask of the components in which b exceeds a."""
        return self.builder.fcmp_ordered("<", a, b)

    def choose(self, mask: Any, a: Any, b: Any) -> Any:
        """Return a where a mask is true, and b elsewhere."""
        return self.builder.select(mask, a, b)

    def size(self, vector: Any) -> Any:
        """Return the absolute values of the components of a vector."""
        kind = vector.type
        name = f"llvm.fabs.v{kind.count}f64"
        module = self.builder.module
        declared = module.globals.get(name)
        fabs = declared or ir.Function(module, ir.FunctionType(kind, [kind]), name)
        return self.builder.call(fabs, [vector])

    def multiply_add(self, a: Any, b: Any, c: Any) -> Any:
        """Return a b + c, or a b if c is None."""
        product = self.builder.fmul(a, b, flags=FLAGS)
        return product if c is None else self.builder.fadd(product, c, flags=FLAGS)

    def sum(self, factors: Iterable[tuple[int, Any]], terms: Sequence[Any]) -> Any:
        """Return a sum of products as two partial sums, which the processor runs in parallel.

        One is over even numbers, the other over odd ones, so that leaving out columns of zeros
        changes no bit.
        """
        parts: list[Any] = [None, None]
        for number, factor in factors:
            parts[number % 2] = self.multiply_add(factor, terms[number], parts[number % 2])
        return self.builder.fadd(*parts, flags=FLAGS)

    def repeat(
        self, count: Any, begin: int, values: Sequence[Any], body: Callable[..., Sequence[Any]]
    ) -> list[Any]:
        """Return values after a loop that replaces them by ``body(number, values)``.

        ``number`` runs from ``begin`` to ``count``, without it; ``count`` is known at run time.
        """
        kept = [alloca_once_value(self.builder, value) for value in values]
        for place, value in zip(kept, values, strict=True):
            self.builder.store(value, place)
        with for_range(self.builder, count, INTEGER(begin)) as loop:
            after = body(loop.index, [self.builder.load(place) for place in kept])
            for place, value in zip(kept, after, strict=True):
                self.builder.store(value, place)
        return [self.builder.load(place) for place in kept]
