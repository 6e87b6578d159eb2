"""Cosine and sine of harmonics of the mesh phase, as tuples of compiled code.

The flags of a model that uses them have ``orders``, the orders of the harmonics.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.models.mesh_phase import nearest_row, turned
from gearchaos_kernels.plan import Floats


def waves_of(orders: Sequence[int], phase: Floats) -> Floats:
    """Return cosine and sine of every harmonic at mesh phases in rad, shape (phases, waves)."""
    turns = np.outer(phase, orders)
    waves = np.stack([np.cos(turns), np.sin(turns)], axis=2)
    return np.ascontiguousarray(waves.reshape(phase.size, 2 * len(orders)))


@intrinsic
def waves_in_row(_typing_context: Any, table: Any, row: Any, scene: Any) -> Any:
    """Return a row of a table as a tuple."""
    count = 2 * len(scene.scene.model.orders)
    returned = types.UniTuple(types.float64, count)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        integer = ir.IntType(types.intp.bitwidth)
        first = builder.mul(arguments[1], integer(count))
        found = [
            builder.load(builder.gep(array.data, [builder.add(first, integer(number))]))
            for number in range(count)
        ]
        return context.make_tuple(builder, returned, found)

    return returned(table, types.intp, scene), generate


@intrinsic
def _paired(_typing_context: Any, values: Any) -> Any:
    """Return the cosines and the sines among the values of the waves, two tuples."""
    half = types.UniTuple(types.float64, len(values) // 2)
    returned = types.UniTuple(half, 2)

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        numbers = [builder.extract_value(arguments[0], at) for at in range(len(values))]
        halves = [context.make_tuple(builder, half, numbers[at::2]) for at in range(2)]
        return context.make_tuple(builder, returned, halves)

    return returned(values), generate


@intrinsic
def _harmonics(_typing_context: Any, scene: Any) -> Any:
    """Return the harmonics of the waves, a tuple of constants."""
    numbers = scene.scene.model.orders
    returned = types.UniTuple(types.float64, len(numbers))

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        found = [ir.Constant(ir.DoubleType(), float(number)) for number in numbers]
        return context.make_tuple(builder, returned, found)

    return returned(scene), generate


@intrinsic
def _interleaved(_typing_context: Any, pairs: Any) -> Any:
    """Return the numbers of a tuple of (sine, cosine) as cosine, sine, cosine, sine, ..."""
    returned = types.UniTuple(types.float64, 2 * len(pairs))

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        numbers = []
        for at in range(len(pairs)):
            pair = builder.extract_value(arguments[0], at)
            numbers += [builder.extract_value(pair, 1), builder.extract_value(pair, 0)]
        return context.make_tuple(builder, returned, numbers)

    return returned(pairs), generate


@scalar
def waves_within(table, number, fraction, scene):
    """Return the waves at a fraction of a step, from the nearest row of the grid."""
    row, angle = nearest_row(number, fraction, table.shape[0])
    cosines, sines = _paired(waves_in_row(table, row, scene))
    return _interleaved(each(_turned_harmonic, sines, cosines, _harmonics(scene), angle))


@scalar
def _turned_harmonic(sine, cosine, harmonic, angle):
    """Return sine and cosine of a harmonic of a phase that is an angle further on."""
    return turned(sine, cosine, harmonic * angle)
