"""What a block of lanes holds: its records, and which row holds which number.

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

from gearchaos_kernels.system import STATES

LANES = 32  # Lanes of one block: a few vectors wide, small enough for the first-level cache.

STRIDE = LANES + 8
"""Distance between rows: no two rows fall on the same cache set at a distance of 4096 bytes."""


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


class Directions(NamedTuple):
    """Both gaps, clearances, forces or stiffnesses of the mesh."""

    tangential: Any
    axial: Any


ANYWHERE = Directions(None, None)
"""In place of branches: each force is that of the branch on which its gap lies."""


class Carried(NamedTuple):
    """Mesh forces and transmission error at one instant, and the slopes of the forces."""

    tangential: float
    axial: float
    error: float
    tangential_slope: float
    axial_slope: float


STATE = 0
TANGENT = STATE + len(STATES)
BEFORE = TANGENT + len(STATES)
STATE_BEFORE, TANGENT_BEFORE = BEFORE + STATE, BEFORE + TANGENT
"""First rows of a copy of state and tangent vector, as they were before the step."""
COEFFICIENTS = 2 * BEFORE
TANGENTIAL_BRANCH = COEFFICIENTS + len(Lane._fields)
AXIAL_BRANCH = TANGENTIAL_BRANCH + len(Branch._fields)
SUSPECT = AXIAL_BRANCH + len(Branch._fields)
"""Row of the gaps that may have left their branches in a step: 1 tangential, 2 axial, 3 both."""
GROWTH = SUSPECT + 1  # Row of the logarithm of the tangent vector's growth since the period began.
CROSSINGS, SLOWEST, OVERFLOWS = range(GROWTH + 1, GROWTH + 4)
"""Clearance boundaries that a lane crossed, the smallest speed there, steps with too many."""
FORCES = OVERFLOWS + 1  # First row of what forces a lane where a step is a map; see `flow_map`.
MARGINS = FORCES + 5  # Rows of how far either gap may stray from its cubic in a step that is a map.
NARROW, MOST_PAIRS = 4, 7
"""Tooth pairs in mesh at once: with more than the first the loop is another one."""
PAIRS = MARGINS + 2  # First row of their errors; see `teeth`.
SHARED = PAIRS + MOST_PAIRS
"""Rows of the mesh phase where the last step ended, with the error that they share."""
CONTACT = SHARED + 4  # First row of what is told of the contact: tangential, then axial.
CONTACT_ROWS, SPEEDS = 6, 4
"""Rows of one direction: time in steps and impacts on either flank, sum and largest of speeds."""
LOADS = CONTACT + 2 * CONTACT_ROWS
SIGNALS, SIGNAL_ROWS = 3, 4
"""What is told of tangential force, axial force and transmission error: largest and smallest value,
sums over the steps of six times the mean of itself and of its square; see `loads`."""
CARRIED = LOADS + SIGNALS * SIGNAL_ROWS
ERROR = CARRIED + Carried._fields.index("error")
ROWS = CARRIED + len(Carried._fields)
"""Rows of every block; behind them are those of what is `chosen`."""
