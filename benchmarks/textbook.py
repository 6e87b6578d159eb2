"""The kernel one would write first: prange over lanes, state arrays, trigonometry in the field.

It is correct, parallel and compiled, and serves as the yardstick of `throughput.py`: the same
model, the same method and the same step counts, written straight from the equations of motion.
"""

import numpy as np
from gearchaos_kernels import Groups
from numba import njit, prange


@njit(fastmath=True)
def clearance(x, b):
    if x > b:
        return x - b
    if x < -b:
        return x + b
    return 0.0


@njit(fastmath=True)
def field(tau, state, p, cosine, sine, out, slopes):
    (omega, xi, b, load, scale, amplitude, cy, cz, mp, mg, k1, c1, k2, c2, k3, c3, k4, c4) = p
    kappa = 1.0
    for n in range(cosine.size):
        angle = (n + 1) * omega * tau
        kappa += scale * (cosine[n] * np.cos(angle) + sine[n] * np.sin(angle))
    e = amplitude * np.sin(omega * tau)
    de = amplitude * omega * np.cos(omega * tau)
    q = state[2] - state[4] + state[0]
    dq = state[3] - state[5] + state[1]
    y1 = q - e * cy
    y2 = state[6] - state[8] - cz / cy * q - e * cz
    ny = kappa * clearance(y1, b * cy) + 2 * xi * (dq - de * cy)
    nz = kappa * clearance(y2, b * cz) + 2 * xi * (state[7] - state[9] - cz / cy * dq - de * cz)
    slopes[0] = kappa if abs(y1) > b * cy else 0.0
    slopes[1] = kappa if abs(y2) > b * cz else 0.0
    rows(state, p, ny, nz, load + omega**2 * e, out)


@njit(fastmath=True)
def tangent_field(state, p, slopes, out):
    xi, cy, cz = p[1], p[6], p[7]
    q = state[2] - state[4] + state[0]
    dq = state[3] - state[5] + state[1]
    ny = slopes[0] * q + 2 * xi * dq
    nz = slopes[1] * (state[6] - state[8] - cz / cy * q)
    nz += 2 * xi * (state[7] - state[9] - cz / cy * dq)
    rows(state, p, ny, nz, 0.0, out)


@njit(fastmath=True)
def rows(state, p, ny, nz, drive, out):
    (omega, xi, b, load, scale, amplitude, cy, cz, mp, mg, k1, c1, k2, c2, k3, c3, k4, c4) = p
    for i in range(0, 10, 2):
        out[i] = state[i + 1]
    out[1] = -cy * ny + drive
    out[3] = -cy * mp * ny - 2 * c1 * state[3] - k1 * state[2]
    out[5] = cy * mg * ny - 2 * c2 * state[5] - k2 * state[4]
    out[7] = -cz * mp * nz - 2 * c3 * state[7] - k3 * state[6]
    out[9] = cz * mg * nz - 2 * c4 * state[9] - k4 * state[8]


@njit(parallel=True, fastmath=True)
def integrate_textbook(model, cosine, sine, periods, steps, tangent, end_state, growth):
    """Integrate every lane from rest; growth is filled only with a tangent vector."""
    for lane in prange(end_state.shape[0]):
        h = 2 * np.pi / model.mesh_frequency[lane] / steps
        p = (
            model.mesh_frequency[lane],
            model.damping_ratio[lane],
            model.half_backlash[lane],
            model.load[lane],
            model.stiffness_variation_scale[lane],
            model.error_amplitude[lane],
            np.cos(model.base_helix_angle[lane]),
            np.sin(model.base_helix_angle[lane]),
            model.mass_ratio_p[lane],
            model.mass_ratio_g[lane],
            model.transverse_stiffness_p[lane],
            model.transverse_damping_p[lane],
            model.transverse_stiffness_g[lane],
            model.transverse_damping_g[lane],
            model.axial_stiffness_p[lane],
            model.axial_damping_p[lane],
            model.axial_stiffness_g[lane],
            model.axial_damping_g[lane],
        )
        state, y, total = np.zeros(10), np.empty(10), np.empty(10)
        vector, v, sum_v = np.full(10, 1 / np.sqrt(10.0)), np.empty(10), np.empty(10)
        slope, slope_v, slopes = np.zeros(10), np.zeros(10), np.empty(2)
        for step in range(periods * steps):
            total[:] = 0.0
            sum_v[:] = 0.0
            for stage in range(4):
                c = (0.0, 0.5, 0.5, 1.0)[stage]
                weight = (1.0, 2.0, 2.0, 1.0)[stage]
                for i in range(10):
                    y[i] = state[i] + c * h * slope[i]
                field((step + c) * h, y, p, cosine, sine, slope, slopes)
                for i in range(10):
                    total[i] += weight * slope[i]
                if tangent:
                    for i in range(10):
                        v[i] = vector[i] + c * h * slope_v[i]
                    tangent_field(v, p, slopes, slope_v)
                    for i in range(10):
                        sum_v[i] += weight * slope_v[i]
            for i in range(10):
                state[i] += h / 6 * total[i]
            if tangent:
                for i in range(10):
                    vector[i] += h / 6 * sum_v[i]
                if (step + 1) % steps == 0:
                    length = np.sqrt(np.sum(vector**2))
                    growth[lane] += np.log(length)
                    vector /= length
        end_state[lane] = state


def run_textbook(model: Groups, cosine, sine, periods, steps, tangent):
    """Return end states, shape (lanes, 10) in pairs of displacement and rate, and growth."""
    lanes = model.load.size
    end_state, growth = np.empty((lanes, 10)), np.zeros(lanes)
    integrate_textbook(model, cosine, sine, periods, steps, tangent, end_state, growth)
    return end_state, growth
