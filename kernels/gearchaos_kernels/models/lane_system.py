"""A batch of lanes of one model: their parameters, and what the engine derives from them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.models.mesh_phase import (
    half_step_angles,
    harmonic_series,
    sine_and_cosine,
)
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import provider_of

if TYPE_CHECKING:
    from gearchaos_kernels.control import Control

_Chosen = slice | NDArray[np.intp] | list[int]


@dataclass(frozen=True, eq=False)
class LaneSystem(ABC):
    """The equations of motion of a batch of lanes.

    A model derives a frozen dataclass from it, which has to define `mesh_period`, `flags`,
    `coefficients` and `growth_rates`. The other methods have defaults. They serve models whose
    fields are arrays of shape (lanes, ...), one parameter each, and whose excitation consists of
    sine and cosine of the mesh phase.

    Attributes
    ----------
    control : Control or None
        The controllers of the lanes, see `controlled`; None by default.
    unit_inputs : mapping of str to float
        Fields on which flow maps do not depend, such as loads and clearances, with their values in
        a system of unit inputs. Only `of_unit_inputs` and `map_parameters` read it.

    Examples
    --------
    A linear oscillator with a clearance and a load, whose model is registered for ``Flags``::

        @dataclass(frozen=True)
        class Oscillators(LaneSystem):
            frequency: np.ndarray
            half_clearance: np.ndarray
            load: np.ndarray
            flags: ClassVar = Flags

            @property
            def mesh_period(self):
                return 2.0 * np.pi / self.frequency

            def coefficients(self, step):
                return np.stack([step**2, self.half_clearance, self.load * step**2], axis=1)

            def growth_rates(self):
                return np.ones(self.lanes)
    """

    control: "Control | None" = field(default=None, kw_only=True)
    unit_inputs: ClassVar[Mapping[str, float]] = {}

    @property
    @abstractmethod
    def mesh_period(self) -> Floats:
        """Duration of a mesh period in units of tau, shape (lanes,)."""

    @abstractmethod
    def flags(self) -> Any:
        """Return which parts of the model the compiled loop contains; see `scene.implement`."""

    @abstractmethod
    def coefficients(self, step: Floats) -> Floats:
        """Return the coefficients of every lane, shape (lanes, fields of `Model.lane`).

        ``step``: length of a step in units of tau, shape (lanes,).
        """

    @abstractmethod
    def growth_rates(self) -> Floats:
        """Return a bound on the rate at which tangent vectors grow or decay, shape (lanes,).

        It is per unit of tau. Tangent vectors are scaled often enough for it.
        """

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: each coordinate, followed by its rate."""
        flags = self.flags()
        model = provider_of(flags)
        named = zip(model.coordinates._fields, model.present(flags), strict=True)
        return tuple(name + kind for name, there in named if there for kind in ("", "_rate"))

    def tables(self, steps_per_period: int) -> Any:
        """Return what acts on all lanes over a mesh period, on a grid of half steps.

        By default sine and cosine of the mesh phase, shape (2 steps + 1, 2).
        """
        return sine_and_cosine(half_step_angles(steps_per_period))

    def scales(self, step: Floats) -> Floats:
        """Return the factors from scaled states to those of the equations, shape (lanes, states).

        ``step``: length of a step in units of tau, shape (lanes,). By default displacements are not
        scaled, and rates are per step.
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
        """Whether the elements have clearance, by default True."""
        return True

    @property
    def damped_in_contact(self) -> tuple[bool, ...]:
        """Whether the damper of each element acts only while the element is in contact."""
        flags = self.flags()
        kinds = provider_of(flags).kinds_of(flags)
        return tuple(kind.damped_in_contact and self.clearance for kind in kinds)

    @property
    def damping_changes(self) -> bool:
        """Whether the effect of dampers changes with the mesh phase, by default False."""
        return False

    @property
    def repeats_after(self) -> int:
        """Number of mesh periods after which the excitation repeats, by default 1."""
        return 1

    @property
    def excitation_period(self) -> Floats:
        """Duration of `repeats_after` mesh periods in units of tau, shape (lanes,)."""
        return self.repeats_after * self.mesh_period

    @property
    def independent_states(self) -> tuple[str, ...]:
        """Names of the states that act on no other state."""
        flags = self.flags()
        maps = provider_of(flags).maps
        numbers = maps.apart(flags)[0] if maps else frozenset()
        return tuple(name for number, name in enumerate(self.states) if number in numbers)

    def linearised(self) -> Self:
        """Return the system without what a linearisation leaves out: excitation and clearance."""
        return self

    def measurable(self) -> Self:
        """Return the system with parameters clipped, so that products of them do not overflow."""
        return self

    def branch_stiffnesses(self) -> Floats:
        """Return stiffnesses of the elements on contact branches, relative to their mean.

        Shape (branches, lanes, elements). The branches are: all elements in contact, once for each
        extreme of the stiffness, and none in contact.
        """
        contact = np.ones((self.lanes, self.elements))
        return np.stack([contact, 0.0 * contact] if self.clearance else [contact])

    def contact_state(self) -> Floats:
        """Return a state near rest in contact under the load, shape (lanes, states)."""
        return np.zeros((self.lanes, len(self.states)))

    def static_force(self) -> Floats:
        """Return the force of the first element at rest under the load, shape (lanes,).

        It is relative to the mean stiffness, so it equals the static deflection. By default it is
        unknown (NaN).
        """
        return np.full(self.lanes, np.nan)

    def of(self, chosen: _Chosen) -> Self:
        """Return the system of some lanes.

        Parameters
        ----------
        chosen : array of int or slice
            Numbers of the lanes, in the order of the new system.

        Returns
        -------
        LaneSystem
            A system of the same kind.

        Examples
        --------
        ::

            first = pairs.of(slice(0, 1))
        """
        some = {name: getattr(self, name)[chosen] for name in self._parameters()}
        return self.replace(**some, control=self.control and self.control.of(chosen))

    def controlled(self, control: "Control | None") -> Self:
        """Return the system with controllers, which act whenever it is integrated.

        Parameters
        ----------
        control : Control or None
            The controller of every lane, or None for a system without control.

        Returns
        -------
        LaneSystem
            A system of the same kind.

        Examples
        --------
        ::

            outcome = integrate(pairs.controlled(control), start, plan)
        """
        return self.replace(control=control)

    def replace(self, **changes: Any) -> Self:
        """Return the system with other values of some fields.

        Parameters
        ----------
        **changes
            Values by the name of the field.

        Returns
        -------
        LaneSystem
            A system of the same kind.

        Examples
        --------
        ::

            wider = oscillators.replace(half_clearance=2.0 * oscillators.half_clearance)
        """
        return replace(self, **changes)

    def repeated(self, times: int) -> Self:
        """Return the system with every lane n times in a row.

        Parameters
        ----------
        times : int
            How often each lane is repeated.

        Returns
        -------
        LaneSystem
            A system of the same kind, with ``times`` as many lanes.

        Examples
        --------
        ::

            pairs.repeated(2).lanes == 2 * pairs.lanes
        """
        return self.of(np.repeat(np.arange(self.lanes), times))

    def _parameters(self) -> list[str]:
        """Return the names of the parameters of the lanes."""
        return [one.name for one in fields(self) if one.name != "control"]

    def with_steady_input(self, values: Floats) -> Self:
        """Return the system with other steady inputs, shape (lanes,), in place of its own.

        The steady input of a model is the parameter behind `Model.actuated`, which has its name by
        default. A controller adds its own input to it.
        """
        return self.replace(**{provider_of(self.flags()).actuated: values})

    @property
    def steady_input(self) -> Floats:
        """The steady input of every lane, shape (lanes,); see `with_steady_input`."""
        value: Floats = getattr(self, provider_of(self.flags()).actuated)
        return value

    def input_strength(self, step: Floats) -> Floats:
        """Return the change of the coefficient `Model.actuated` by an input of 1, shape (lanes,).

        ``step``: length of a step in units of tau, shape (lanes,).
        """
        model = provider_of(self.flags())
        column = model.lane._fields.index(model.actuated)
        one, none = (
            self.with_steady_input(np.full(self.lanes, value)).coefficients(step)[:, column]
            for value in (1.0, 0.0)
        )
        strength: Floats = one - none
        return strength

    def branch_jacobian(self, stiffnesses: Floats) -> Floats | None:
        """Return what `evaluation.jacobian` returns, from matrices that are known.

        None, the default: the compiled formulas of the model are evaluated. ``stiffnesses``, shape
        (lanes, elements), are relative to the mean.
        """
        del stiffnesses
        return None

    def known_gaps(self, states: Floats, steps_per_period: int) -> tuple[NDArray[Any], ...] | None:
        """Return the fields of `gaps.Gaps`, rates per unit of tau, from matrices that are known.

        None, the default: the compiled formulas of the model are evaluated. ``states``, shape
        (lanes, samples, states): one step apart, from mesh phase 0.
        """
        del states, steps_per_period
        return None

    def known_motion(
        self, states: Floats, steps_per_period: int
    ) -> tuple[NDArray[Any], ...] | None:
        """Return the fields of `evaluation.Motion`, as `known_gaps` does."""
        del states, steps_per_period
        return None

    def refuses_series(self) -> str:
        """Return why Taylor series cannot integrate the system, or an empty text."""
        flags = self.flags()
        return "" if provider_of(flags).series else "the model has no formulas for Taylor series"

    def fastest_rates(self) -> Floats:
        """Return the rate of the fastest motion on any contact branch, shape (lanes,).

        It is per unit of tau, and Taylor series converge in a time of this rate. By default it is
        the bound `growth_rates`.
        """
        return self.growth_rates()

    # Flow maps use all of the following.

    def refuses_maps(self) -> str:
        """Return why flow maps cannot integrate the system, or an empty text."""
        flags = self.flags()
        return "" if provider_of(flags).maps else "the model has no formulas for flow maps"

    def of_unit_inputs(self) -> Self:
        """Return the system with unit inputs, from which flow maps are computed."""
        return self.replace(
            **{name: np.full(self.lanes, value) for name, value in self.unit_inputs.items()}
        )

    def map_parameters(self) -> Floats:
        """Return all numbers on which the flow maps of a lane depend, shape (lanes, numbers)."""
        names = [name for name in self._parameters() if name not in self.unit_inputs]
        return np.stack([getattr(self, name) for name in names], axis=1)

    def with_map_parameter(self, number: int, values: Floats) -> Self | None:
        """Return the system with other values (lanes,) of a column of `map_parameters`.

        None if the column is no parameter of its own.
        """
        names = [name for name in self._parameters() if name not in self.unit_inputs]
        return self.replace(**{names[number]: values})

    def map_constants(self) -> tuple[object, ...]:
        """Return what else the flow maps depend on, the same for all lanes."""
        return ()

    def wave_series(self, steps: int, terms: int) -> Floats:
        """Return Taylor coefficients about the middle of every step, (1 + waves, terms, steps).

        They are those of the stiffness variation relative to the mean and of the waves that excite
        the model, in a variable that is -1 and 1 at the ends of a step. By default the stiffness is
        constant, and the waves are sine and cosine of the mesh phase.
        """
        wave = harmonic_series(1, steps, terms)
        return np.stack([np.zeros((terms, steps)), wave.imag, wave.real])

    def wave_values(self, phase: Floats) -> Floats:
        """Return the waves at mesh phases in rad, shape (phases, waves)."""
        return sine_and_cosine(phase)

    def harmonics(self) -> int:
        """Return the highest harmonic of the mesh frequency in the coefficients, by default 0."""
        return 0
