"""Products of the numbers of several steps that lie side by side, as explicit vectors.

LLVM does not vectorise such short loops, because it cannot rule out that the arrays overlap.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import FASTMATH, first_element

TOGETHER = 8
"""Steps whose series are computed together: they fill vectors and fit into the cache."""

_FLAGS = tuple(sorted(FASTMATH))
_VECTOR = ir.VectorType(ir.DoubleType(), TOGETHER)


@intrinsic
def add_products(_typing, target, i, a, j, b, k):
    """Add the products of `TOGETHER` numbers of two arrays to those of a target.

    The arrays are contiguous. ``i``, ``j``, ``k``: numbers of the first elements, counted over all
    axes.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places = [
            builder.bitcast(
                builder.gep(first_element(context, builder, kind, array), [at]),
                _VECTOR.as_pointer(),
            )
            for kind, array, at in zip(
                signature.args[::2], arguments[::2], arguments[1::2], strict=True
            )
        ]
        total, one, other = (builder.load(place, align=8) for place in places)
        product = builder.fmul(one, other, flags=_FLAGS)
        builder.store(builder.fadd(total, product, flags=_FLAGS), places[0], align=8)
        return context.get_dummy_value()

    place = types.intp
    return types.void(target, place, a, place, b, place), generate
