"""Flow maps: the exact flow over a step, as one affine map for each set of contact branches.

On a contact branch the equations of motion are linear, and their coefficients depend on the mesh
phase only. Let x be the state at the beginning of a step, c the inputs of a lane (such as its load)
and the offsets of its engaged flanks, and let s run from -1 to 1 over the step. Then

    state at the end of the step    Phi x + g c                                (the map)
    a gap along the step            sum_k s^k (Y_k x + y_k c)                  (``gap``)
    effect of an instantaneous unit deflection at s, traced back to the beginning of the step
                                    sum_k s^k p_k = K(s) Phi(s -> -1) u / 2    (``switch``)

The last one transfers a lane from one branch to the next (`crossings`). Phi, g, Y, y and p depend
on the mesh phase and on the parameters of a lane, but not on its inputs and clearances. Lanes that
differ in those only share their maps.

The maps come from Taylor series about the middle of the step, with Psi(0) = 1 and Q = Psi^-1:

    Psi' = (C + sum_j u_j K e_j w_j) Psi / 2,    Q' = -Q (C + ...) / 2.

C, the mobilities u_j and the rows w_j of the gaps follow from the model's formulas, applied to unit
vectors; e_j is 1 on an engaged flank and 0 otherwise. Polynomials along the step are cut to fewer
terms as Chebyshev series. If the series do not converge to rounding, the number of steps is
doubled.
"""

import sys
from collections.abc import Hashable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.memory.rows import LANES
from gearchaos_kernels.methods.flow_map.interpolation import Between, interpolated
from gearchaos_kernels.methods.flow_map.layout import MOST_SETS_IN_ADVANCE, layout_of
from gearchaos_kernels.methods.flow_map.making import MOST_MAP_STEPS, make_tables
from gearchaos_kernels.methods.substeps import multiple_of
from gearchaos_kernels.plan import MAP_BYTES, Floats, Plan
from gearchaos_kernels.scene import Scene, provider_of
from gearchaos_kernels.turns import in_turn

MAKING, READING, MOVING = 11_000.0, 15.0, 2.5
"""Time to make the maps of a step, to read them, and to move one lane by them, in RK4 steps.

They are medians over scenes of two, six and ten states, with and without a tangent vector.
"""

SETS_VISITED = 16
"""Sets of branches that a motion visits, as an estimate, where maps are made on demand.

Motions without separation stay on one set; those that rattle visit up to 64 of a planetary set.
"""

MAKING_ON_DEMAND, READING_ON_DEMAND, MOVING_ON_DEMAND = 1_500.0 * SETS_VISITED, 6.0, 1.0
"""The same times where maps are made on demand, medians of a planetary set of 34 states."""


def fewest_steps(plan: Plan) -> int:
    """Return the fewest steps per period that maps may have, a multiple of those requested."""
    return multiple_of(plan.steps_per_period, plan.records_steps)


def sharing(system: Any) -> NDArray[np.intp]:
    """Return the number of the group of each lane, shape (lanes,); a group shares its maps."""
    rows = system.map_parameters()
    (differ,) = np.nonzero((rows != rows[:1]).any(axis=0))
    if not differ.size:
        return np.zeros(len(rows), dtype=np.intp)
    # The rows have the order of their first columns that differ; one column is sorted faster.
    some = rows[:, differ[0]] if differ.size == 1 else rows[:, differ]
    _, number = np.unique(some, axis=0, return_inverse=True)
    return number.reshape(-1).astype(np.intp)


def maps_memory(system: Any, plan: Plan, scene: Scene, stable: NDArray[np.int64]) -> int:
    """Estimate the bytes of the maps of lanes that are integrated together.

    ``stable`` (lanes,): steps per period with which RK4 is stable.
    """
    sizes = _sizes(system, plan, scene, stable)
    # Twice: the maps that are kept, and the maps that are being computed.
    return 2 * int(min(sizes.sum(), MAP_BYTES + sizes.max()))


def maps_are_kept(system: Any, plan: Plan, scene: Scene) -> bool:
    """Return whether the maps of all lanes fit into memory, if the number of steps suffices."""
    sizes = _sizes(system, plan, scene, np.zeros(system.lanes))
    return bool(sizes.sum() <= max(MAP_BYTES, sizes.max()))


def work(system: Any, plan: Plan, stable: NDArray[np.int64]) -> float:
    """Estimate the time of an integration in RK4 steps of one lane.

    ``stable`` (lanes,): steps per period with which RK4 is stable.
    """
    _, first, lanes = np.unique(sharing(system), return_index=True, return_counts=True)
    periods, flags = plan.transient_periods + plan.recorded_periods, system.flags()
    making, reading, moving = MAKING, READING, MOVING
    elements = provider_of(flags).elements(flags)
    if system.clearance and 2**elements > MOST_SETS_IN_ADVANCE:
        making, reading, moving = MAKING_ON_DEMAND, READING_ON_DEMAND, MOVING_ON_DEMAND
    step = making + periods * (reading + moving * lanes)
    return float(np.sum(_steps_needed(system, plan, stable[first]) * step))


def _steps_needed(system: Any, plan: Plan, stable: Floats | NDArray[np.int64]) -> Floats:
    """Estimate the steps per period of the maps of each group of lanes, shape (groups,).

    Series converge with about as many steps as RK4 needs to be stable, ``stable`` (groups,), and
    with two for every harmonic of the stiffness. If the plan has fewer steps, `_make` doubles them.
    """
    needed = np.maximum(stable, 2.0 * system.harmonics()) + 2.0
    steps = fewest_steps(plan)
    divided = steps * 2.0 ** np.ceil(np.log2(np.maximum(needed / steps, 1.0)))
    fewest: Floats = np.minimum(divided, max(steps, MOST_MAP_STEPS))
    return fewest


def _sizes(system: Any, plan: Plan, scene: Scene, stable: Floats | NDArray[np.int64]) -> Floats:
    """Estimate the bytes of the maps of each group of lanes, shape (groups,)."""
    _, first = np.unique(sharing(system), return_index=True)
    place = layout_of(scene)
    sets = min(2**place.elements, SETS_VISITED) if place.on_demand else 1
    sizes: Floats = 8.0 * sets * place.step_size * _steps_needed(system, plan, stable[first])
    return sizes


def which_maps(scene: Scene) -> tuple[object, ...]:
    """Return what the maps of a scene depend on besides its model."""
    return scene.resolved, scene.jumps, scene.traced


class _Kept:
    """Computed maps in one table, one after the other, until no more fit.

    ``places``: steps per period and place of the maps of a lane, by scene and parameters; see
    `on_demand` for those of single sets of branches. ``steps``: those of the last maps, by scene.
    """

    def __init__(self, size: int) -> None:
        self.table = np.empty(max(size, MAP_BYTES // 8))
        self.used = 0
        self.places: dict[Hashable, tuple[int, int]] = {}
        self.steps: dict[Hashable, int] = {}

    def keep(self, name: tuple[Hashable, bytes], maps: Floats | Between) -> None:
        """Store the maps of a lane, shape (steps, size of a step), by scene and parameters."""
        target = self.table[self.used : self.used + maps.size]
        if isinstance(maps, Between):
            maps.write(target)
            steps = maps.steps
        else:
            target[:] = maps.reshape(-1)
            steps = len(maps)
        self.steps[name[0]] = steps
        place, self.used = self.used, self.used + maps.size
        # Last, so that a process forked meanwhile finds no name without its maps.
        self.places[name] = steps, place

    def emptied(self, size: int) -> "_Kept":
        """Return an empty table of at least this size: this one, unless a call still reads it."""
        # Its own attribute and the argument of getrefcount are two references.
        if sys.getrefcount(self.table) > 2 or size > self.table.size:
            return _Kept(size)
        # Memory that is in use already takes no page faults.
        self.places.clear()
        self.used = 0
        return self


_kept = _Kept(0)


@in_turn
def maps_of(
    system: Any, steps: int, scene: Scene, map_bytes: int = MAP_BYTES, along: int = -1
) -> tuple[Floats, NDArray[np.intp]]:
    """Return the maps of the first lanes of a system, as many as fit into the memory.

    Also returns an array of shape (2, lanes): the steps per period of each lane, a multiple of
    those requested, and the place of its maps. The maps are kept for later calls. ``along``: see
    `Plan.interpolated`.
    """
    global _kept
    scene = scene.bare()
    name = (
        steps,
        type(scene.model),
        scene.model,
        *which_maps(scene),
        system.map_constants(),
        along,
    )
    names = [(name, row.tobytes()) for row in system.map_parameters()]
    done, step_size = 0, layout_of(scene).step_size
    while done < len(names):
        # Lanes of a scene need about the same number of steps. The first one is made alone.
        made_last = _kept.steps.get(name)
        most = map_bytes // (32 * made_last * step_size) if made_last else 1
        some = range(done, min(done + max(1, min(LANES, most)), len(names)))
        new = [number for number in some if names[number] not in _kept.places]
        made = _make(system.of(new), steps, scene, along, name) if new else []
        size = sum(maps.size for maps in made)
        if _kept.used + size > min(_kept.table.size, max(size, map_bytes // 8)):
            if done:
                break
            _kept = _kept.emptied(size)
            continue
        for number, maps in zip(new, made, strict=True):
            _kept.keep(names[number], maps)
        done += len(some)
    return _kept.table, np.array([_kept.places[name] for name in names[:done]], dtype=np.intp).T


def _make(
    system: Any, steps: int, scene: Scene, along: int = -1, name: Hashable = None
) -> list[Floats | Between]:
    """Compute the maps of lanes, each of shape (steps, size of a step), with enough steps.

    If not even `MOST_MAP_STEPS` suffice, the maps are NaN. ``along`` and ``name``: see
    `interpolated`.
    """
    place = layout_of(scene)
    made: list[Floats | Between] = [np.full((0, 0), np.nan)] * system.lanes
    left, count = np.arange(system.lanes), steps
    if along >= 0:
        between = interpolated(system, steps, scene, along, name)
        made = [one if given is None else given for one, given in zip(made, between, strict=True)]
        left = np.array([number for number in left if between[number] is None], dtype=np.intp)
    for number in left:
        made[number] = np.full((steps, place.step_size), np.nan)
    while left.size and count <= max(steps, MOST_MAP_STEPS):
        sets = np.tile(np.arange(place.branches), (left.size, 1))
        tables, converged, finite = make_tables(system.of(left), sets, count, scene)
        for number in np.flatnonzero(converged):
            made[left[number]] = tables[number].copy()
        left = left[~converged & finite]
        count *= 2
    return made
