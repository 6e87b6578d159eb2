"""The classical fourth-order Runge-Kutta step of one lane, and of its tangent vector.

All equations are y' = v, v' = a(t, y, v). With rates per step (w = h v, accelerations times h^2)
the four stages of the classical method (Hairer, Norsett, Wanner 1993, table II.1.2) over a
fraction s of the step become::

    A1 = a(t,         y,                      w)
    A2 = a(t + s h/2, y + s w/2,              w + s A1/2)
    A3 = a(t + s h/2, y + s w/2 + s^2 A1/4,   w + s A2/2)
    A4 = a(t + s h,   y + s w   + s^2 A2/2,   w + s A3)
    y <- y + s w + s^2 (A1 + A2 + A3)/6,      w <- w + s (A1 + 2 A2 + 2 A3 + A4)/6

A whole step has the constant s = 1, which the compiler folds away.
"""

from __future__ import annotations

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.lane import along, plus
from gearchaos_kernels.motion import accelerations, tangent_accelerations


@scalar
def step(y, w, s, lane, start, middle, end, branches, backlash, transverse, axial):
    """Advance one lane by a fraction of a step; return its state and the slopes of the stages."""
    a1, slopes1 = accelerations(y, w, lane, start, branches, backlash, transverse, axial)
    y2 = along(y, 0.5 * s, w)
    w2 = along(w, 0.5 * s, a1)
    a2, slopes2 = accelerations(y2, w2, lane, middle, branches, backlash, transverse, axial)
    y3 = along(y2, 0.25 * s * s, a1)
    w3 = along(w, 0.5 * s, a2)
    a3, slopes3 = accelerations(y3, w3, lane, middle, branches, backlash, transverse, axial)
    drifted = along(y, s, w)
    y4 = along(drifted, 0.5 * s * s, a2)
    w4 = along(w, s, a3)
    a4, slopes4 = accelerations(y4, w4, lane, end, branches, backlash, transverse, axial)
    y_end, w_end = combine(drifted, w, s, a1, a2, a3, a4)
    return y_end, w_end, (slopes1, slopes2, slopes3, slopes4)


@scalar
def tangent_step(y, w, s, lane, slopes, transverse, axial):
    """Advance a tangent vector by the derivative of `step` at the same stages."""
    a1 = tangent_accelerations(y, w, lane, slopes[0], transverse, axial)
    y2 = along(y, 0.5 * s, w)
    w2 = along(w, 0.5 * s, a1)
    a2 = tangent_accelerations(y2, w2, lane, slopes[1], transverse, axial)
    y3 = along(y2, 0.25 * s * s, a1)
    w3 = along(w, 0.5 * s, a2)
    a3 = tangent_accelerations(y3, w3, lane, slopes[2], transverse, axial)
    drifted = along(y, s, w)
    y4 = along(drifted, 0.5 * s * s, a2)
    w4 = along(w, s, a3)
    a4 = tangent_accelerations(y4, w4, lane, slopes[3], transverse, axial)
    return combine(drifted, w, s, a1, a2, a3, a4)


@scalar
def combine(drifted, w, s, a1, a2, a3, a4):
    """Return displacements and rates at the end of the step from the four stages."""
    middle = plus(a2, a3)
    y_end = along(drifted, s * s / 6.0, plus(a1, middle))
    w_end = along(w, s / 6.0, along(plus(a1, a4), 2.0, middle))
    return y_end, w_end
