"""The mesh phase as its sine and cosine, for models that harmonics of it excite.

With a fixed number of steps per mesh period, the same phases recur in every period. The inner loop
therefore reads a table and evaluates no trigonometric function. Within a step, sine and cosine
follow from the nearest row of the table by the addition theorems, exact to rounding.

Models without an own excitation use all of this by default; see `protocol` and `lane_system`.
Other models build on its functions.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.plan import Floats


class MeshPhase(NamedTuple):
    """A mesh phase, as its sine and its cosine."""

    sine: float
    cosine: float


def half_step_angles(steps_per_period: int) -> Floats:
    """Return the mesh phase in rad at every half step of a period, shape (2 steps + 1,).

    The last one is 0 again, so that every period begins with exactly the same phase.
    """
    half_steps = np.arange(2 * steps_per_period + 1) % (2 * steps_per_period)
    angles: Floats = np.pi * half_steps / steps_per_period
    return angles


def sine_and_cosine(angle: Floats) -> Floats:
    """Return sine and cosine of angles in rad, shape (angles, 2)."""
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)


@lru_cache(maxsize=32)
def harmonic_series(order: int, steps: int, terms: int, amplitude: complex = 1.0) -> np.ndarray:
    """Return complex Taylor coefficients of amplitude exp(i order phase), shape (terms, steps).

    They are about the middle of every step, in a variable that is -1 and 1 at the step's ends. They
    are kept, because maps of many lanes need them, and cannot be written to.
    """
    half = np.pi / steps
    middle = (2 * np.arange(steps) + 1) * half
    term = np.arange(terms)[:, np.newaxis]
    factor = half**term / np.cumprod(np.maximum(term, 1.0))[:, np.newaxis]
    series: np.ndarray = amplitude * np.exp(1j * order * middle) * (1j * order) ** term * factor
    series.flags.writeable = False
    return series


@scalar
def nearest_row(number, fraction, table_rows):
    """Return the row nearest to a fraction of a step, and the angle in rad from there."""
    nearest = int(2.0 * fraction + 0.5)
    angle = (2.0 * fraction - nearest) * (2.0 * math.pi / (table_rows - 1))
    return 2 * number + nearest, angle


@scalar
def turned(sine, cosine, angle):
    """Return sine and cosine of a phase that is an angle, in rad, further on."""
    # With few steps and high harmonics the angle is not small.
    sine_of_angle, cosine_of_angle = math.sin(angle), math.cos(angle)
    return (
        sine * cosine_of_angle + cosine * sine_of_angle,
        cosine * cosine_of_angle - sine * sine_of_angle,
    )


@scalar
def grid_at(table, row, scene):
    """Return the mesh phase at a row of a table of sine and cosine, shape (2 steps + 1, 2)."""
    return MeshPhase(table[row, 0], table[row, 1])


@scalar
def grid_within(table, number, fraction, scene):
    """Return the mesh phase at a fraction of a step."""
    row, angle = nearest_row(number, fraction, table.shape[0])
    sine, cosine = turned(table[row, 0], table[row, 1], angle)
    return MeshPhase(sine, cosine)


@scalar
def point_within(memory, slot, table, number, fraction, scene):
    """Return the mesh phase at a fraction of a step, the same for all lanes."""
    return grid_within(table, number, fraction, scene)


@scalar
def point_of_waves(waves, scene):
    """Return the mesh phase with this sine and cosine."""
    sine, cosine = waves
    return MeshPhase(sine, cosine)
