"""Reference motions of eq. 13 with pitch errors of single teeth, exact to double precision.

An adaptive method of order 8 restarts wherever the vector field is not smooth: at every knot of the
spline of the shared error, at every change of the sign of sliding, and at every clearance crossing,
which is located as an event.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gearchaos_kernels import Effects, Teeth
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline, PPoly

from .twin import Twin

TOLERANCE = 1e-13


class Followed(NamedTuple):
    """States after each mesh period, (periods, 10) in the order of `STATES`, and crossings."""

    states: np.ndarray
    crossings: int


def error_spline(teeth: Teeth, profile: int, periods: int) -> BSpline:
    """Return the shared error of the pairs in mesh as a spline over the phase in mesh periods."""
    driving, driven = teeth.driving[profile], teeth.driven[profile]
    cells, ago = teeth.cells_per_period, 10
    weights = np.zeros((periods + ago) * cells + teeth.share.size)
    for number in range(periods + ago):
        pair = number - ago
        error = driven[pair % driven.size] - driving[pair % driving.size]
        weights[number * cells :][: teeth.share.size] += error * teeth.share
    knots = np.arange(weights.size + 6) / cells + teeth.begins - ago
    return BSpline(knots, weights, 5)


class Exact(Twin):
    """The twin on a fixed contact branch in each direction: +1 or -1 on a flank, 0 apart."""

    def __init__(
        self, groups: Any, scene: Effects, physical: bool, teeth: Teeth | None, periods: int
    ) -> None:
        super().__init__(groups, scene, physical, teeth)
        beta = groups.base_helix_angle
        self.limits = groups.half_backlash * np.array([np.cos(beta), np.sin(beta)])
        self.branches = [0, 0]
        if teeth is None:
            return
        error = PPoly.from_spline(error_spline(teeth, groups.profile, periods + 1))
        # One call returns value, slope and curvature.
        orders = [np.pad(error.derivative(order).c, ((order, 0), (0, 0))) for order in range(3)]
        self.shared = PPoly(np.stack(orders, axis=2), error.x)

    def error(self, tau: float) -> tuple[float, float, float]:
        if self.teeth is None:
            return super().error(tau)
        omega, amplitude = self.groups.mesh_frequency, self.groups.error_amplitude
        phase = omega * tau / (2.0 * np.pi)
        e, rate, second = amplitude * self.shared(phase) * (omega / (2.0 * np.pi)) ** np.arange(3)
        return self.groups.error_mean + e, rate, -second

    def clearance(self, y: float, half_backlash: float) -> tuple[float, float]:
        if not self.scene.backlash:
            return y, 1.0
        side = self.branches[int(half_backlash != self.limits[0])]
        return (y - side * half_backlash, 1.0) if side else (0.0, 0.0)

    def motion(self, tau: float, joint: np.ndarray) -> np.ndarray:
        """Time derivative of displacements and rates, shape (10,)."""
        return self.slope(tau, np.concatenate([joint, np.zeros(10)]))[:10]

    def gaps(self, tau: float, joint: np.ndarray) -> np.ndarray:
        """y_1 and y_2, divided by their half clearances."""
        return np.array(self.relative(joint[:5], self.error(tau)[0])) / self.limits

    def exits(self) -> list:
        """One event for each boundary of the branches, with its gap and the branch that follows."""
        events = []
        for way in range(1 + self.scene.axial if self.scene.backlash else 0):
            touching = self.branches[way] != 0
            for side in (self.branches[way],) if touching else (-1, 1):

                def beyond(tau, joint, way=way, side=side):
                    return side * self.gaps(tau, joint)[way] - 1.0

                beyond.terminal, beyond.direction = True, -1 if touching else 1
                beyond.way, beyond.following = way, 0 if touching else side
                events.append(beyond)
        return events

    def follow(self, start: np.ndarray, periods: int) -> Followed:
        """Integrate from a state in the order of `STATES`."""
        joint = np.where(self.present, np.concatenate([start[0::2], start[1::2]]), 0.0)
        self.branches = [int(gap) for gap in np.fix(self.gaps(0.0, joint)).clip(-1, 1)]
        period, knots = 2.0 * np.pi / self.groups.mesh_frequency, np.zeros(0)
        if self.teeth is not None:
            cells = self.teeth.cells_per_period
            knots = np.arange(-cells, periods * cells) / cells + self.teeth.begins
        changes = np.add.outer(np.arange(periods), self.changes_of_sliding()).ravel()
        # Rounded, because some knots equal ends of periods up to their last digits.
        stops = np.unique(np.round(np.concatenate([knots, changes, np.arange(1, periods + 1)]), 12))
        tau, crossings, states = 0.0, 0, []
        for stop in stops[(stops > 0.0) & (stops <= periods)]:
            self.sliding = self.sliding_at(0.5 * (tau / period + stop))
            while tau < stop * period:
                exits = self.exits()
                piece = solve_ivp(
                    self.motion,
                    (tau, stop * period),
                    joint,
                    "DOP853",
                    events=exits,
                    rtol=TOLERANCE,
                    atol=TOLERANCE,
                )
                tau, joint = float(piece.t[-1]), piece.y[:, -1]
                if piece.status == 1:
                    taken = next(e for e, at in zip(exits, piece.t_events, strict=True) if at.size)
                    self.branches[taken.way] = taken.following
                    crossings += 1
            if stop == round(stop):
                states.append(joint.reshape(2, 5).T.ravel())
        return Followed(np.array(states), crossings)
