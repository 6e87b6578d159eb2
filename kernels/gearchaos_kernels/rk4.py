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

from gearchaos_kernels.block_memory import Coordinates, State
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.equations import accelerations, gaps_at, mesh_forces, tangent_forces


@scalar
def step(state, s, lane, during, branches, present):
    """Advance a state by a fraction of a step; return it and the mesh slopes of the four stages."""
    y, w = state
    a1, slopes1 = stage(state, lane, during.begin, branches, present)
    second = State(along(y, 0.5 * s, w), along(w, 0.5 * s, a1))
    a2, slopes2 = stage(second, lane, during.middle, branches, present)
    third = State(along(second.position, 0.25 * s * s, a1), along(w, 0.5 * s, a2))
    a3, slopes3 = stage(third, lane, during.middle, branches, present)
    drifted = along(y, s, w)
    fourth = State(along(drifted, 0.5 * s * s, a2), along(w, s, a3))
    a4, slopes4 = stage(fourth, lane, during.end, branches, present)
    return combine(drifted, w, s, a1, a2, a3, a4), (slopes1, slopes2, slopes3, slopes4)


@scalar
def tangent_step(tangent, s, lane, slopes, present):
    """Advance a tangent vector by the derivative of `step` at the same stages."""
    y, w = tangent
    a1 = tangent_stage(tangent, lane, slopes[0], present)
    second = State(along(y, 0.5 * s, w), along(w, 0.5 * s, a1))
    a2 = tangent_stage(second, lane, slopes[1], present)
    third = State(along(second.position, 0.25 * s * s, a1), along(w, 0.5 * s, a2))
    a3 = tangent_stage(third, lane, slopes[2], present)
    drifted = along(y, s, w)
    fourth = State(along(drifted, 0.5 * s * s, a2), along(w, s, a3))
    a4 = tangent_stage(fourth, lane, slopes[3], present)
    return combine(drifted, w, s, a1, a2, a3, a4)


@scalar
def stage(state, lane, forcing, branches, present):
    """Return the accelerations of a state, per step squared, and the slopes of the mesh forces."""
    gaps = gaps_at(state, lane, forcing, present)
    forces, slopes = mesh_forces(gaps, lane, forcing.stiffness, branches, present)
    return accelerations(state, forces, forcing.drive, lane, present), slopes


@scalar
def tangent_stage(tangent, lane, slopes, present):
    """Return the accelerations of a tangent vector, per step squared."""
    forces = tangent_forces(tangent, lane, slopes, present)
    return accelerations(tangent, forces, 0.0, lane, present)


@scalar
def combine(drifted, w, s, a1, a2, a3, a4):
    """Return the state at the end of the step from the four stages."""
    middle = plus(a2, a3)
    return State(
        along(drifted, s * s / 6.0, plus(a1, middle)),
        along(w, s / 6.0, along(plus(a1, a4), 2.0, middle)),
    )


@scalar
def plus(a, b):
    """Return a + b, coordinate by coordinate."""
    return Coordinates(
        a.torsion + b.torsion,
        a.transverse_p + b.transverse_p,
        a.transverse_g + b.transverse_g,
        a.axial_p + b.axial_p,
        a.axial_g + b.axial_g,
    )


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
