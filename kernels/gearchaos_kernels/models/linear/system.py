"""A batch of piecewise-linear systems: their matrices, and what the engine derives from them."""

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.models.linear.model import Linear
from gearchaos_kernels.models.linear.motion import (
    accelerations_of,
    flanks_of,
    forces_of,
    gaps_of,
    moving,
)
from gearchaos_kernels.models.linear.structure import (
    MATRICES,
    Structure,
    entries_of,
    structure_of,
)
from gearchaos_kernels.models.mesh_phase import half_step_angles, harmonic_series
from gearchaos_kernels.models.waves import waves_of
from gearchaos_kernels.plan import Floats

if TYPE_CHECKING:
    from gearchaos_kernels.control import Control

MOST_MAPPED = 52
"""Largest number of clearance elements of a system that flow maps integrate.

A double represents sets of as many elements, 2**j for element j, without rounding.
"""


@dataclass(frozen=True)
class LinearSystems(LaneSystem):
    """A batch of piecewise-linear systems with n coordinates and m clearance elements.

    All matrices are those after a multiplication by the inverse of the mass matrix M. Waves are the
    constant 1, then cosine and sine of each harmonic, w = 1 + 2 (number of harmonics).

    Attributes
    ----------
    frequency : array, shape (lanes,)
        Angular frequency of the excitation, whose period is the mesh period.
    position, rate : array, shape (lanes, n, n)
        M^-1 K and M^-1 C.
    reaction : array, shape (lanes, n, m)
        M^-1 r_j, the accelerations by a unit force of each element with opposite sign.
    force : array, shape (lanes, n, w)
        M^-1 f, as parts of the waves.
    gap : array, shape (lanes, m, n)
        The rows n_j.
    motion, stiffness : array, shape (lanes, m, w)
        e_j and k_j, as parts of the waves.
    damping, half_clearance : array, shape (lanes, m)
        Damping coefficient and half clearance of each element.
    orders : tuple of int
        Orders of the harmonics that excite the systems, of the fundamental one with ``frequency``.
    one_sided, damped_in_contact : tuple of bool
        See `ElementKind`.
    names : tuple of str
        Names of the coordinates; by default x0, x1 and so on.
    actuator : array, shape (lanes, n), optional
        Accelerations by an input of 1 that a controller adds. Without a controller it has no
        effect.
    actuated : array, shape (lanes,), optional
        The steady input along the actuator, which ``force`` already contains.

    Examples
    --------
    x'' + 0.1 x' + D(x; 1) = 0.1 + 0.1 cos(0.7 tau)::

        LinearSystems(
            frequency=np.array([0.7]),
            position=np.zeros((1, 1, 1)), rate=np.zeros((1, 1, 1)),
            reaction=np.ones((1, 1, 1)), gap=np.ones((1, 1, 1)),
            force=np.array([[[0.1, 0.1, 0.0]]]), motion=np.zeros((1, 1, 3)),
            stiffness=np.array([[[1.0, 0.0, 0.0]]]),
            damping=np.array([[0.1]]), half_clearance=np.ones((1, 1)), orders=(1,),
        )
    """

    frequency: Floats
    position: Floats
    rate: Floats
    reaction: Floats
    force: Floats
    gap: Floats
    motion: Floats
    stiffness: Floats
    damping: Floats
    half_clearance: Floats
    orders: tuple[int, ...] = ()
    one_sided: tuple[bool, ...] = ()
    damped_in_contact: tuple[bool, ...] = ()
    names: tuple[str, ...] = ()
    actuator: Floats | None = None
    actuated: Floats | None = None

    @property
    def mesh_period(self) -> Floats:
        """Duration of a period of the excitation in units of tau, shape (lanes,)."""
        period: Floats = 2.0 * np.pi / self.frequency
        return period

    @cached_property
    def structure(self) -> Structure:
        """Which numbers of the systems are not zero in some lane."""
        count = self.gap.shape[1]
        return structure_of(
            coordinates=self.gap.shape[2],
            elements=count,
            orders=self.orders,
            one_sided=self.one_sided or (False,) * count,
            damped_in_contact=self.damped_in_contact or (False,) * count,
            **{name: entries_of(self._matrix(name)) for name in MATRICES},
        )

    def flags(self) -> Linear:
        """Return the structure, for which a loop is compiled."""
        return Linear(self.structure)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: each coordinate, followed by its rate."""
        names = self.names or tuple(f"x{number}" for number in range(self.gap.shape[2]))
        return tuple(name + kind for name in names for kind in ("", "_rate"))

    @property
    def clearance(self) -> bool:
        """Whether some element has a clearance or only one side."""
        return bool(np.any(self.half_clearance)) or any(self.one_sided)

    def coefficients(self, step: Floats) -> Floats:
        """Return the coefficients of every lane, in the order of `MATRICES` and `Places`."""
        once, twice = step[:, np.newaxis], step[:, np.newaxis] ** 2
        # Forces of springs and elements decelerate.
        factors = {
            "position": -twice,
            "rate": -once,
            "reaction": -1.0,
            "force": twice,
            "motion_rate": once,
            "stiffness": twice,
        }
        columns = []
        added = [np.zeros_like(once)] if self.structure.actuator else []
        for name in MATRICES:
            rows, entries = self.structure.indices[name]
            factor = np.asarray(factors.get(name, 1.0))
            columns.append(self._matrix(name)[:, rows, entries] * factor)
        return np.concatenate(
            [*columns, self.damping * once, self.half_clearance, 1.0 / once, *added], axis=1
        )

    def _matrix(self, name: str) -> Floats:
        """Return the matrix of every lane, shape (lanes, rows, columns)."""
        if name == "actuator":
            # Without a controller the scene is that of a system without an actuator.
            none = self.control is None or self.actuator is None
            return np.zeros((self.lanes, self.gap.shape[2], 1)) if none else self._direction
        matrix: Floats = getattr(self, name)
        return matrix

    @property
    def motion_rate(self) -> Floats:
        """The rates of e_j per unit of tau, as parts of the waves, shape (lanes, m, w)."""
        speeds = np.multiply.outer(self.frequency, self.orders)[:, np.newaxis]
        rates = np.zeros_like(self.motion)
        rates[..., 1::2] = speeds * self.motion[..., 2::2]
        rates[..., 2::2] = -speeds * self.motion[..., 1::2]
        return rates

    @property
    def _direction(self) -> Floats:
        """The actuator as a matrix, shape (lanes, n, 1)."""
        assert self.actuator is not None
        return self.actuator[:, :, np.newaxis]

    @property
    def steady_input(self) -> Floats:
        """The steady input of every lane, shape (lanes,); 0 without an actuator."""
        return np.zeros(self.lanes) if self.actuated is None else self.actuated

    def with_steady_input(self, values: Floats) -> Self:
        """Return the systems with other steady inputs, shape (lanes,), along the actuator."""
        force = self.force.copy()
        force[:, :, :1] += self._direction * (values - self.steady_input)[:, np.newaxis, np.newaxis]
        return self.replace(force=force, actuated=values)

    def input_strength(self, step: Floats) -> Floats:
        """Return the change of the coefficient that is the input, by an input of 1, (lanes,)."""
        return step**2

    def branch_jacobian(self, stiffnesses: Floats) -> Floats:
        """Return the Jacobian on a contact branch, shape (lanes, states, states)."""
        held = self.stiffness[:, :, 0] * stiffnesses
        idle = np.array(self.structure.damped_in_contact) & (stiffnesses == 0.0)
        damped = np.where(idle, 0.0, self.damping)
        count = self.gap.shape[2]
        result = np.zeros((self.lanes, 2 * count, 2 * count))
        result[:, ::2, 1::2] = np.eye(count)
        for first, free, strengths in ((0, self.position, held), (1, self.rate, damped)):
            pushes = self.reaction * strengths[:, np.newaxis]
            result[:, 1::2, first::2] = -free - pushes @ self.gap
        return result

    def known_gaps(self, states: Floats, steps_per_period: int) -> tuple[NDArray[Any], ...]:
        """Return values, rates and flanks of the gaps along a motion, from the matrices."""
        motion = moving(self, states, steps_per_period)
        value, rate = gaps_of(self, motion)
        return value, rate, flanks_of(self, value), self.half_clearance

    def known_motion(self, states: Floats, steps_per_period: int) -> tuple[NDArray[Any], ...]:
        """Return forces, contact, accelerations and gaps along a motion, from the matrices."""
        motion = moving(self, states, steps_per_period)
        value, rate = gaps_of(self, motion)
        forces = forces_of(self, motion, value, rate)
        return forces, flanks_of(self, value), accelerations_of(self, motion, forces), value

    def growth_rates(self) -> Floats:
        """Return a bound on the rate of tangent vectors: of the stiffest branch, and of damping."""
        springs = self._largest_row_sum(self.position, self._stiffest())
        return np.sqrt(springs) + self._largest_row_sum(self.rate, self.damping)

    def _largest_row_sum(self, free: Floats, strengths: Floats) -> Floats:
        """Return a bound on a matrix with any of the elements in contact; see `_fastest`.

        Magnitudes are taken of every element alone: together, elements could cancel.
        """
        pushes = np.abs(self.reaction) * strengths[:, np.newaxis]
        sums = np.abs(free).sum(axis=2) + (pushes @ np.abs(self.gap)).sum(axis=2)
        largest: Floats = sums.max(axis=1)
        return largest

    def fastest_rates(self) -> Floats:
        """Return the rate of the fastest motion: of its branches, and of the excitation.

        It is the largest natural frequency, plus the largest rate of damping, plus that of the
        highest harmonic. It is at least twice the latter, as harmonics of stiffness and of
        excitation multiply.
        """
        frequency = self._fastest(self.position, self._stiffest())
        decay = self._fastest(self.rate, self.damping)
        harmonic = self.harmonics() * self.frequency
        return np.maximum(np.sqrt(frequency) + decay, harmonic) + harmonic

    def _fastest(self, free: Floats, strengths: Floats) -> Floats:
        """Return a bound on the eigenvalues of a matrix with any of the elements in contact.

        ``free``: the matrix without elements, (lanes, n, n); ``strengths``: stiffnesses or
        dampings of the elements at most, (lanes, elements).
        """
        # More contact is stiffer: all elements, or none if springs to the ground are negative.
        pushes = self.reaction * strengths[:, np.newaxis]
        extreme = _largest_eigenvalues(free, free + pushes @ self.gap)
        # An element that pushes elsewhere than it is pressed may be faster without another one.
        sizes = np.linalg.norm(self.reaction, axis=1) * np.linalg.norm(self.gap, axis=2)
        bound = np.linalg.norm(free, axis=(1, 2)) + np.sum(strengths * sizes, axis=1)
        coupling = self.gap @ self.reaction
        aside = np.abs(coupling - coupling.swapaxes(1, 2)).max(axis=(1, 2), initial=0.0)
        alike = aside <= 1e-9 * np.abs(coupling).max(axis=(1, 2), initial=0.0)
        return np.where(alike, extreme, bound)

    def _stiffest(self) -> Floats:
        """Return an upper bound of the stiffness of each element, shape (lanes, elements)."""
        bound: Floats = np.abs(self.stiffness).sum(axis=2)
        return bound

    def branch_stiffnesses(self) -> Floats:
        """Return relative stiffnesses of the elements: both extremes in contact, and none."""
        mean = self.stiffness[:, :, 0]
        spread = np.abs(self.stiffness[:, :, 1:]).sum(axis=2) / np.where(mean, mean, 1.0)
        contact = [1.0 + spread, 1.0 - spread]
        return np.stack([*contact, np.zeros_like(spread)] if self.clearance else contact)

    def contact_state(self) -> Floats:
        """Return the state at rest under the mean forces with all elements in contact.

        Each is in contact on the flank to which the forces press it without clearance.
        """
        mean, moved = self.stiffness[:, :, 0], self.motion[:, :, 0]
        pull = self.reaction * mean[:, np.newaxis]
        matrices, forces = self.position + pull @ self.gap, self.force[:, :, 0]

        def at_rest(held: Floats) -> Floats:
            pushes = forces + np.einsum("lnm,lm->ln", pull, held + moved)
            return np.array(
                [np.linalg.lstsq(*one)[0] for one in zip(matrices, pushes, strict=True)]
            ).reshape(forces.shape)

        tight = at_rest(np.zeros_like(moved))
        gaps = np.einsum("lmn,ln->lm", self.gap, tight) - moved
        pressed_back = gaps < -1e-9 * np.abs(gaps).max(axis=1, initial=0.0)[:, np.newaxis]
        back = pressed_back & ~np.array(self.one_sided or [False] * gaps.shape[1])
        state = np.zeros((self.lanes, len(self.states)))
        state[:, ::2] = at_rest(np.where(back, -self.half_clearance, self.half_clearance))
        return state

    def tables(self, steps_per_period: int) -> Floats:
        """Return cosine and sine of every harmonic, shape (2 steps + 1, 2 harmonics)."""
        return waves_of(self.orders, half_step_angles(steps_per_period))

    def refuses_maps(self) -> str:
        """Return why flow maps cannot integrate the systems, or an empty text."""
        elements = self.gap.shape[1]
        if elements > MOST_MAPPED:
            return (
                f"flow maps take up to {MOST_MAPPED} clearance elements; this system has {elements}"
            )
        return ""

    def of(self, chosen: slice | NDArray[np.intp] | list[int]) -> Self:
        """Return the systems of some lanes, in the given order."""
        return self._alike(super().of(chosen))

    def controlled(self, control: "Control | None") -> Self:
        """Return the systems with controllers, whose input acts along the actuator."""
        return self._alike(super().controlled(control))

    def _alike(self, other: Self) -> Self:
        """Return systems with the structure of these, though some terms of theirs may be zero.

        Compiled code, and the order of coefficients, belong to a structure. The actuator belongs to
        it only with a controller.
        """
        structure = self.structure
        if (other.control is None) != (self.control is None):
            actuator = entries_of(other._matrix("actuator"))
            structure = structure_of(**structure.terms | {"actuator": actuator})
        vars(other)["structure"] = structure
        return other

    def of_unit_inputs(self) -> Self:
        """Return the systems without clearance, on which flow maps do not depend."""
        return self._alike(replace(self, half_clearance=np.zeros_like(self.half_clearance)))

    def map_parameters(self) -> Floats:
        """Return all numbers on which the flow maps of a lane depend, shape (lanes, numbers)."""
        without = {
            "half_clearance",
            "actuated",
            *(() if self.structure.actuator else ("actuator",)),
        }
        names = [name for name in self._parameters() if name not in without]
        numbers = [getattr(self, name) for name in names]
        # A size of -1 is unknown where there are no lanes.
        flat = [one.reshape(self.lanes, math.prod(one.shape[1:])) for one in numbers]
        return np.concatenate(flat, axis=1)

    def with_map_parameter(self, _number: int, _values: Floats) -> Self | None:
        """Return None: what the columns of `map_parameters` are depends on the matrices."""
        return None

    def map_constants(self) -> tuple[object, ...]:
        """Return what else the flow maps depend on, the same for all lanes."""
        return self.orders

    def wave_series(self, steps: int, terms: int) -> Floats:
        """Return Taylor coefficients of a stiffness variation, which is 0, and of the waves.

        With an actuator, a constant wave follows, which is that of the steady forces.
        """
        series = [np.zeros((terms, steps))]
        for order in self.orders:
            wave = harmonic_series(order, steps, terms)
            series += [wave.real, wave.imag]
        if self.structure.actuator:
            series.append(np.zeros((terms, steps)))
            series[-1][0] = 1.0
        return np.stack(series)

    def harmonics(self) -> int:
        """Return the highest order of a harmonic."""
        return max(self.orders, default=0)

    def wave_values(self, phase: Floats) -> Floats:
        """Return the waves at mesh phases in rad, shape (phases, waves)."""
        constant = np.ones((phase.size, 1 if self.structure.actuator else 0))
        return np.concatenate([waves_of(self.orders, phase), constant], axis=1)

    def _parameters(self) -> list[str]:
        """Return the names of the fields that are arrays over the lanes."""
        return [one.name for one in fields(self) if isinstance(getattr(self, one.name), np.ndarray)]


def _largest_eigenvalues(*alternatives: Floats) -> Floats:
    """Return the largest size of an eigenvalue of alternative matrices, (lanes,).

    Each is of shape (lanes, n, n). NaN where they are not finite.
    """
    matrices = np.stack(alternatives, axis=1)
    found = np.full(len(matrices), np.nan)
    finite = np.isfinite(matrices).all(axis=(1, 2, 3))
    # Many lanes have the same matrices; a dictionary finds them sooner than a sort of rows.
    places: dict[bytes, int] = {}
    group = [places.setdefault(one.tobytes(), len(places)) for one in matrices[finite]]
    _, first = np.unique(group, return_index=True)
    different = matrices[finite][first]
    found[finite] = np.abs(np.linalg.eigvals(different)).max(axis=(1, 2), initial=0.0)[group]
    return found
