"""A motion with control: its section, the inputs of the controller, and its capture."""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Counts, Floats, Mask

LIMITS = ("limit", "limit_Nm", "limit_force")
"""Keys of [control] for the largest change of the input: a share, or a value in its unit."""

CLOSEST_REACH = 1e-6
"""Largest distance of a captured motion without noise, as a share of the largest state."""

NOISE_REACH = 30.0
"""Largest distance of a captured motion with noise, in standard deviations of the noise."""

HELD_PERIODS = 16
"""Excitation periods at the end over which a captured motion stays on the orbit."""

CAPTURE_MEANINGS = ("not captured", "captured", "no orbit", "no gain", "off")
"""Meanings of the values of ``capture``; in lanes with one of the last three no input is used."""
NOT_CAPTURED, CAPTURED, NO_ORBIT, NO_GAIN, OFF = range(len(CAPTURE_MEANINGS))


class ControlledMotion(NamedTuple):
    """Motions from several starts with a controller.

    Attributes
    ----------
    section : array, shape (starts, mesh periods, states)
        The state at the end of every mesh period.
    inputs : array, shape (starts, mesh periods)
        What the controller adds to the load, dimensionless, in every mesh period.
    distance : array, shape (starts, mesh periods)
        Largest deviation of a state from the target orbit, as a share of its largest state.
    within : float
        Largest distance of a motion on the orbit, in the same measure.
    noisy : bool
        Whether what the controller measures has noise.
    repeats : int
        Mesh periods after which the excitation repeats.
    """

    section: Floats
    inputs: Floats
    distance: Floats
    within: float
    noisy: bool = False
    repeats: int = 1

    @property
    def captured(self) -> Mask:
        """Whether each motion stays on the orbit in the last periods, shape (starts,)."""
        last = self._on_orbit[:, -HELD_PERIODS * self.repeats :]
        stays: Mask = np.all(last, axis=1)
        return stays

    @property
    def capture_time(self) -> Counts:
        """Mesh periods until each motion stays on the orbit, shape (starts,); -1 if it does not."""
        away = ~self._on_orbit
        left = np.argmax(away[:, ::-1], axis=1)
        times = np.where(away.any(axis=1), away.shape[1] - left, 0)
        return np.where(self.captured, times, -1)

    @property
    def _on_orbit(self) -> Mask:
        """Whether each motion is on the orbit in every mesh period."""
        return on_orbit(self.distance, self.inputs, np.array([self.within]), self.noisy)


def on_orbit(distance: Floats, inputs: Floats, within: Floats, noisy: bool | Mask) -> Mask:
    """Return whether motions are on their orbit in every mesh period, shape (lanes, periods).

    With noise a motion may be near the orbit by chance: its input must then be used as well.

    Parameters
    ----------
    distance, inputs : array, shape (lanes, periods)
        See `ControlledMotion`.
    within : array, shape (lanes,) or (1,)
        Largest distance of a motion on the orbit.
    noisy : bool or array of bool, shape (lanes,)
        Whether measurements have noise. Without it, an input may be exactly 0.
    """
    near: Mask = distance <= within[:, np.newaxis]
    used: Mask = ~np.reshape(noisy, (-1, 1)) | (inputs != 0.0)
    return near & used


def reach_of(noise: float | Floats) -> Floats:
    """Return the largest distance of a captured motion, for noise in the scales of the states."""
    reach: Floats = np.maximum(CLOSEST_REACH, NOISE_REACH * np.asarray(noise))
    return reach


def distance_from(
    points: Floats, section: Floats, scale: float | Floats, repeats: int, first: int
) -> Floats:
    """Return the distance of section points from the points of an orbit, shape (lanes, periods).

    Parameters
    ----------
    points : array, shape (points, states) or (points, lanes, states)
        The orbit at the beginning of its mesh periods.
    section : array, shape (lanes, periods, states)
        Section points of successive mesh periods.
    scale : float or array, shape (lanes,)
        Largest state.
    repeats : int
        Mesh periods after which the excitation repeats.
    first : int
        Mesh periods since the beginning of the orbit at the first section point.
    """
    distance = np.full(section.shape[:2], np.inf)
    each = np.reshape(np.asarray(scale), (-1, 1))
    for number, point in enumerate(points):
        begins = (number - first) % repeats
        apart = np.abs(section[:, begins::repeats] - np.expand_dims(point, -2))
        there = np.max(apart, axis=2) / each
        distance[:, begins::repeats] = np.fmin(distance[:, begins::repeats], there)
    return distance
