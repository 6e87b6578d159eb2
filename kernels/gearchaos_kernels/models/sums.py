"""Sums of products of a lane's coefficients with other numbers, as compiled code without loops."""

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import FASTMATH

_FLAGS = tuple(sorted(FASTMATH))
_DOUBLE = ir.DoubleType()

Terms = Sequence[Sequence[tuple[int | None, int]]]
"""For each sum its terms: number of the coefficient, None for 1, and number of the other factor."""


def _flat(builder: Any, kind: Any, value: Any) -> list[Any]:
    """Return the numbers of a value: of itself, or of a tuple of any depth."""
    if not isinstance(kind, types.BaseTuple):
        return [value]
    parts = zip(kind.types, range(len(kind)), strict=True)
    return [
        number
        for part, at in parts
        for number in _flat(builder, part, builder.extract_value(value, at))
    ]


def sums(terms: Callable[[Any], Terms], record: Callable[[Any], Any] | None = None) -> Any:
    """Return an intrinsic that computes sums of products.

    ``terms(flags)``: the sums for these flags of the model. The arguments of the intrinsic are the
    lane, the scene, and numbers or tuples, whose numbers are counted through. It returns a tuple of
    the sums, or the named tuple ``record(flags)``.
    """

    @intrinsic
    def summed(_typing_context: Any, lane: Any, scene: Any, *given: Any) -> Any:
        flags = scene.scene.model
        wanted = terms(flags)
        if record is None:
            returned = types.UniTuple(types.float64, len(wanted))
        else:
            returned = types.NamedUniTuple(types.float64, len(wanted), record(flags))

        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            numbers = _flat(builder, types.Tuple(given), arguments[2])
            results = []
            for one in wanted:
                total = None
                for coefficient, source in one:
                    value = numbers[source]
                    if coefficient is not None:
                        factor = builder.extract_value(arguments[0], coefficient)
                        value = builder.fmul(factor, value, flags=_FLAGS)
                    total = value if total is None else builder.fadd(total, value, flags=_FLAGS)
                results.append(_DOUBLE(0.0) if total is None else total)
            return context.make_tuple(builder, returned, results)

        return returned(lane, scene, types.StarArgTuple.from_types(given)), generate

    return summed
