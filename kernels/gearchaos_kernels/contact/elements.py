"""The force of a clearance element, and what a tangent vector adds to it.

An element sees a gap. Its force is that of a spring behind a clearance and of a damper beside both.
"""

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.models.interfaces import elements_at, gaps_at, unforced


class Push(NamedTuple):
    """The force of an element, and its slope d(force)/d(gap)."""

    force: float
    slope: float


@scalar
def pushes_of(gaps, elements, branches, scene):
    """Return the push of each element, on branches if they are given."""
    if branches is not None:
        return each(push_on, gaps, elements, branches)
    if scene.clearance is not None:
        return each(push_across, gaps, elements)
    return each(push_without_clearance, gaps, elements)


@scalar
def push_on(gap, element, branch):
    """Return the push of an element on a contact branch."""
    deflection = branch.engaged * gap.value - branch.offset
    slope = element.stiffness * branch.engaged
    return Push(element.stiffness * deflection + element.damping * gap.closing, slope)


@scalar
def push_across(gap, element):
    """Return the push of an element on the branch on which its gap lies (eqs 22, 23)."""
    b = element.half_clearance
    deflection = gap.value - min(max(gap.value, -b), b)
    slope = element.stiffness if deflection != 0.0 else 0.0
    return Push(element.stiffness * deflection + element.damping * gap.closing, slope)


@scalar
def push_without_clearance(gap, element):
    """Return the push of an element that has no clearance."""
    force = element.stiffness * gap.value + element.damping * gap.closing
    return Push(force, element.stiffness)


@scalar
def tangent_pushes(tangent, lane, pushes, scene):
    """Return what a tangent vector adds to the forces where they have the slopes of these pushes.

    The field is continuous across a clearance boundary, so the variational equation needs no jump
    matrix there: its Jacobian is that of the active branch.
    """
    forcing = unforced(lane, scene)
    gaps = gaps_at(tangent, lane, forcing, scene)
    return each(tangent_push, gaps, elements_at(lane, forcing, scene), pushes)


@scalar
def tangent_push(gap, element, push):
    """Return what a tangent vector adds to the force of an element."""
    return Push(push.slope * gap.value + element.damping * gap.closing, push.slope)
