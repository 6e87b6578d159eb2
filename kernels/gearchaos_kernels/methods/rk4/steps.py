"""The classical fourth-order Runge-Kutta step of one lane, and of its tangent vector.

All equations are y' = v, v' = a(t, y, v). With rates per step (w = h v, accelerations times h^2)
the four stages of the classical method (Hairer, Norsett, Wanner 1993, table II.1.2) over a
fraction s of the step become::

    A1 = a(t,         y,                      w)
    A2 = a(t + s h/2, y + s w/2,              w + s A1/2)
    A3 = a(t + s h/2, y + s w/2 + s^2 A1/4,   w + s A2/2)
    A4 = a(t + s h,   y + s w   + s^2 A2/2,   w + s A3)
    y <- y + s w + s^2 (A1 + A2 + A3)/6,      w <- w + s (A1 + 2 A2 + 2 A3 + A4)/6

For a whole step s is the constant 1, which the compiler removes.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.elements import pushes_of, tangent_pushes
from gearchaos_kernels.memory.rows import State
from gearchaos_kernels.memory.tuples import along
from gearchaos_kernels.models.interfaces import (
    accelerations,
    driven,
    elements_at,
    gaps_at,
    unforced,
)


@scalar
def advance(stage, state, s, lane, given, branches, scene):
    """Advance a state by a fraction s of a step; return it and the pushes of its four stages.

    ``stage``: `motion_stage` for a state or `tangent_stage` for a tangent vector; ``given``: for
    each stage the forcing, or for a tangent vector the pushes of the motion; ``branches``: the
    contact branches, or for a tangent vector the variation of the steady input.
    """
    y, w = state
    a1, pushes1 = stage(state, lane, given[0], branches, scene)
    second = State(along(y, 0.5 * s, w), along(w, 0.5 * s, a1))
    a2, pushes2 = stage(second, lane, given[1], branches, scene)
    third = State(along(second.position, 0.25 * s * s, a1), along(w, 0.5 * s, a2))
    a3, pushes3 = stage(third, lane, given[2], branches, scene)
    drifted = along(y, s, w)
    fourth = State(along(drifted, 0.5 * s * s, a2), along(w, s, a3))
    a4, pushes4 = stage(fourth, lane, given[3], branches, scene)
    middle = plus(a2, a3)
    after = State(
        along(drifted, s * s / 6.0, plus(a1, middle)),
        along(w, s / 6.0, along(plus(a1, a4), 2.0, middle)),
    )
    return after, (pushes1, pushes2, pushes3, pushes4)


@scalar
def motion_stage(state, lane, forcing, branches, scene):
    """Return the accelerations of a state, per step squared, and the pushes of the elements."""
    gaps = gaps_at(state, lane, forcing, scene)
    pushes = pushes_of(gaps, elements_at(lane, forcing, scene), branches, scene)
    return accelerations(state, pushes, forcing, lane, scene), pushes


@scalar
def tangent_stage(vector, lane, pushes, varied, scene):
    """Return the accelerations of a tangent vector, per step squared, and the given pushes."""
    added = tangent_pushes(vector, lane, pushes, scene)
    if scene.control is None:
        return accelerations(vector, added, unforced(lane, scene), lane, scene), pushes
    return accelerations(vector, added, driven(lane, varied, scene), lane, scene), pushes


@scalar
def plus(a, b):
    """Return a + b, coordinate by coordinate."""
    return along(a, 1.0, b)
