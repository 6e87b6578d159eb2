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

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import accelerations, gaps_at, mesh_forces, tangent_forces
from gearchaos_kernels.rows import Coordinates, State


@scalar
def advance(stage, state, s, lane, given, branches, present):
    """Advance a state by a fraction of a step; return it and the mesh slopes of its four stages.

    ``stage``: `motion`, with the forcing of each as ``given``, or `tangent` for a tangent vector,
    with the slopes of the motion.
    """
    y, w = state
    a1, slopes1 = stage(state, lane, given[0], branches, present)
    second = State(along(y, 0.5 * s, w), along(w, 0.5 * s, a1))
    a2, slopes2 = stage(second, lane, given[1], branches, present)
    third = State(along(second.position, 0.25 * s * s, a1), along(w, 0.5 * s, a2))
    a3, slopes3 = stage(third, lane, given[2], branches, present)
    drifted = along(y, s, w)
    fourth = State(along(drifted, 0.5 * s * s, a2), along(w, s, a3))
    a4, slopes4 = stage(fourth, lane, given[3], branches, present)
    middle = plus(a2, a3)
    after = State(
        along(drifted, s * s / 6.0, plus(a1, middle)),
        along(w, s / 6.0, along(plus(a1, a4), 2.0, middle)),
    )
    return after, (slopes1, slopes2, slopes3, slopes4)


@scalar
def motion(state, lane, forcing, branches, present):
    """Return the accelerations of a state, per step squared, and the slopes of the mesh forces."""
    gaps = gaps_at(state, lane, forcing, present)
    forces, slopes = mesh_forces(gaps, lane, forcing, branches, present)
    return accelerations(state, forces, forcing.drive, lane, present), slopes


@scalar
def tangent(vector, lane, slopes, _branches, present):
    """Return the accelerations of a tangent vector, per step squared, and the slopes."""
    forces = tangent_forces(vector, lane, slopes, present)
    return accelerations(vector, forces, 0.0, lane, present), slopes


@scalar
def plus(a, b):
    """Return a + b, coordinate by coordinate."""
    return along(a, 1.0, b)


@scalar
def along(a, factor, b):
    """Return a + factor * b, coordinate by coordinate."""
    return Coordinates(
        a.torsion + factor * b.torsion,
        a.transverse_p + factor * b.transverse_p,
        a.transverse_g + factor * b.transverse_g,
        a.axial_p + factor * b.axial_p,
        a.axial_g + factor * b.axial_g,
    )
