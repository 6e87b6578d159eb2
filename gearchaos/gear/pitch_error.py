"""Pitch error, a sine at mesh frequency with a mean (Pan 2021, eq. 14).

    e(tau) = P [e_0 + e_r sin(Omega tau + phi)]

All arguments broadcast: dimensionless time ``tau``, angular mesh frequency ``mesh_frequency``
(Omega, per unit tau), amplitude e_r and mean e_0 of one pitch error (lengths over the length
scale b'), ``phase`` phi in rad, and ``multiple`` P ("5.86 e(tau)" in the paper is P = 5.86).
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Value: TypeAlias = float | npt.NDArray[np.float64]


def error(
    tau: Value,
    *,
    mesh_frequency: Value,
    amplitude: Value,
    mean: Value = 0.0,
    phase: Value = 0.0,
    multiple: Value = 1.0,
) -> Value:
    """Pitch error e(tau), dimensionless (Pan 2021, eq. 14)."""
    return multiple * (mean + amplitude * np.sin(mesh_frequency * tau + phase))


def rate(
    tau: Value,
    *,
    mesh_frequency: Value,
    amplitude: Value,
    phase: Value = 0.0,
    multiple: Value = 1.0,
) -> Value:
    """First derivative e'(tau), which enters the mesh damping (Pan 2021, eqs 4 and 5)."""
    return multiple * amplitude * mesh_frequency * np.cos(mesh_frequency * tau + phase)


def acceleration(
    tau: Value,
    *,
    mesh_frequency: Value,
    amplitude: Value,
    phase: Value = 0.0,
    multiple: Value = 1.0,
) -> Value:
    """Second derivative e''(tau); -e'' drives delta_5, measured from e (Pan 2021, eq. 13)."""
    return -multiple * amplitude * mesh_frequency**2 * np.sin(mesh_frequency * tau + phase)
