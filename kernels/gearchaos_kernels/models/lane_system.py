"""What the engine needs of the lanes of a model: their parameters, and what follows from them."""

from abc import ABC, abstractmethod
from dataclasses import fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import provider_of

_Chosen = slice | NDArray[np.intp] | list[int]


class LaneSystem(ABC):
    """The equations of motion of a batch of lanes.

    A model derives a frozen dataclass from it. Fields that are arrays of shape (lanes, ...) hold
    the parameters of the lanes; a model with other fields overrides `of`. Methods that flow maps
    alone need are those from `of_unit_inputs` on.

    """

    @property
    @abstractmethod
    def states(self) -> tuple[str, ...]:
        """Names of the states, each coordinate followed by its rate."""

    @property
    @abstractmethod
    def mesh_period(self) -> Floats:
        """Duration of a mesh period in units of tau, shape (lanes,)."""

    @abstractmethod
    def flags(self) -> Any:
        """Return what the compiled loop has of the model, a frozen dataclass of flags."""

    @abstractmethod
    def coefficients(self, step: Floats) -> Floats:
        """Return the coefficients of every lane for steps of these lengths, (lanes, fields)."""

    @abstractmethod
    def tables(self, steps_per_period: int) -> Any:
        """Return what acts on all lanes over a mesh period, on a grid of half steps."""

    @abstractmethod
    def growth_rates(self) -> Floats:
        """Return a bound on how fast a tangent vector grows or decays, per unit of tau."""

    def scales(self, step: Floats) -> Floats:
        """Return the factors from scaled states to those of the equations, (lanes, states).

        By default displacements are not scaled, and rates are per step.
        """
        scales = np.ones((step.size, len(self.states)))
        scales[:, 1::2] /= step[:, np.newaxis]
        return scales

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return int(self.mesh_period.size)

    @property
    def elements(self) -> int:
        """Number of clearance elements."""
        flags = self.flags()
        return int(provider_of(flags).elements(flags))

    @property
    def clearance(self) -> bool:
        """Whether the elements have clearance."""
        return True

    @property
    def repeats_after(self) -> int:
        """Mesh periods after which the excitation repeats."""
        return 1

    @property
    def excitation_period(self) -> Floats:
        """Duration of `repeats_after` mesh periods in units of tau, shape (lanes,)."""
        return self.repeats_after * self.mesh_period

    @property
    def independent_states(self) -> tuple[str, ...]:
        """States that act on no other state."""
        flags = self.flags()
        maps = provider_of(flags).maps
        numbers = maps.apart(flags)[0] if maps else frozenset()
        return tuple(name for number, name in enumerate(self.states) if number in numbers)

    def linearised(self) -> Self:
        """Return it without what is no part of its linearisation: excitation and clearance."""
        return self

    def measurable(self) -> Self:
        """Return it with parameters cut short of overflow; by default none is."""
        return self

    def branch_stiffnesses(self) -> Floats:
        """Return stiffnesses of the elements on the branches, relative to their mean.

        Shape (branches, lanes, elements): all in contact, at the extremes of the stiffness, and all
        apart.
        """
        contact = np.ones((self.lanes, self.elements))
        return np.stack([contact, 0.0 * contact] if self.clearance else [contact])

    def contact_state(self) -> Floats:
        """Return a state near rest on the flank that the load presses on, shape (lanes, states)."""
        return np.zeros((self.lanes, len(self.states)))

    def static_force(self) -> Floats:
        """Return the force of the first element under the load at rest, shape (lanes,).

        It is relative to the mean stiffness, so that it is the static deflection as well.
        """
        return np.full(self.lanes, np.nan)

    def of(self, lanes: _Chosen) -> Self:
        """Return the system of some lanes, in the order given."""
        chosen = {field.name: getattr(self, field.name)[lanes] for field in fields(self)}  # type: ignore[arg-type]
        return self.replace(**chosen)

    def replace(self, **changes: Any) -> Self:
        """Return it with other values of some fields."""
        return replace(self, **changes)  # type: ignore[type-var]

    def repeated(self, times: int) -> Self:
        """Return the system with every lane n times in a row."""
        return self.of(np.repeat(np.arange(self.lanes), times))

    def of_unit_inputs(self) -> Self:
        """Return it forced by inputs of one, from which flow maps are made."""
        raise NotImplementedError

    def owned(self) -> Floats:
        """Return all numbers on which the flow maps of a lane depend, shape (lanes, numbers)."""
        raise NotImplementedError

    def wave_series(self, steps: int, terms: int) -> Floats:
        """Return Taylor coefficients about the middle of every step, (1 + waves, terms, steps).

        Of the stiffness variation relative to the mean, and of the waves that excite the model.
        """
        raise NotImplementedError

    def wave_values(self, phase: Floats) -> Floats:
        """Return the waves at mesh phases in rad, shape (phases, waves)."""
        raise NotImplementedError

    def shared(self) -> tuple[object, ...]:
        """Return all else on which flow maps depend, the same for all lanes."""
        return ()

    def harmonics(self) -> int:
        """Return the highest harmonic of the mesh frequency in the coefficients."""
        return 0

    def refuses_maps(self) -> str:
        """Return why flow maps cannot integrate it, or an empty text."""
        flags = self.flags()
        return "" if provider_of(flags).maps else "the model has no formulas for flow maps"
