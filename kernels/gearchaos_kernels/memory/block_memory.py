"""Read and write the memory of a block in compiled code; `rows` has its layout."""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.compilation import CACHE_LINE, first_element, maker, scalar
from gearchaos_kernels.memory.rows import (
    BRANCH,
    LANES,
    STATE,
    STRIDE,
    VECTOR,
    ContactBranch,
    State,
    control_rows,
    rows,
    rows_of,
)
from gearchaos_kernels.scene import Scene, provider_of

_ITEM = np.dtype(np.float64).itemsize


@maker
def aligned_memory(count):
    """Return uninitialised memory for n rows of one block, which starts on a cache line."""
    size = count * STRIDE
    memory = np.empty(size + CACHE_LINE // _ITEM)
    misfit = (CACHE_LINE - memory.ctypes.data % CACHE_LINE) % CACHE_LINE // _ITEM
    return memory[misfit : misfit + size]


@scalar
def slots_of(lanes):
    """Return the number of slots in as many whole vectors as the lanes of a block need.

    The slots after those are neither stepped nor scaled.
    """
    vectors = (lanes + VECTOR - 1) // VECTOR
    # The mask changes no value. It bounds loops over slots, which are not vectorised otherwise.
    return VECTOR * (1 + ((vectors - 1) & (LANES // VECTOR - 1)))


def _pointer(context: Any, builder: Any, kind: Any, memory: Any, at: tuple[Any, Any, int]) -> Any:
    """Return the address of a number: ``at`` is a row, a slot, and a number of further rows."""
    first, slot, further = at
    data = first_element(context, builder, kind, memory)
    row = builder.add(first, ir.Constant(first.type, further))
    stride = ir.Constant(row.type, STRIDE)
    return builder.gep(data, [builder.add(builder.mul(row, stride), slot)])


@intrinsic
def load(_typing_context: Any, memory: Any, row: Any, slot: Any, record: Any) -> Any:
    """Return a record, a named tuple of numbers, from consecutive rows of one slot."""
    count = len(record.instance_class._fields)
    loaded = types.NamedUniTuple(memory.dtype, count, record.instance_class)

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, first, slot, _ = arguments
        numbers = [
            builder.load(_pointer(context, builder, memory, array, (first, slot, number)))
            for number in range(count)
        ]
        return context.make_tuple(builder, loaded, numbers)

    return loaded(memory, types.intp, types.intp, record), generate


@intrinsic
def load_like(_typing_context: Any, memory: Any, row: Any, slot: Any, like: Any) -> Any:
    """Return a tuple as long as another one from consecutive rows of one slot."""
    loaded = types.UniTuple(memory.dtype, len(like))

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, first, slot, _ = arguments
        numbers = [
            builder.load(_pointer(context, builder, memory, array, (first, slot, number)))
            for number in range(len(like))
        ]
        return context.make_tuple(builder, loaded, numbers)

    return loaded(memory, types.intp, types.intp, like), generate


@intrinsic
def store(_typing_context: Any, memory: Any, row: Any, slot: Any, record: Any) -> Any:
    """Write a record of numbers into consecutive rows of one slot."""

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, first, slot, values = arguments
        for number in range(len(record)):
            value = builder.extract_value(values, number)
            builder.store(value, _pointer(context, builder, memory, array, (first, slot, number)))
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, record), generate


@intrinsic
def read_lane(_typing_context: Any, memory: Any, slot: Any, scene: Any) -> Any:
    """Return the coefficients of a lane, a `Model.lane`."""
    lane = provider_of(scene.scene.model).lane
    loaded = types.NamedUniTuple(memory.dtype, len(lane._fields), lane)
    at = rows_of(scene.scene).coefficients

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, slot, _ = arguments
        first = ir.Constant(slot.type, at)
        numbers = [
            builder.load(_pointer(context, builder, memory, array, (first, slot, number)))
            for number in range(len(lane._fields))
        ]
        return context.make_tuple(builder, loaded, numbers)

    return loaded(memory, types.intp, scene), generate


@scalar
def fill_lane(memory, slot, coefficients, scene):
    """Store the coefficients of a lane, shape (coefficients,), and return them as a record."""
    for column in range(coefficients.shape[0]):
        memory[(rows(scene).coefficients + column) * STRIDE + slot] = coefficients[column]
    return read_lane(memory, slot, scene)


@scalar
def fill(memory, row, slot, scale, source):
    """Store a state or tangent vector, given in the units of the equations, shape (states,)."""
    for column in range(scale.shape[0]):
        memory[(row + column) * STRIDE + slot] = source[column] / scale[column]


@scalar
def take(memory, row, slot, scale, target):
    """Write a state or tangent vector into an array (states,), in the units of the equations."""
    for column in range(scale.shape[0]):
        target[column] = memory[(row + column) * STRIDE + slot] * scale[column]


def _coordinates(scene: Any, number: Any) -> tuple[Any, list[int | None]]:
    """Return the type of the coordinates of a scene, and the number of each among its states."""
    model = provider_of(scene.scene.model)
    there = model.present(scene.scene.model)
    places = [2 * sum(there[:field]) if there[field] else None for field in range(len(there))]
    return types.NamedUniTuple(number, len(there), model.coordinates), places


@intrinsic
def read_state(_typing_context: Any, memory: Any, first: Any, slot: Any, scene: Any) -> Any:
    """Return a state from consecutive rows; an absent coordinate is the constant 0."""
    kind, places = _coordinates(scene, memory.dtype)
    state = types.NamedUniTuple(kind, 2, State)

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, first, slot, _ = arguments
        parts = []
        for rate in range(2):
            numbers = [
                ir.Constant(ir.DoubleType(), 0.0)
                if place is None
                else builder.load(
                    _pointer(context, builder, memory, array, (first, slot, place + rate))
                )
                for place in places
            ]
            parts.append(context.make_tuple(builder, kind, numbers))
        return context.make_tuple(builder, state, parts)

    return state(memory, types.intp, types.intp, scene), generate


@intrinsic
def write_state(
    _typing_context: Any, memory: Any, first: Any, slot: Any, state: Any, scene: Any
) -> Any:
    """Store the coordinates of a state that the scene has, in consecutive rows."""
    _, places = _coordinates(scene, memory.dtype)

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, first, slot, values, _ = arguments
        for rate in range(2):
            for field, place in enumerate(places):
                if place is not None:
                    at = first, slot, place + rate
                    value = builder.extract_value(values, [rate, field])
                    builder.store(value, _pointer(context, builder, memory, array, at))
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, state, scene), generate


@intrinsic
def read_branches(_typing_context: Any, memory: Any, slot: Any, scene: Any) -> Any:
    """Return the active branch of each element of a lane."""
    count = provider_of(scene.scene.model).elements(scene.scene.model)
    kind = types.NamedUniTuple(memory.dtype, BRANCH, ContactBranch)
    branches, at = types.UniTuple(kind, count), rows_of(scene.scene).branches

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, slot, _ = arguments
        first = ir.Constant(slot.type, at)
        found = []
        for element in range(count):
            numbers = [
                builder.load(
                    _pointer(
                        context, builder, memory, array, (first, slot, BRANCH * element + field)
                    )
                )
                for field in range(BRANCH)
            ]
            found.append(context.make_tuple(builder, kind, numbers))
        return context.make_tuple(builder, branches, found)

    return branches(memory, types.intp, scene), generate


@scalar
def write_branches(memory, slot, branches, scene):
    """Store the active branch of each element of a lane."""
    for element in range(len(branches)):
        store(memory, rows(scene).branches + BRANCH * element, slot, branches[element])


@scalar
def state_of(memory, slot, scene):
    """Return the state of a lane."""
    return read_state(memory, STATE, slot, scene)


@scalar
def state_before(memory, slot, scene):
    """Return the state of a lane before the step."""
    return read_state(memory, rows(scene).state_before, slot, scene)


def numbers_of(count: Callable[[Scene], int]) -> Any:
    """Return an intrinsic that reads consecutive numbers of an array as a tuple.

    ``count(scene)``: their number. The arguments of the intrinsic are the array, the place of the
    first number, and the scene.
    """

    @intrinsic
    def numbers_at(_typing_context: Any, array: Any, at: Any, scene: Any) -> Any:
        size = count(scene.scene)
        numbers = types.UniTuple(types.float64, size)

        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            first = first_element(context, builder, array, arguments[0])
            places = [
                builder.add(arguments[1], ir.Constant(arguments[1].type, n)) for n in range(size)
            ]
            found = [builder.load(builder.gep(first, [place])) for place in places]
            return context.make_tuple(builder, numbers, found)

        return numbers(array, types.intp, scene), generate

    return numbers_at


numbers_of_elements = numbers_of(lambda scene: provider_of(scene.model).elements(scene.model))
"""Read one number per element; arguments: array, place of the first one, scene."""


@scalar
def read_varied_input(memory, slot, scene):
    """Return the variation of the steady input along the tangent vector, None without control."""
    if scene.control is None:
        return None
    return memory[control_rows(scene).varied * STRIDE + slot]
