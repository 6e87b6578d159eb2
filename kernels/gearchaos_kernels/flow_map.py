"""The flow of eq. 13 over a step, to rounding: one affine map for each pair of contact branches.

On a contact branch eq. 13 is linear, with coefficients that depend on the mesh phase alone. With x
the state at the beginning of a step and c the few numbers that force a lane (load, the offsets of
the engaged flanks, both parts of its pitch error), and s running from -1 to 1 over the step,

    state at its end    Phi x + g c                                   (`END`)
    a gap along it      sum_k s^k (Y_k x + y_k c)                     (`GAP`)
    what a deflection of one for a moment at s adds, traced back to the beginning of the step
                        sum_k s^k p_k = K(s) Phi(s -> -1) u / 2       (`SWITCH`)

The last one carries a lane from a branch to the next (`flow_steps`). All of it depends on the phase
and on the groups other than load, error and clearance: lanes that share those share their maps.

From the Taylor series about the middle of the step, Psi(0) = 1 and Q = Psi^-1,

    Psi' = (C + u_y K e_y w_y + u_z K e_z w_z) Psi / 2,    Q' = -Q (C + ...) / 2,

where C, the mobilities u and the rows w of the gaps come from the formulas of `equations`, applied
to unit vectors, and e is 1 on an engaged flank. Polynomials along the step are cut to fewer terms
as Chebyshev series are. Where the series do not converge to rounding, the step is divided.
"""

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.block_memory import Present, flags
from gearchaos_kernels.coefficients import lane_coefficients
from gearchaos_kernels.flow_layout import Layout, layout
from gearchaos_kernels.flow_series import TAIL, differentiate, make_maps, series_of_forcing
from gearchaos_kernels.rows import LANES
from gearchaos_kernels.system import Floats, Groups, Plan, System
from gearchaos_kernels.turns import in_turn

MOST_STEPS = 4096
"""Steps per period beyond which nothing is divided any more."""

TOLD_STEPS = 240
"""Steps per period that loads need, which come from parabolas, and extremes and amplitudes."""

MOST_MAP_BYTES = 2**27
"""Maps that are kept in memory, unless those of one group of lanes are more."""

_UNIT = {
    "load": 0.0,
    "half_backlash": 0.0,
    "error_mean": 0.0,
    "error_amplitude": 1.0,
    "error_phase": 0.0,
}

OWN = [name for name in Groups._fields if name not in _UNIT]
"""Groups on which the maps depend."""


def fewest_steps(plan: Plan) -> int:
    """Return the steps per period of undivided maps: those asked for, or a multiple of them."""
    least = TOLD_STEPS if plan.told_by_steps else 1
    return plan.steps_per_period * -(-least // plan.steps_per_period)


def sharing(system: System) -> NDArray[np.intp]:
    """Return the number of the group of lanes with the same maps of every lane, shape (lanes,)."""
    rows = _own_groups(system)
    if (rows == rows[:1]).all():
        return np.zeros(len(rows), dtype=np.intp)
    _, number = np.unique(rows, axis=0, return_inverse=True)
    return number.reshape(-1).astype(np.intp)


def maps_memory(system: System, plan: Plan, stable: NDArray[np.int64]) -> int:
    """Return about how many bytes the maps of lanes that are integrated together take.

    ``stable`` (lanes,): steps per period with which RK4 is stable.
    """
    sizes = _sizes(system, plan, stable)
    # Those that are kept, and those that are being made.
    return 2 * int(min(sizes.sum(), MOST_MAP_BYTES + sizes.max()))


def maps_are_kept(system: System, plan: Plan) -> bool:
    """Whether the maps of all lanes are kept, were no step of the plan divided."""
    sizes = _sizes(system, plan, np.zeros(system.lanes))
    return bool(sizes.sum() <= max(MOST_MAP_BYTES, sizes.max()))


def _sizes(system: System, plan: Plan, stable: Floats | NDArray[np.int64]) -> Floats:
    """Return about how many bytes the maps of each group of lanes that share them take.

    Series need about as many steps as RK4 to be stable, and two for every harmonic of the
    stiffness; fewer are divided, see `_make`.
    """
    place: Layout = layout.py_func(flags(system, plan))
    harmonics = system.stiffness_cosine.size if system.effects.stiffness_variation else 0
    _, first = np.unique(sharing(system), return_index=True)
    needed = stable[first] + 2.0 * harmonics
    steps = fewest_steps(plan)
    divided = steps * 2.0 ** np.ceil(np.log2(np.maximum(needed / steps, 1.0)))
    sizes: Floats = 8 * place.step_size * np.minimum(divided, max(steps, MOST_STEPS))
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
    system: System, steps: int, present: Present, map_bytes: int = MOST_MAP_BYTES
) -> tuple[Floats, NDArray[np.intp]]:
    """Return the maps of the first lanes of a system, as many as fit into so much memory.

    And, shape (2, lanes): steps per period of each, a multiple of those asked for, and where its
    maps begin. They are kept: the same lanes may be integrated again and again.
    """
    global _kept
    present = present._replace(tangent=None, contact=None, loads=None)
    waves = system.stiffness_cosine, system.stiffness_sine
    scene = (steps, present, system.physical, *(wave.tobytes() for wave in waves))
    names = [(scene, row.tobytes()) for row in _own_groups(system)]
    done, together = 0, 1
    while done < len(names):
        some = range(done, min(done + together, len(names)))
        new = [number for number in some if names[number] not in _kept.places]
        made = _make(system.of(new), steps, present) if new else []
        size = sum(maps.size for maps in made)
        if _kept.used + size > min(_kept.table.size, max(size, map_bytes // 8)):
            if done:
                break
            # A new table: somebody may still be reading the old one.
            _kept = _Kept(size)
            continue
        for number, maps in zip(new, made, strict=True):
            _kept.keep(names[number], maps)
        done += len(some)
        # Lanes side by side need about as many steps.
        steps_made, _ = _kept.places[names[done - 1]]
        size = 8 * steps_made * layout.py_func(present).step_size
        together = max(1, min(LANES, map_bytes // (4 * size)))
    return _kept.table, np.array([_kept.places[name] for name in names[:done]], dtype=np.intp).T


def _own_groups(system: System) -> Floats:
    """Return the groups on which maps depend, shape (lanes, groups)."""
    return np.array([getattr(system.groups, name) for name in OWN]).T.copy()


def _make(system: System, steps: int, present: Present) -> list[Floats]:
    """Make the maps of lanes, each (steps, size of a step), with steps divided if need be.

    A motion so fast that no steps resolve it has maps that are not a number.
    """
    place: Layout = layout.py_func(present)
    unit = {name: np.full(system.lanes, value) for name, value in _UNIT.items()}
    system = system._replace(groups=system.groups._replace(**unit))
    made = [np.full((steps, place.step_size), np.nan)] * system.lanes
    left, count = np.arange(system.lanes), steps
    while left.size and count <= max(steps, MOST_STEPS):
        coefficients = lane_coefficients(system.of(left), system.mesh_period[left] / count)
        tables, tails = np.zeros((left.size, count, place.step_size)), np.zeros(left.size)
        edges = 2.0 * np.pi / count * np.arange(count + 1)
        for column, values in enumerate((np.sin(edges), np.cos(edges))):
            tables[:, :, column], tables[:, :, column + 2] = values[:-1], values[1:]
        matrices = np.zeros((left.size, place.states + 2, place.states + 5))
        differentiate(coefficients, matrices, present)
        forcing = series_of_forcing(system, count)
        make_maps(matrices, coefficients, forcing, tables, tails, place)
        for number in np.flatnonzero(tails < TAIL):
            made[left[number]] = tables[number].copy()
        left = left[~(tails < TAIL) & np.isfinite(coefficients).all(axis=1)]
        count *= 2
    return made
