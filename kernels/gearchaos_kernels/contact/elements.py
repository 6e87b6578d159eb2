"""The force of a clearance element, and its variation along a tangent vector.

An element consists of a spring behind a clearance, and of a damper in parallel to both.
"""

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.tuples import each
from gearchaos_kernels.models.interfaces import elements_at, gaps_at, unforced


class Push(NamedTuple):
    """The force of an element per step squared, and its slope d(force)/d(gap)."""

    force: float
    slope: float


@scalar
def pushes_of(gaps, elements, branches, scene):
    """Return the push of each element; ``branches``: its contact branches, or None if unknown."""
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
    """Return the push of an element on the branch of its gap (eqs 22, 23)."""
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
    """Return the variation of the forces along a tangent vector, with the slopes of these pushes.

    The field is continuous across a clearance boundary. The variational equation therefore needs no
    jump matrix there: its Jacobian is that of the active branch.
    """
    forcing = unforced(lane, scene)
    gaps = gaps_at(tangent, lane, forcing, scene)
    return each(tangent_push, gaps, elements_at(lane, forcing, scene), pushes)


@scalar
def tangent_push(gap, element, push):
    """Return the variation of the force of an element along a tangent vector."""
    return Push(push.slope * gap.value + element.damping * gap.closing, push.slope)
