"""The classical fourth-order Runge-Kutta step of one lane, and of its tangent vector.

All equations are y' = v, v' = a(t, y, v). With rates per step (w = h v, accelerations times h^2)
the four stages of the classical method (Hairer, Norsett, Wanner 1993, table II.1.2) become::

    A1 = a(t,       y,                  w)
    A2 = a(t + h/2, y + w/2,            w + A1/2)
    A3 = a(t + h/2, y + w/2 + A1/4,     w + A2/2)
    A4 = a(t + h,   y + w   + A2/2,     w + A3)
    y <- y + w + (A1 + A2 + A3)/6,      w <- w + (A1 + 2 A2 + 2 A3 + A4)/6
"""

from __future__ import annotations

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.lane import along, plus
from gearchaos_kernels.motion import accelerations, tangent_accelerations


@scalar
def step(y, w, lane, start, middle, end, backlash, transverse, axial):
    """Advance one lane by one step and return the state and the slopes of the four stages."""
    a1, slopes1 = accelerations(y, w, lane, start, backlash, transverse, axial)
    y2 = along(y, 0.5, w)
    w2 = along(w, 0.5, a1)
    a2, slopes2 = accelerations(y2, w2, lane, middle, backlash, transverse, axial)
    y3 = along(y2, 0.25, a1)
    w3 = along(w, 0.5, a2)
    a3, slopes3 = accelerations(y3, w3, lane, middle, backlash, transverse, axial)
    drifted = plus(y, w)
    y4 = along(drifted, 0.5, a2)
    w4 = plus(w, a3)
    a4, slopes4 = accelerations(y4, w4, lane, end, backlash, transverse, axial)
    y_end, w_end = combine(drifted, w, a1, a2, a3, a4)
    return y_end, w_end, (slopes1, slopes2, slopes3, slopes4)


@scalar
def tangent_step(y, w, lane, slopes, transverse, axial):
    """Advance a tangent vector by the derivative of `step` at the same stages."""
    a1 = tangent_accelerations(y, w, lane, slopes[0], transverse, axial)
    y2 = along(y, 0.5, w)
    w2 = along(w, 0.5, a1)
    a2 = tangent_accelerations(y2, w2, lane, slopes[1], transverse, axial)
    y3 = along(y2, 0.25, a1)
    w3 = along(w, 0.5, a2)
    a3 = tangent_accelerations(y3, w3, lane, slopes[2], transverse, axial)
    drifted = plus(y, w)
    y4 = along(drifted, 0.5, a2)
    w4 = plus(w, a3)
    a4 = tangent_accelerations(y4, w4, lane, slopes[3], transverse, axial)
    return combine(drifted, w, a1, a2, a3, a4)


@scalar
def combine(drifted, w, a1, a2, a3, a4):
    """Return displacements and rates at the end of the step from the four stages."""
    middle = plus(a2, a3)
    y_end = along(drifted, 1.0 / 6.0, plus(a1, middle))
    w_end = along(w, 1.0 / 6.0, along(plus(a1, a4), 2.0, middle))
    return y_end, w_end
