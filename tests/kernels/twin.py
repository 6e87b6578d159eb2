"""Slow, simple twin of the kernels: eq. 13 of Pan 2021 as printed, one lane, NumPy only.

It integrates delta_1 ... delta_5 with the textbook form of the Runge-Kutta method, and the tangent
vector with the variational equation. It uses none of the kernels' scalings, tables or stages.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Effects, Teeth

from .reference import COSINE, SINE

DELTA_5, DELTA_1, DELTA_2, DELTA_3, DELTA_4 = range(5)


class Motion(NamedTuple):
    """States after each period, shape (periods, 10) in the order of `STATES`, and growth."""

    states: np.ndarray
    growth: np.ndarray


def spline(x: np.ndarray, degree: int = 5) -> np.ndarray:
    """The B-spline with knots 0, 1, ... as a sum of powers that begin at the knots."""
    knots = np.arange(degree + 2)
    weights = np.array([(-1) ** k * math.comb(degree + 1, k) for k in knots])
    powers = np.maximum(x[..., np.newaxis] - knots, 0.0) ** degree
    inside = (x > 0.0) & (x < degree + 1.0)
    return np.where(inside, powers @ weights / math.factorial(degree), 0.0)


def shared_error(teeth: Teeth, profile: int, phase: float) -> np.ndarray:
    """The errors of the tooth pairs at a phase in mesh periods, summed with their shares.

    The result contains the sum and its first and second derivative by the phase in radians.
    """
    driving, driven = teeth.driving[profile], teeth.driven[profile]
    begin = teeth.entry - 2.5 / teeth.cells_per_period
    pairs = np.arange(math.floor(phase) - 10, math.floor(phase) + 2)
    places = teeth.cells_per_period * (phase - pairs - begin)
    in_mesh = (places > 0.0) & (places < teeth.share.size + 5)
    pairs, places = pairs[in_mesh], places[in_mesh]
    errors = driven[pairs % driven.size] - driving[pairs % driving.size]
    x = places[:, np.newaxis] - np.arange(teeth.share.size)
    first = spline(x, 4) - spline(x - 1, 4)
    second = spline(x, 3) - 2.0 * spline(x - 1, 3) + spline(x - 2, 3)
    total = np.stack([spline(x), first, second]) @ teeth.share @ errors
    return total * (teeth.cells_per_period / (2.0 * np.pi)) ** np.arange(3)


class Twin:
    """One lane; its groups are numbers with the names of `Groups`."""

    def __init__(
        self, groups, scene: Effects, physical: bool = False, teeth: Teeth | None = None
    ) -> None:
        self.groups = groups
        self.scene = scene
        self.physical = physical
        self.teeth = teeth
        self.sliding = 1.0
        self.present = np.tile(np.repeat([True, scene.transverse, scene.axial], [1, 2, 2]), 2)

    def stiffness(self, tau):
        """kappa(tau), eq. 19."""
        if not self.scene.stiffness_variation:
            return 1.0
        order = np.arange(1, COSINE.size + 1) * self.groups.mesh_frequency * tau
        variation = np.sum(COSINE * np.cos(order) + SINE * np.sin(order))
        return 1.0 + self.groups.stiffness_variation_scale * variation

    def error(self, tau):
        """e(tau), its rate and the inertial term -e'' (for a sine Omega^2 e), eqs 13 and 14."""
        if not self.scene.pitch_error:
            return 0.0, 0.0, 0.0
        omega, amplitude = self.groups.mesh_frequency, self.groups.error_amplitude
        if self.teeth is not None:
            phase = omega * tau / (2.0 * np.pi)
            shared = shared_error(self.teeth, self.groups.profile, phase)
            e, rate, second = amplitude * shared * omega ** np.arange(3)
            return self.groups.error_mean + e, rate, -second
        angle = omega * tau + self.groups.error_phase
        sine = amplitude * np.sin(angle)
        return self.groups.error_mean + sine, omega * amplitude * np.cos(angle), omega**2 * sine

    def changes_of_sliding(self):
        """The mesh phases, in periods from 0 to 1, at which sliding changes its sign.

        At the first one the contact passes the pitch point. The next pair takes over half a period
        later.
        """
        if not self.scene.friction:
            return np.zeros(0)
        return (self.groups.pitch_point_phase / (2.0 * np.pi) + np.array([0.0, 0.5])) % 1.0

    def sliding_at(self, phase):
        """1 if the contact is before the pitch point, -1 if it is beyond."""
        behind = phase - self.groups.pitch_point_phase / (2.0 * np.pi)
        return 1.0 if behind % 1.0 > 0.5 else -1.0

    def parts_of(self, begin, end):
        """The ends of the parts of a step, in periods; sliding keeps its sign within a part."""
        changes = self.changes_of_sliding() + np.floor(begin)
        near = 1e-9 * (end - begin)
        inside = changes[(changes > begin + near) & (changes < end - near)]
        return [begin, *np.sort(inside), end]

    def relative(self, delta, error):
        """y_1 and y_2, eqs 6 and 7; given rates instead of displacements, it returns rates."""
        beta = self.groups.base_helix_angle
        along_mesh = delta[DELTA_1] - delta[DELTA_2] + delta[DELTA_5]
        if self.physical:
            along_mesh = along_mesh + error
        # The error reduces both gaps by the projections (eqs 2 to 5) of a length along the normal.
        normal = error / np.cos(beta) if self.of_flanks else error
        y_1 = along_mesh - normal * np.cos(beta)
        y_2 = delta[DELTA_3] - delta[DELTA_4] - np.tan(beta) * along_mesh - normal * np.sin(beta)
        return y_1, y_2

    @property
    def of_flanks(self):
        """Whether each pair in mesh has a constant error in the transverse plane."""
        return self.physical and self.teeth is not None and self.scene.pitch_error

    def damped_rates(self, rate, error_rate):
        """The rates that act on the mesh dampers: of y_1 and y_2, or of the gears' approach."""
        if not self.of_flanks:
            return self.relative(rate, error_rate)
        # delta_5 is measured from e, but the approach of the gears is not.
        approach = rate[DELTA_1] - rate[DELTA_2] + (rate[DELTA_5] + error_rate)
        axial = rate[DELTA_3] - rate[DELTA_4]
        return approach, axial - np.tan(self.groups.base_helix_angle) * approach

    def clearance(self, y, half_backlash):
        """f(y; b) and its slope, eqs 22 and 23."""
        if not self.scene.backlash:
            return y, 1.0
        if y > half_backlash:
            return y - half_backlash, 1.0
        if y < -half_backlash:
            return y + half_backlash, 1.0
        return 0.0, 0.0

    def accelerations(self, delta, rate, force_y, force_z, drive):
        """Rows of eq. 13 for given mesh forces N_y and N_z."""
        g = self.groups
        cosine, sine = np.cos(g.base_helix_angle), np.sin(g.base_helix_angle)
        acceleration = np.zeros(5)
        friction = 0.0
        if self.scene.friction:
            friction = self.sliding * g.friction_coefficient * g.friction_lever
        acceleration[DELTA_5] = drive - (1.0 - friction) * cosine * force_y
        for row, sign, force, ratio, damping, stiffness in (
            (DELTA_1, -1, cosine * force_y, g.mass_ratio_p, *self.bearing("transverse", "p")),
            (DELTA_2, +1, cosine * force_y, g.mass_ratio_g, *self.bearing("transverse", "g")),
            (DELTA_3, -1, sine * force_z, g.mass_ratio_p, *self.bearing("axial", "p")),
            (DELTA_4, +1, sine * force_z, g.mass_ratio_g, *self.bearing("axial", "g")),
        ):
            bearing = 2.0 * damping * rate[row] + stiffness * delta[row]
            acceleration[row] = sign * ratio * force - bearing
        return np.where(self.present[:5], acceleration, 0.0)

    def bearing(self, direction, gear):
        """eta and k of one bearing."""
        damping = getattr(self.groups, f"{direction}_damping_{gear}")
        return damping, getattr(self.groups, f"{direction}_stiffness_{gear}")

    def slope(self, tau, joint):
        """Time derivative of state and tangent vector together, shape (20,)."""
        g = self.groups
        delta, rate, tangent, tangent_rate = joint.reshape(4, 5)
        kappa = self.stiffness(tau)
        error, error_rate, inertia = self.error(tau)
        y_1, y_2 = self.relative(delta, error)
        y_1_rate, y_2_rate = self.damped_rates(rate, error_rate)
        elastic_y, active_y = self.clearance(y_1, g.half_backlash * np.cos(g.base_helix_angle))
        elastic_z, active_z = self.clearance(y_2, g.half_backlash * np.sin(g.base_helix_angle))
        acceleration = self.accelerations(
            delta,
            rate,
            kappa * elastic_y + 2.0 * g.damping_ratio * y_1_rate,
            kappa * elastic_z + 2.0 * g.damping_ratio * y_2_rate,
            g.load + inertia,
        )
        varied_y, varied_z = self.relative(tangent, 0.0)
        varied_y_rate, varied_z_rate = self.relative(tangent_rate, 0.0)
        tangent_acceleration = self.accelerations(
            tangent,
            tangent_rate,
            kappa * active_y * varied_y + 2.0 * g.damping_ratio * varied_y_rate,
            kappa * active_z * varied_z + 2.0 * g.damping_ratio * varied_z_rate,
            0.0,
        )
        return np.concatenate([rate, acceleration, tangent_rate, tangent_acceleration])

    def from_rest(self, tau, sign=1.0):
        """Terms added to state and tangent vector to measure delta_5 from rest, shape (20,)."""
        added = np.zeros(20)
        if self.of_flanks:
            added[DELTA_5], added[5 + DELTA_5], _ = np.multiply(sign, self.error(tau))
        return added

    def slope_from_rest(self, tau, joint):
        """Time derivative of state and tangent vector, with delta_5 measured from rest."""
        slope = self.slope(tau, joint + self.from_rest(tau, -1.0))
        if self.of_flanks:
            _, rate, inertia = self.error(tau)
            slope[DELTA_5] += rate
            slope[5 + DELTA_5] -= inertia
        return slope

    def step(self, joint, tau, h):
        """Take one Runge-Kutta step."""
        k_1 = self.slope_from_rest(tau, joint)
        k_2 = self.slope_from_rest(tau + h / 2.0, joint + h / 2.0 * k_1)
        k_3 = self.slope_from_rest(tau + h / 2.0, joint + h / 2.0 * k_2)
        k_4 = self.slope_from_rest(tau + h, joint + h * k_3)
        return joint + h / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4)

    def integrate(self, start, steps: int, periods: int) -> Motion:
        """Take ``steps`` Runge-Kutta steps per mesh period, with delta_5 measured from rest."""
        # Here displacements come first, then rates.
        start = np.where(self.present, np.concatenate([start[0::2], start[1::2]]), 0.0)
        joint = np.concatenate([start, self.present / np.sqrt(np.sum(self.present))])
        mesh_period = 2.0 * np.pi / self.groups.mesh_frequency
        joint = joint + self.from_rest(0.0)
        states, growth = [], []
        for period in range(periods):
            for number in range(steps):
                ends = self.parts_of(period + number / steps, period + (number + 1) / steps)
                for begin, end in pairwise(ends):
                    self.sliding = self.sliding_at((begin + end) / 2.0)
                    joint = self.step(joint, begin * mesh_period, (end - begin) * mesh_period)
            length = np.linalg.norm(joint[10:])
            joint[10:] /= length
            seen = joint + self.from_rest((period + 1) * mesh_period, -1.0)
            states.append(seen[:10].reshape(2, 5).T.ravel())
            growth.append(np.log(length))
        return Motion(np.array(states), np.array(growth))
