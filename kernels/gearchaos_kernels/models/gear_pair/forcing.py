"""Forcing of a lane at one instant: mesh stiffness, load and pitch error.

The pitch error here is the sine of eq. 14; `teeth` has pitch errors tooth by tooth. With a fixed
number of steps per mesh period, the same mesh phases recur in every period. The inner loop
therefore reads a table and evaluates no trigonometric function. Between the rows of the table the
Taylor series about the nearest row is as accurate as the table itself.
"""

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import read_lane
from gearchaos_kernels.models.gear_pair.coefficients import Lane
from gearchaos_kernels.models.mesh_phase import (
    half_step_angles,
    harmonic_series,
    nearest_row,
    sine_and_cosine,
    turned,
)
from gearchaos_kernels.models.sums import sums
from gearchaos_kernels.models.waves import waves_in_row, waves_within
from gearchaos_kernels.plan import Floats

if TYPE_CHECKING:
    from gearchaos_kernels.models.gear_pair.pairs import GearPairs

SINE, COSINE, VARIATION = 0, 1, 2
"""Columns of the table; after the stiffness variation its harmonics, two columns for each."""

_HARMONICS = VARIATION + 1


class Phase(NamedTuple):
    """A mesh phase: stiffness variation relative to the mean, and a pitch error of amplitude 1.

    ``value``, ``slope``, ``curvature``: the error and its first and second derivative by the mesh
    phase in radians.
    """

    variation: float
    value: float
    slope: float
    curvature: float


class Forcing(NamedTuple):
    """Mesh stiffness, drive and pitch errors at one instant, per step.

    Fields of effects that a scene leaves out are the constant 0.
    """

    stiffness: float
    drive: float
    error: float
    error_rate: float
    axial_error: float
    axial_error_rate: float


@lru_cache(maxsize=8)  # Computing it takes half of the time that a call needs before its loop.
def phase_table(
    cosine: tuple[float, ...], sine: tuple[float, ...], steps_per_period: int
) -> NDArray[np.float64]:
    """Return sine, cosine and stiffness variation at every half step of a mesh period.

    ``cosine``, ``sine``: Fourier coefficients of the mesh stiffness relative to its mean (eq. 19).
    The shape is (2 steps + 1, 3 + 2 harmonics); the last row repeats the first. A harmonic is the
    real part of a wave, whose real and imaginary part follow the variation.
    """
    angle = half_step_angles(steps_per_period)
    order = np.arange(1, len(cosine) + 1)
    amplitude = np.array(cosine) - 1j * np.array(sine)
    waves = amplitude * np.exp(1j * np.outer(angle, order))
    parts = np.stack([waves.real, waves.imag], axis=2).reshape(angle.size, -1)
    # Added one after the other, as between the rows.
    variation = np.cumsum(waves.real, axis=1)[:, -1:] if order.size else np.zeros((angle.size, 1))
    return np.column_stack([sine_and_cosine(angle), variation, parts])


def wave_series(system: "GearPairs", steps: int, terms: int) -> Floats:
    """Return Taylor coefficients about the middle of every step, shape (3 + waves, terms, steps).

    They are those of the stiffness variation relative to the mean (eq. 19), then of sine and cosine
    of the mesh phase. If lanes have harmonics of their own, the variation is 0, and cosine and sine
    of each harmonic follow.
    """
    variation = np.zeros((terms, steps))
    wave = harmonic_series(1, steps, terms)
    series = [variation, wave.imag, wave.real]
    for order in range(1, system.harmonics() + 1):
        if system.own_harmonics:
            wave = harmonic_series(order, steps, terms)
            series += [wave.real, wave.imag]
        else:
            cosine, sine = system.stiffness_cosine[order - 1], system.stiffness_sine[order - 1]
            variation += harmonic_series(order, steps, terms, cosine - 1j * sine).real
    return np.stack(series)


def _own_terms(flags: Any) -> list[list[tuple[int | None, int]]]:
    """Return the products of a lane's harmonics with the waves, whose sum is the variation."""
    first = len(Lane._fields)
    return [[(first + wave, wave) for wave in range(2 * len(flags.orders))]]


_own_variation = sums(_own_terms)


@scalar
def waves_at(table, row, scene):
    """Return the waves at a row of their table, None if lanes share their harmonics."""
    if scene.model.own is None:
        return None
    return waves_in_row(table, row, scene)


@scalar
def waves_between(table, number, fraction, scene):
    """Return the waves at a fraction of a step, None if lanes share their harmonics."""
    if scene.model.own is None:
        return None
    return waves_within(table, number, fraction, scene)


@scalar
def of_lane(memory, slot, point, waves, scene):
    """Return a mesh phase with the stiffness variation of a lane, by its own harmonics."""
    if scene.model.own is None:
        return point
    (variation,) = _own_variation(read_lane(memory, slot, scene), scene, waves)
    return Phase(variation, point.value, point.slope, point.curvature)


@scalar
def phase_on_grid(table, row):
    """Return the mesh phase at one row of the table."""
    sine = table[row, SINE]
    return Phase(table[row, VARIATION], sine, table[row, COSINE], -sine)


@scalar
def phase_within(table, number, fraction):
    """Return the mesh phase at a fraction of a step, from the nearest row."""
    row, angle = nearest_row(number, fraction, table.shape[0])
    along, across = math.cos(angle), math.sin(angle)
    real, imaginary, variation = along, across, 0.0
    for column in range(_HARMONICS, table.shape[1], 2):
        # Each wave turns by its order times the angle.
        variation += table[row, column] * real - table[row, column + 1] * imaginary
        real, imaginary = real * along - imaginary * across, real * across + imaginary * along
    sine, cosine = turned(table[row, SINE], table[row, COSINE], angle)
    return Phase(variation, sine, cosine, -sine)


@scalar
def forcing_at(lane, point, scene):
    """Return mesh stiffness (eq. 19), load and pitch error (eq. 14) of a lane at a mesh phase."""
    stiffness = lane.mean_stiffness
    if scene.model.stiffness_variation is not None:
        stiffness = lane.mean_stiffness + lane.stiffness_variation * point.variation
    drive = lane.load
    error = 0.0
    error_rate = 0.0
    axial_error = 0.0
    axial_error_rate = 0.0
    if scene.model.pitch_error is not None:
        point = shifted(lane, point, scene)
        if scene.model.undamped is None:
            # delta_5 is measured from e, so -e'' drives it (eq. 13).
            drive = lane.load - lane.error_inertia * point.curvature
        error = lane.error_mean + lane.error_amplitude * point.value
        error_rate = lane.error_rate * point.slope
        if scene.model.axial is not None:
            axial_error = lane.axial_error_mean + lane.axial_error_amplitude * point.value
            axial_error_rate = lane.axial_error_rate * point.slope
    return Forcing(stiffness, drive, error, error_rate, axial_error, axial_error_rate)


@scalar
def unforced(lane, scene):
    """Return the forcing of a mesh of mean stiffness without load and pitch error."""
    return Forcing(lane.mean_stiffness, 0.0, 0.0, 0.0, 0.0, 0.0)


@scalar
def driven(lane, drive, scene):
    """Return the forcing of a mesh of mean stiffness by a load alone."""
    return Forcing(lane.mean_stiffness, drive, 0.0, 0.0, 0.0, 0.0)


@scalar
def pitch_error_at(lane, point, scene):
    """Return e at a mesh phase.

    The axial gap contains 2 e in every formulation of the gaps; its coefficients are used here.
    """
    value = lane.axial_error_amplitude * shifted(lane, point, scene).value
    if scene.model.undamped is not None:
        return 0.5 * lane.cosine * (lane.axial_error_mean + value)
    return 0.5 * (lane.axial_error_mean + value)


@scalar
def shifted(lane, point, scene):
    """Return a mesh phase whose error is shifted by the phase of the lane (phi of eq. 14)."""
    if scene.model.phase is None:
        return point
    value = lane.cos_phase * point.value + lane.sin_phase * point.slope
    slope = lane.cos_phase * point.slope - lane.sin_phase * point.value
    return Phase(point.variation, value, slope, -value)
