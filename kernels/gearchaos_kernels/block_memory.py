"""A block of lanes in memory, and how compiled code reads and writes it; see `rows`."""

from collections import namedtuple
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels import rows
from gearchaos_kernels.compilation import CACHE_LINE, first_element, part, scalar
from gearchaos_kernels.rows import STRIDE, Branch, Coordinates, Directions, Lane, State
from gearchaos_kernels.system import Plan, System

Present = namedtuple(
    "Present",
    "pitch_error phase teeth undamped wide stiffness_variation backlash transverse axial "
    "resolved contact loads tangent flow_map",
)
"""What a compiled loop has: True where it is there, None where the compiler removes it."""


def flags(system: System, plan: Plan) -> Present:
    """Tell in types what the loop of a scene has, so that every scene is compiled for itself."""
    effects = system.effects
    teeth = system.teeth if effects.pitch_error else None
    resolved = effects.backlash and (plan.resolved or plan.method == "flow_map")
    values = {
        **effects._asdict(),
        "phase": effects.pitch_error and teeth is None and bool(np.any(system.groups.error_phase)),
        "teeth": teeth is not None,
        "undamped": teeth is not None and system.physical,
        "wide": teeth is not None and teeth.pairs_in_mesh > rows.NARROW,
        "resolved": resolved,
        "contact": resolved and plan.contact,
        "loads": plan.told_by_steps,
        "tangent": plan.tangent,
        "flow_map": plan.method == "flow_map",
    }
    return Present(**{name: present or None for name, present in values.items()})


_ITEM = np.dtype(np.float64).itemsize


@part
def aligned_memory(more=0):
    """Return memory for one block, and so many rows more, that starts on a cache line."""
    size = (rows.ROWS + more) * STRIDE
    memory = np.empty(size + CACHE_LINE // _ITEM)
    misfit = (CACHE_LINE - memory.ctypes.data % CACHE_LINE) % CACHE_LINE // _ITEM
    return memory[misfit : misfit + size]


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any, number: int) -> Any:
    """Address of one row of a slot: arguments are memory, row, slot."""
    first = first_element(context, builder, signature.args[0], arguments[0])
    row = builder.add(arguments[1], ir.Constant(arguments[1].type, number))
    stride = ir.Constant(row.type, STRIDE)
    index = builder.add(builder.mul(row, stride), arguments[2])
    return builder.gep(first, [index])


@intrinsic
def load(_typing_context: Any, memory: Any, row: Any, slot: Any, record: Any) -> Any:
    """Return a record, a named tuple of numbers, from consecutive rows of one slot."""
    count = len(record.instance_class._fields)
    loaded = types.NamedUniTuple(memory.dtype, count, record.instance_class)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointers = [_pointer(context, builder, signature, arguments, n) for n in range(count)]
        return context.make_tuple(builder, loaded, [builder.load(p) for p in pointers])

    return loaded(memory, types.intp, types.intp, record), generate


@intrinsic
def store(_typing_context: Any, memory: Any, row: Any, slot: Any, record: Any) -> Any:
    """Write a record of numbers into consecutive rows of one slot."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        for number in range(len(record)):
            value = builder.extract_value(arguments[3], number)
            builder.store(value, _pointer(context, builder, signature, arguments, number))
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, record), generate


@scalar
def fill_lane(memory, slot, coefficients):
    """Store the coefficients of a lane, shape (fields of `Lane`,), and return them."""
    for column in range(coefficients.shape[0]):
        memory[(rows.COEFFICIENTS + column) * STRIDE + slot] = coefficients[column]
    return read_lane(memory, slot)


@scalar
def read_lane(memory, slot):
    """Return the coefficients of a lane."""
    return load(memory, rows.COEFFICIENTS, slot, Lane)


@scalar
def fill(memory, row, slot, scale, source):
    """Store a state or tangent vector, shape (states,) and in the units of eq. 13."""
    for column in range(scale.shape[0]):
        memory[(row + column) * STRIDE + slot] = source[column] / scale[column]


@scalar
def take(memory, row, slot, scale, target):
    """Write a state or tangent vector in the units of eq. 13 into an array of shape (states,)."""
    for column in range(scale.shape[0]):
        target[column] = memory[(row + column) * STRIDE + slot] * scale[column]


@scalar
def read_state(memory, first, slot, present):
    """Return a state from the rows from ``first`` on; an absent pair is the constant 0."""
    return State(
        read_coordinates(memory, first, slot, present),
        read_coordinates(memory, first + 1, slot, present),
    )


@scalar
def read_coordinates(memory, first, slot, present):
    """Return five coordinates from every second row."""
    at = first * STRIDE + slot
    torsion = memory[at]
    transverse_p = 0.0
    transverse_g = 0.0
    axial_p = 0.0
    axial_g = 0.0
    if present.transverse is not None:
        transverse_p = memory[at + 2 * STRIDE]
        transverse_g = memory[at + 4 * STRIDE]
        at += 4 * STRIDE
    if present.axial is not None:
        axial_p = memory[at + 2 * STRIDE]
        axial_g = memory[at + 4 * STRIDE]
    return Coordinates(torsion, transverse_p, transverse_g, axial_p, axial_g)


@scalar
def write_state(memory, first, slot, state, present):
    """Store what the scene has of a state into the rows from ``first`` on."""
    write_coordinates(memory, first, slot, state.position, present)
    write_coordinates(memory, first + 1, slot, state.rate, present)


@scalar
def write_coordinates(memory, first, slot, values, present):
    """Store the coordinates that the scene has into every second row."""
    at = first * STRIDE + slot
    memory[at] = values.torsion
    if present.transverse is not None:
        memory[at + 2 * STRIDE] = values.transverse_p
        memory[at + 4 * STRIDE] = values.transverse_g
        at += 4 * STRIDE
    if present.axial is not None:
        memory[at + 2 * STRIDE] = values.axial_p
        memory[at + 4 * STRIDE] = values.axial_g


@scalar
def read_branches(memory, slot):
    """Return the active pieces of a lane; without axial pair the second one repeats the first."""
    return Directions(
        load(memory, rows.TANGENTIAL_BRANCH, slot, Branch),
        load(memory, rows.AXIAL_BRANCH, slot, Branch),
    )


@scalar
def write_branches(memory, slot, branches):
    """Store the active pieces of a lane."""
    store(memory, rows.TANGENTIAL_BRANCH, slot, branches.tangential)
    store(memory, rows.AXIAL_BRANCH, slot, branches.axial)
