"""Arithmetic of records and tuples whose length depends on the scene, unrolled when compiled."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import FASTMATH

_FLAGS = tuple(sorted(FASTMATH))
_DOUBLE = ir.DoubleType()


@intrinsic
def each(typing_context: Any, function: Any, *given: Any) -> Any:
    """Call a compiled function with each element of the given tuples, and return a tuple.

    Plain tuples are passed element by element. Everything else, such as a number or a named tuple,
    is passed to every call.
    """
    mapped = [isinstance(kind, types.BaseAnonymousTuple) for kind in given]
    count = next(len(kind) for kind, maps in zip(given, mapped, strict=True) if maps)

    def arguments_of(number: int) -> tuple[Any, ...]:
        kinds = zip(given, mapped, strict=True)
        return tuple(kind.types[number] if maps else kind for kind, maps in kinds)

    signatures = [
        function.get_call_type(typing_context, arguments_of(number), {}) for number in range(count)
    ]
    returned = types.BaseTuple.from_types(tuple(one.return_type for one in signatures))

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        values = [builder.extract_value(arguments[1], number) for number in range(len(given))]
        results = []
        for number, signature in enumerate(signatures):
            passed = [
                builder.extract_value(value, number) if maps else value
                for value, maps in zip(values, mapped, strict=True)
            ]
            implementation = context.get_function(function, signature)
            context.add_linking_libs(getattr(implementation, "libs", ()))
            results.append(implementation(builder, passed))
        return context.make_tuple(builder, returned, results)

    return returned(function, types.StarArgTuple.from_types(given)), generate


@intrinsic
def along(_typing_context: Any, a: Any, factor: Any, b: Any) -> Any:
    """Return a + factor b of two records of numbers, field by field."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, number, second = arguments
        number = context.cast(builder, number, signature.args[1], types.float64)
        sums = [
            builder.fadd(
                builder.extract_value(first, field),
                builder.fmul(number, builder.extract_value(second, field), flags=_FLAGS),
                flags=_FLAGS,
            )
            for field in range(len(a))
        ]
        return context.make_tuple(builder, a, sums)

    return a(a, factor, b), generate


@intrinsic
def as_mask(_typing_context: Any, conditions: Any) -> Any:
    """Return the sum of 2**n over the conditions n of a tuple that are true."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        mask = None
        for number in range(len(conditions)):
            condition = builder.extract_value(arguments[0], number)
            bit = builder.trunc(condition, ir.IntType(1)) if condition.type.width > 1 else condition
            value = builder.select(bit, _DOUBLE(2.0**number), _DOUBLE(0.0))
            mask = value if mask is None else builder.fadd(mask, value, flags=_FLAGS)
        return mask

    return types.float64(conditions), generate


def zeros_of(count: Callable[[Any], int]) -> Any:
    """Return an intrinsic that returns a tuple of zeros; ``count(scene)``: how many."""

    @intrinsic
    def zeros(_typing_context: Any, scene: Any) -> Any:
        returned = types.UniTuple(types.float64, count(scene.scene))

        def generate(context: Any, _builder: Any, _signature: Any, _arguments: Any) -> Any:
            return context.get_constant_null(returned)

        return returned(scene), generate

    return zeros


@intrinsic
def scaled(_typing_context: Any, record: Any, factor: Any) -> Any:
    """Return a record of numbers, each of them multiplied by a factor."""

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        given, number = arguments
        products = [
            builder.fmul(builder.extract_value(given, field), number, flags=_FLAGS)
            for field in range(len(record))
        ]
        return context.make_tuple(builder, record, products)

    return record(record, types.float64), generate
