"""Gaps, forces and accelerations along a motion of piecewise-linear systems, from their matrices.

These are the equations of `model`, without a loop that would have to be compiled for each
structure.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.plan import Floats

if TYPE_CHECKING:
    from gearchaos_kernels.models.linear.system import LinearSystems


class Moving(NamedTuple):
    """A motion of piecewise-linear systems, sampled.

    Attributes
    ----------
    position, rate : array, shape (lanes, samples, coordinates)
        Coordinates and their rates per unit of tau.
    waves : array, shape (samples, waves)
        The constant 1, then cosine and sine of each harmonic.
    """

    position: Floats
    rate: Floats
    waves: Floats


def moving(systems: "LinearSystems", states: Floats, steps_per_period: int) -> Moving:
    """Return a motion from its states (lanes, samples, states), the first one at mesh phase 0."""
    samples = states.shape[1]
    rows = systems.tables(steps_per_period)[2 * (np.arange(samples) % steps_per_period)]
    waves = np.concatenate([np.ones((samples, 1)), rows], axis=1)
    return Moving(states[..., ::2], states[..., 1::2], waves)


def gaps_of(systems: "LinearSystems", motion: Moving) -> tuple[Floats, Floats]:
    """Return the gaps of the elements and their rates per unit of tau, (lanes, samples, elements).

    y_j = n_j x - e_j, where the excitation e_j moves a flank.
    """
    value = _applied(systems.gap, motion.position) - _applied(systems.motion, motion.waves)
    rate = _applied(systems.gap, motion.rate) - _applied(systems.motion_rate, motion.waves)
    return value, rate


def flanks_of(systems: "LinearSystems", value: Floats) -> NDArray[np.uint8]:
    """Return 0 without contact, 1 on the driving flank, 2 on the back flank, shape as ``value``."""
    half = systems.half_clearance[:, np.newaxis]
    back = (value < -half) & ~np.array(systems.structure.one_sided, dtype=bool)
    return np.where(value > half, 1, np.where(back, 2, 0)).astype(np.uint8)


def forces_of(systems: "LinearSystems", motion: Moving, value: Floats, rate: Floats) -> Floats:
    """Return the forces of the elements on gaps with these values and rates (eqs 22, 23)."""
    half, one_sided = systems.half_clearance[:, np.newaxis], systems.structure.one_sided
    lowest = np.where(np.array(one_sided, dtype=bool), -np.inf, -half)
    deflection = value - np.minimum(np.maximum(value, lowest), half)
    touching = deflection != 0.0 if systems.clearance else np.ones(value.shape, dtype=bool)
    idle = np.array(systems.structure.damped_in_contact, dtype=bool) & ~touching
    damping = np.where(idle, 0.0, systems.damping[:, np.newaxis])
    stiffness = _applied(systems.stiffness, motion.waves)
    force: Floats = stiffness * deflection + damping * rate
    return force


def accelerations_of(systems: "LinearSystems", motion: Moving, forces: Floats) -> Floats:
    """Return x'' = M^-1 (f - K x - C x' - r F) by tau, shape (lanes, samples, coordinates)."""
    springs = _applied(systems.position, motion.position)
    dampers = _applied(systems.rate, motion.rate)
    pushes = _applied(systems.reaction, forces)
    driven = _applied(systems.force, motion.waves)
    accelerations: Floats = driven - springs - dampers - pushes
    return accelerations


def _applied(matrices: Floats, vectors: Floats) -> Floats:
    """Return matrices (lanes, rows, columns) times vectors (lanes, samples, columns)."""
    products: Floats = vectors @ matrices.swapaxes(1, 2)
    return products
