"""Flow maps: the flow over a step, to rounding, as one affine map for each set of contact branches.

On a contact branch the equations of motion are linear, with coefficients that depend on the mesh
phase alone. Let x be the state at the beginning of a step, c the numbers that force a lane (its
inputs, such as the load, and the offsets of the engaged flanks), and s run from -1 to 1 over the
step. Then

    state at its end    Phi x + g c                                   (the map itself)
    a gap along it      sum_k s^k (Y_k x + y_k c)                     (``gap``)
    what a deflection of one for a moment at s adds, traced back to the beginning of the step
                        sum_k s^k p_k = K(s) Phi(s -> -1) u / 2       (``switch``)

The last one carries a lane from a branch to the next (`crossings`). All of it depends on the phase
and on what a lane owns, which excludes its inputs and clearances: lanes that share the rest share
their maps.

From the Taylor series about the middle of the step, Psi(0) = 1 and Q = Psi^-1,

    Psi' = (C + sum_j u_j K e_j w_j) Psi / 2,    Q' = -Q (C + ...) / 2,

where C, the mobilities u_j and the rows w_j of the gaps come from the model's formulas, applied
to unit vectors, and e_j is 1 on an engaged flank. Polynomials along the step are cut to fewer terms
as Chebyshev series are. Where the series do not converge to rounding, the step is divided.
"""

from collections.abc import Hashable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.memory.rows import LANES
from gearchaos_kernels.methods.flow_map.layout import layout_of
from gearchaos_kernels.methods.flow_map.series import (
    ORDER,
    TAIL,
    differentiate,
    make_maps,
)
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import Scene, provider_of
from gearchaos_kernels.turns import in_turn

MOST_STEPS = 4096
"""Steps per period beyond which nothing is divided any more."""

FEWEST_RECORDED = 240
"""Steps per period where recorders read every step: extremes come from parabolas."""

MOST_MAP_BYTES = 2**27
"""Maps that are kept in memory, unless those of one group of lanes are more."""


def fewest_steps(plan: Plan) -> int:
    """Return the steps per period of undivided maps: those requested, or a multiple of them."""
    least = FEWEST_RECORDED if plan.records_steps else 1
    return plan.steps_per_period * -(-least // plan.steps_per_period)


def sharing(system: Any) -> NDArray[np.intp]:
    """Return the number of the group of lanes with the same maps of every lane, shape (lanes,)."""
    rows = system.map_parameters()
    if (rows == rows[:1]).all():
        return np.zeros(len(rows), dtype=np.intp)
    _, number = np.unique(rows, axis=0, return_inverse=True)
    return number.reshape(-1).astype(np.intp)


def maps_memory(system: Any, plan: Plan, scene: Scene, stable: NDArray[np.int64]) -> int:
    """Return about how many bytes the maps of lanes that are integrated together take.

    ``stable`` (lanes,): steps per period with which RK4 is stable.
    """
    sizes = _sizes(system, plan, scene, stable)
    # Those that are kept, and those that are being made.
    return 2 * int(min(sizes.sum(), MOST_MAP_BYTES + sizes.max()))


def maps_are_kept(system: Any, plan: Plan, scene: Scene) -> bool:
    """Whether the maps of all lanes are kept, were no step of the plan divided."""
    sizes = _sizes(system, plan, scene, np.zeros(system.lanes))
    return bool(sizes.sum() <= max(MOST_MAP_BYTES, sizes.max()))


def _sizes(system: Any, plan: Plan, scene: Scene, stable: Floats | NDArray[np.int64]) -> Floats:
    """Return about how many bytes the maps of each group of lanes that share them take.

    Series need about as many steps as RK4 to be stable, and two for every harmonic of the
    stiffness; fewer are divided, see `_make`.
    """
    _, first = np.unique(sharing(system), return_index=True)
    needed = stable[first] + 2.0 * system.harmonics()
    steps = fewest_steps(plan)
    divided = steps * 2.0 ** np.ceil(np.log2(np.maximum(needed / steps, 1.0)))
    size = layout_of(scene).step_size
    sizes: Floats = 8 * size * np.minimum(divided, max(steps, MOST_STEPS))
    return sizes


class _Kept:
    """Maps that were made, one behind the other, until no more fit.

    ``places``: steps and beginning of the maps of a lane, by its scene and groups.
    """

    def __init__(self, size: int) -> None:
        self.table = np.empty(max(size, MOST_MAP_BYTES // 8))
        self.used = 0
        self.places: dict[Hashable, tuple[int, int]] = {}

    def keep(self, name: Hashable, maps: Floats) -> None:
        """Keep the maps of a lane, shape (steps, size of a step)."""
        self.table[self.used : self.used + maps.size] = maps.reshape(-1)
        place, self.used = self.used, self.used + maps.size
        # Last: a process that is forked meanwhile has no name without its maps.
        self.places[name] = len(maps), place


_kept = _Kept(0)


@in_turn
def maps_of(
    system: Any, steps: int, scene: Scene, map_bytes: int = MOST_MAP_BYTES
) -> tuple[Floats, NDArray[np.intp]]:
    """Return the maps of the first lanes of a system, as many as fit into this memory.

    And, shape (2, lanes): steps per period of each, a multiple of those requested, and where its
    maps begin. They are kept: the same lanes may be integrated again and again.
    """
    global _kept
    scene = scene.bare()
    name = (steps, type(scene.model), scene.model, scene.resolved, system.map_constants())
    names = [(name, row.tobytes()) for row in system.map_parameters()]
    done, together = 0, 1
    while done < len(names):
        some = range(done, min(done + together, len(names)))
        new = [number for number in some if names[number] not in _kept.places]
        made = _make(system.of(new), steps, scene) if new else []
        size = sum(maps.size for maps in made)
        if _kept.used + size > min(_kept.table.size, max(size, map_bytes // 8)):
            if done:
                break
            # A new table: another call may still be reading the old one.
            _kept = _Kept(size)
            continue
        for number, maps in zip(new, made, strict=True):
            _kept.keep(names[number], maps)
        done += len(some)
        # Lanes side by side need about as many steps.
        steps_made, _ = _kept.places[names[done - 1]]
        size = 8 * steps_made * layout_of(scene).step_size
        together = max(1, min(LANES, map_bytes // (4 * size)))
    return _kept.table, np.array([_kept.places[name] for name in names[:done]], dtype=np.intp).T


def _make(system: Any, steps: int, scene: Scene) -> list[Floats]:
    """Make the maps of lanes, each (steps, size of a step), with steps divided if need be.

    A motion so fast that no steps resolve it has maps that are not a number.
    """
    place, model = layout_of(scene), provider_of(scene.model)
    inputs = np.ascontiguousarray(model.maps.inputs(scene.model))
    system = system.of_unit_inputs()
    made = [np.full((steps, place.step_size), np.nan)] * system.lanes
    left, count = np.arange(system.lanes), steps
    while left.size and count <= max(steps, MOST_STEPS):
        coefficients = system.of(left).coefficients(system.mesh_period[left] / count)
        tables, tails = np.zeros((left.size, count, place.step_size)), np.zeros(left.size)
        edges = system.wave_values(2.0 * np.pi / count * np.arange(count + 1))
        tables[:, :, : place.waves] = edges[:-1]
        tables[:, :, place.waves : 2 * place.waves] = edges[1:]
        width = place.states + 1 + place.waves + place.elements
        matrices = np.zeros((left.size, place.states + place.elements, width))
        differentiate(coefficients, matrices, scene)
        stiffness = model.stiffness(coefficients)
        forcing = system.wave_series(count, ORDER)
        make_maps(matrices, stiffness, inputs, forcing, tables, tails, place)
        for number in np.flatnonzero(tails < TAIL):
            made[left[number]] = tables[number].copy()
        left = left[~(tails < TAIL) & np.isfinite(coefficients).all(axis=1)]
        count *= 2
    return made
