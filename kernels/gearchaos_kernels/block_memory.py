"""A block of lanes in memory: which row holds which number, and how the inner loop reads it.

A lane is one point of the batch. A block holds ``LANES`` of them, each in a *slot*, as a structure
of arrays: one flat array in which row r of a slot is element ``r * STRIDE + slot``. With one base
pointer and constant distances the compiler can prove that the loop over slots vectorises.

Coordinates are *scaled* so that the mesh force enters every equation with coefficient -1 (beta_b:
base helix angle, mu: mass ratio)::

    torsion = delta_5 / cos(beta_b)
    transverse_p = delta_1 / (mu_p cos(beta_b))    transverse_g = -delta_2 / (mu_g cos(beta_b))
    axial_p = delta_3 / (mu_p sin(beta_b))         axial_g = -delta_4 / (mu_g sin(beta_b))

and rates are displacements per step (h times d/d tau). Row r of a state is the r-th of the system's
states; the last rows of a system with fewer than ten are unused.
"""

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from gearchaos_kernels.compilation import CACHE_LINE, part, scalar
from gearchaos_kernels.system import STATES, Plan, System

LANES = 32
"""Lanes of one block: a few vectors wide, small enough for the first-level cache."""

STRIDE = LANES + 8
"""Distance between rows: no two rows fall on the same cache set at a distance of 4096 bytes."""

Present = namedtuple(
    "Present",
    "pitch_error phase teeth wide stiffness_variation backlash transverse axial "
    "resolved contact loads tangent flow_map",
)
"""What a compiled loop has: ``()`` where it is there, None where the compiler removes it."""


def flags(system: System, plan: Plan) -> Present:
    """Tell in types what the loop of a scene has, so that every scene is compiled for itself."""
    effects = system.effects
    teeth = system.teeth if effects.pitch_error else None
    resolved = effects.backlash and (plan.resolved or plan.method == "flow_map")
    values = {
        **effects._asdict(),
        "phase": effects.pitch_error and teeth is None and bool(np.any(system.groups.error_phase)),
        "teeth": teeth is not None,
        "wide": teeth is not None and teeth.pairs_in_mesh > NARROW,
        "resolved": resolved,
        "contact": resolved and plan.contact,
        "loads": plan.loads and plan.method == "rk4",
        "tangent": plan.tangent,
        "flow_map": plan.method == "flow_map",
    }
    return Present(**{name: () if present else None for name, present in values.items()})


class Coordinates(NamedTuple):
    """One number for each of the five scaled coordinates; 0 for those a scene leaves out."""

    torsion: float
    transverse_p: float
    transverse_g: float
    axial_p: float
    axial_g: float


class State(NamedTuple):
    """Scaled displacements and rates of one lane, or those of its tangent vector."""

    position: Coordinates
    rate: Coordinates


Lane = namedtuple(
    "Lane",
    "mass_ratio_p mass_ratio_g "
    "transverse_damping_p transverse_damping_g transverse_stiffness_p transverse_stiffness_g "
    "axial_damping_p axial_damping_g axial_stiffness_p axial_stiffness_g "
    "mean_stiffness stiffness_variation mesh_damping axial_share half_backlash load "
    "error_inertia error_mean error_amplitude error_rate "
    "axial_error_mean axial_error_amplitude axial_error_rate "
    "cos_phase sin_phase cosine tangential_speed axial_speed",
)
"""Coefficients of one lane (numbers) or of many (arrays), per step; see `coefficients`."""


class Branch(NamedTuple):
    """One linear piece of the clearance function, and the gaps between which it holds."""

    engaged: float
    offset: float
    floor: float
    ceiling: float


class Branches(NamedTuple):
    """The active pieces of the tangential and of the axial clearance."""

    tangential: Branch
    axial: Branch


class Carried(NamedTuple):
    """Mesh forces and transmission error at one instant, and the slopes of the forces."""

    tangential: float
    axial: float
    error: float
    tangential_slope: float
    axial_slope: float


class Crossings(NamedTuple):
    """Clearance boundaries that a lane crossed: how many, the slowest one, steps with too many."""

    crossed: float
    slowest: float
    overflows: float


STATE = 0
TANGENT = STATE + len(STATES)
BEFORE = TANGENT + len(STATES)
"""First row of a copy of state and tangent vector, as they were before the step."""
COEFFICIENTS = 2 * BEFORE
TANGENTIAL_BRANCH = COEFFICIENTS + len(Lane._fields)
AXIAL_BRANCH = TANGENTIAL_BRANCH + len(Branch._fields)
SUSPECT = AXIAL_BRANCH + len(Branch._fields)
"""Row that marks the lanes whose step may have left a contact branch."""
GROWTH = SUSPECT + 1
"""Row of the logarithm of the tangent vector's growth since the period began."""
CROSSINGS = GROWTH + 1
FORCES = CROSSINGS + len(Crossings._fields)
"""First row of what forces a lane where a step is a map; see `flow_map`."""
MARGINS = FORCES + 5
"""Rows of how far either gap may stray from its cubic in a step that is a map."""
NARROW, MOST_PAIRS = 4, 7
"""Tooth pairs in mesh at once: with more than the first the loop is another one."""
PAIRS = MARGINS + 2
"""First row of their errors; see `teeth`."""
SHARED = PAIRS + MOST_PAIRS
"""Rows of the error that they share where the last step ended: value, slope and curvature."""
CONTACT = SHARED + 3
"""First row of what is told of the contact: tangential, then axial."""
CONTACT_ROWS, SPEEDS = 6, 4
"""Rows of one direction: time in steps and impacts on either flank, sum and largest of speeds."""
LOADS = CONTACT + 2 * CONTACT_ROWS
SIGNALS, SIGNAL_ROWS = 3, 4
"""What is told of tangential force, axial force and transmission error: largest and smallest value,
sums over the steps of six times the mean of itself and of its square; see `loads`."""
CARRIED = LOADS + SIGNALS * SIGNAL_ROWS
ROWS = CARRIED + len(Carried._fields)

_ITEM = np.dtype(np.float64).itemsize


class Block(NamedTuple):
    """The memory of a block, its first lane in the batch, and how many of its slots are used."""

    memory: NDArray[np.float64]
    first: int
    lanes: int


@part
def aligned_memory():
    """Return memory for one block that starts on a cache line."""
    memory = np.empty(ROWS * STRIDE + CACHE_LINE // _ITEM)
    misfit = (CACHE_LINE - memory.ctypes.data % CACHE_LINE) % CACHE_LINE // _ITEM
    return memory[misfit : misfit + ROWS * STRIDE]


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any, number: int) -> Any:
    """Address of one row of a slot: arguments are memory, row, slot."""
    memory = context.make_array(signature.args[0])(context, builder, arguments[0])
    row = builder.add(arguments[1], ir.Constant(arguments[1].type, number))
    stride = ir.Constant(row.type, STRIDE)
    index = builder.add(builder.mul(row, stride), arguments[2])
    return builder.gep(memory.data, [index])


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
        for number, value in enumerate(cgutils.unpack_tuple(builder, arguments[3])):
            builder.store(value, _pointer(context, builder, signature, arguments, number))
        return context.get_dummy_value()

    return types.void(memory, types.intp, types.intp, record), generate


@scalar
def fill_lane(memory, slot, coefficients):
    """Store the coefficients of a lane, shape (fields of `Lane`,)."""
    for column in range(coefficients.shape[0]):
        memory[(COEFFICIENTS + column) * STRIDE + slot] = coefficients[column]


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
def read_branches(memory, slot, present):
    """Return the active pieces of a lane; without axial pair the second one repeats the first."""
    tangential = load(memory, TANGENTIAL_BRANCH, slot, Branch)
    if present.axial is None:
        return Branches(tangential, tangential)
    return Branches(tangential, load(memory, AXIAL_BRANCH, slot, Branch))


@scalar
def write_branches(memory, slot, branches):
    """Store the active pieces of a lane."""
    store(memory, TANGENTIAL_BRANCH, slot, branches.tangential)
    store(memory, AXIAL_BRANCH, slot, branches.axial)
