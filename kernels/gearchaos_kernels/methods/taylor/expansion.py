"""The Taylor series of a motion on its contact branches, term by term.

With x = sum_n x_n t^n, t in steps from the beginning of a piece, the equations of motion give::

    (n + 1) (n + 2) x_(n+2) = A x_n + B (n + 1) x_(n+1) + f_n - sum_j u_j F_jn

    F_jn = e_j sum_m K_jm y_j(n-m) - K_jn o_j + c_j y'_jn

for the force F of element j, whose stiffness K, gap y and forcing f are series as well; e_j is 1 on
an engaged flank and o_j its offset. The model's own formulas compute each term: on a branch they
are linear.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.contact.branches import always_engaged
from gearchaos_kernels.contact.elements import Push
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.memory.block_memory import (
    load_like,
    read_branches,
    read_lane,
    read_state,
    read_varied_input,
    store,
    write_state,
)
from gearchaos_kernels.memory.rows import VECTOR, State
from gearchaos_kernels.memory.tuples import each, scaled
from gearchaos_kernels.methods.taylor import vectors
from gearchaos_kernels.methods.taylor.layout import TERMS, no_waves, series_rows
from gearchaos_kernels.models.interfaces import (
    accelerations,
    driven,
    elements_at,
    gaps_at,
    half_clearances,
    part_of_forcing,
    unforced,
)


@scalar
def expand(memory, first, scene):
    """Compute the series of the eight lanes from slot ``first`` on."""
    vectors.begin_term(memory, first, scene)
    for number in range(TERMS):
        vectors.multiply(memory, first, number, scene)
        inverse = 1.0 / (number + 1.0)
        share = 1.0 if number == 0 else 0.0
        add_term(memory, first, share, inverse, scene)
        if scene.tangent is not None:
            add_tangent_term(memory, first, share, inverse, scene)
        vectors.keep_term(memory, first, number, scene)


@scalar
def branches_of(memory, slot, lane, scene):
    """Return the contact branches of a lane."""
    if scene.resolved is None:
        return each(always_engaged, half_clearances(lane, scene))
    return read_branches(memory, slot, scene)


@scalar
def add_term(memory, first, share, inverse, scene):
    """Replace a term of the state by the next one; ``share``: 1 for the first term, then 0.

    ``inverse``: 1 over the number of the next term.
    """
    at = series_rows(scene)
    for slot in range(first, first + VECTOR):
        lane = read_lane(memory, slot, scene)
        point = load_like(memory, at.wave_term, slot, no_waves(scene))
        forcing = part_of_forcing(lane, share, point, scene)
        state = read_state(memory, at.term, slot, scene)
        gaps = gaps_at(state, lane, forcing, scene)
        elements = elements_at(lane, forcing, scene)
        branches = branches_of(memory, slot, lane, scene)
        values, stiffnesses = each(value_of, gaps), each(stiffness_of, elements)
        products = products_of(memory, slot, (at.sums, at.gaps), values, stiffnesses, share, scene)
        pushes = each(push_of_term, gaps, elements, branches, kinds(scene), products)
        change = accelerations(state, pushes, forcing, lane, scene)
        store(memory, at.gap, slot, values)
        store(memory, at.stiffness, slot, stiffnesses)
        after = State(scaled(state.rate, inverse), scaled(change, inverse))
        write_state(memory, at.term, slot, after, scene)


@scalar
def add_tangent_term(memory, first, share, inverse, scene):
    """Replace a term of the tangent vector by the next one; see `add_term`."""
    at = series_rows(scene)
    for slot in range(first, first + VECTOR):
        lane = read_lane(memory, slot, scene)
        acting = unforced(lane, scene)
        if scene.control is not None:
            acting = driven(lane, share * read_varied_input(memory, slot, scene), scene)
        state = read_state(memory, at.tangent_term, slot, scene)
        gaps = gaps_at(state, lane, acting, scene)
        elements = elements_at(lane, acting, scene)
        branches = branches_of(memory, slot, lane, scene)
        values = each(value_of, gaps)
        stiffnesses = load_like(memory, at.stiffness, slot, values)
        rows = at.tangent_sums, at.tangent_gaps
        products = products_of(memory, slot, rows, values, stiffnesses, share, scene)
        pushes = each(tangent_push_of_term, gaps, elements, branches, kinds(scene), products)
        change = accelerations(state, pushes, acting, lane, scene)
        store(memory, at.tangent_gap, slot, values)
        after = State(scaled(state.rate, inverse), scaled(change, inverse))
        write_state(memory, at.tangent_term, slot, after, scene)


@scalar
def products_of(memory, slot, rows, values, stiffnesses, share, scene):
    """Return a term of stiffness times gap of every element.

    ``rows``: those of the sum without the first and last product, and of the gaps.
    """
    (sums, gaps), at = rows, series_rows(scene)
    inner = load_like(memory, sums, slot, values)
    first_gaps = load_like(memory, gaps, slot, values)
    first_stiffnesses = load_like(memory, at.stiffnesses, slot, values)
    return each(product_of, inner, values, stiffnesses, first_gaps, first_stiffnesses, share)


@scalar
def product_of(inner, value, stiffness, first_gap, first_stiffness, share):
    """Return a term of stiffness times gap; the first one is a single product."""
    constant = stiffness if share != 0.0 else first_stiffness
    varying = 0.0 if share != 0.0 else stiffness * first_gap
    return inner + constant * value + varying


@scalar
def push_of_term(gap, element, branch, kind, product):
    """Return a term of the force of an element; its stiffness is a term as well."""
    damping = element.damping * branch.engaged if kind.damped_in_contact else element.damping
    spring = branch.engaged * product - branch.offset * element.stiffness
    return Push(spring + damping * gap.closing, 0.0, damping)


@scalar
def tangent_push_of_term(gap, element, branch, kind, product):
    """Return a term of the variation of the force of an element."""
    damping = element.damping * branch.engaged if kind.damped_in_contact else element.damping
    return Push(branch.engaged * product + damping * gap.closing, 0.0, damping)


@scalar
def value_of(gap):
    """Return the value of a gap."""
    return gap.value


@scalar
def stiffness_of(element):
    """Return the stiffness of an element."""
    return element.stiffness
