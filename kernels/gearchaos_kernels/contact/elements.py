"""The force of a clearance element, and its variation along a tangent vector.

An element consists of a spring behind a clearance, and of a damper in parallel to both. The damper
always acts, or only while the element is in contact; see `ElementKind`.
"""

from typing import NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.memory.rows import State
from gearchaos_kernels.memory.tuples import along, each
from gearchaos_kernels.models.interfaces import accelerations, elements_at, gaps_at, unforced


class Push(NamedTuple):
    """The force of an element per step squared.

    Attributes
    ----------
    force : float
        The force.
    slope : float
        Its derivative by the gap.
    damping : float
        Its derivative by the rate at which the flanks approach.
    """

    force: float
    slope: float
    damping: float


@scalar
def pushes_of(gaps, elements, branches, scene):
    """Return the push of each element; ``branches``: its contact branches, or None if unknown."""
    if branches is not None:
        return each(push_on, gaps, elements, branches, kinds(scene))
    if scene.clearance is not None:
        return each(push_across, gaps, elements, kinds(scene))
    return each(push_without_clearance, gaps, elements)


@scalar
def push_on(gap, element, branch, kind):
    """Return the push of an element on a contact branch."""
    deflection = branch.engaged * gap.value - branch.offset
    slope = element.stiffness * branch.engaged
    if kind.damped_in_contact:
        damping = element.damping * branch.engaged
        return Push(element.stiffness * deflection + damping * gap.closing, slope, damping)
    force = element.stiffness * deflection + element.damping * gap.closing
    return Push(force, slope, element.damping)


@scalar
def push_across(gap, element, kind):
    """Return the push of an element on the branch of its gap (eqs 22, 23)."""
    b = element.half_clearance
    free = min(gap.value, b) if kind.one_sided else min(max(gap.value, -b), b)
    deflection = gap.value - free
    slope = element.stiffness if deflection != 0.0 else 0.0
    if kind.damped_in_contact:
        damping = element.damping if deflection != 0.0 else 0.0
        return Push(element.stiffness * deflection + damping * gap.closing, slope, damping)
    force = element.stiffness * deflection + element.damping * gap.closing
    return Push(force, slope, element.damping)


@scalar
def push_without_clearance(gap, element):
    """Return the push of an element that has no clearance."""
    force = element.stiffness * gap.value + element.damping * gap.closing
    return Push(force, element.stiffness, element.damping)


@scalar
def tangent_pushes(tangent, lane, pushes, scene):
    """Return the variation of the forces along a tangent vector, with the slopes of these pushes.

    Its Jacobian is that of the active branch. Where all dampers always act, the field is continuous
    across a clearance boundary, and a tangent vector needs no jump matrix there; for others see
    `jumped`.
    """
    forcing = unforced(lane, scene)
    gaps = gaps_at(tangent, lane, forcing, scene)
    return each(tangent_push, gaps, elements_at(lane, forcing, scene), pushes, kinds(scene))


@scalar
def jumped(tangent, element, gaps, before, after, lane, scene):
    """Return a tangent vector after an element has changed its branch from ``before`` to ``after``.

    The force of a damper that acts in contact only jumps there, from f- to f+. The neighbouring
    motion crosses earlier or later, so the tangent vector z becomes z + (f+ - f-) (n z) / (n f-),
    where n f- is the rate of the gap (Leine and Nijmeijer 2004, chapter 7). Without jumps, or
    without a tangent vector, this changes nothing.
    """
    if scene.jumps is None:
        return tangent
    if scene.tangent is None:
        return tangent
    forcing = unforced(lane, scene)
    deviation = gaps_at(tangent, lane, forcing, scene)
    elements = elements_at(lane, forcing, scene)
    engaged = after[element].engaged - before[element].engaged
    # The excitation may move the gap without moving the flanks. At a grazing both rates are 0.
    share = gaps[element].closing / gaps[element].rate if gaps[element].rate != 0.0 else 1.0
    change = engaged * share * deviation[element].value
    pushes = each(jump_of, elements, before, after, kinds(scene), change)
    nothing = State(
        along(tangent.position, -1.0, tangent.position), along(tangent.rate, -1.0, tangent.rate)
    )
    sudden = accelerations(nothing, pushes, forcing, lane, scene)
    return State(tangent.position, along(tangent.rate, 1.0, sudden))


@scalar
def jump_of(element, before, after, kind, change):
    """Return the jump of the force of an element along a tangent vector, 0 where it does not."""
    jumps = kind.damped_in_contact and before.engaged != after.engaged
    return Push(element.damping * change if jumps else 0.0, 0.0, 0.0)


@scalar
def tangent_push(gap, element, push, kind):
    """Return the variation of the force of an element along a tangent vector."""
    damping = push.damping if kind.damped_in_contact else element.damping
    return Push(push.slope * gap.value + damping * gap.closing, push.slope, damping)
