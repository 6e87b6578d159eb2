"""A motion with control: its section, the inputs of the controller, and its capture."""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Counts, Floats, Mask


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
        Largest distance of a motion that counts as captured, in the same measure.
    """

    section: Floats
    inputs: Floats
    distance: Floats
    within: float

    @property
    def captured(self) -> Mask:
        """Whether each motion is on the orbit at the end, shape (starts,)."""
        last: Mask = self.distance[:, -1] <= self.within
        return last

    @property
    def capture_time(self) -> Counts:
        """Mesh periods until each motion stays on the orbit, shape (starts,); -1 if it does not."""
        away = ~(self.distance <= self.within)
        left = np.argmax(away[:, ::-1], axis=1)
        times = np.where(away.any(axis=1), away.shape[1] - left, 0)
        return np.where(self.captured, times, -1)
