"""The interface of a model for the engine, beside its configuration and compiled formulas."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, evaluate

from gearchaos.arrays import Array, Floats
from gearchaos.outputs.entries import Part
from gearchaos.outputs.listing import Catalogue
from gearchaos.outputs.names import acceleration_of


class ParameterValue(NamedTuple):
    """A parameter of the model as a result keeps it.

    Attributes
    ----------
    name, units, long_name, symbol : str
        Name in the file, unit, wording, and mathtext symbol.
    value : float or array
        Its value; an array over the swept parameters, or over harmonics.
    origin : str
        ``"given"``, ``"derived"`` or ``"default"``.
    is_list : bool
        Whether it has one entry per harmonic.
    """

    name: str
    units: str
    long_name: str
    symbol: str
    value: Any
    origin: str
    is_list: bool = False


class Scales(NamedTuple):
    """Units of what is dimensionless, each of shape (lanes,), or None where they are not known.

    Attributes
    ----------
    frequency : array or None
        Units of tau per second.
    speed : float or None
        Speed in rpm at which the mesh frequency is 1 Hz.
    length : array or None
        Micrometres per unit of length.
    """

    frequency: Floats | None = None
    speed: float | None = None
    length: Floats | None = None


class Model(ABC):
    """One kind of machine.

    The functions take a configuration of this kind. ``values`` map each swept parameter to its
    value in every lane, (lanes,), or to arrays that broadcast against each other.

    Attributes
    ----------
    catalogue : Catalogue
        All outputs that a result may have; every model has its own.
    load_parts : tuple of Part
        Parts of the catalogue that `loads` computes.
    signals : tuple of str
        Names of the signals that the compiled formulas observe.
    rate_words : str
        Unit of angular frequencies where no physical one is known.
    free_words : str
        When no element is in contact, for the eigenfrequencies then; empty to leave them out.
    contact_words, deflection_words : str
        What the eigenfrequencies and the static deflection are those of, in a sentence.
    exciter : str
        What excites once a period, such as the mesh.
    excitation_words, shorter_excitation : str
        What repeats after several mesh periods, with its verb, and how it repeats earlier.
    shared_inputs : str
        The parameters in which lanes may differ that share maps, in words.
    """

    catalogue: Catalogue
    load_parts: tuple[Part, ...] = ()
    signals: tuple[str, ...] = ()
    rate_words: str = "per unit of tau"
    free_words: str = ""
    contact_words: str = "mean stiffness, all elements in contact"
    deflection_words: str = "under the static load"
    exciter: str = "excitation"
    excitation_words: str = "excitation repeats"
    shorter_excitation: str = "choose an excitation that repeats earlier"
    shared_inputs: str = "excitation and clearance"

    @abstractmethod
    def system(
        self, config: Any, values: Mapping[str, Floats], effects: Collection[str]
    ) -> LaneSystem:
        """Return the equations of motion of some lanes with these effects."""

    @abstractmethod
    def elements(self, effects: Collection[str]) -> tuple[str, ...]:
        """Return the names of the clearance elements, in the order of the compiled formulas."""

    def parameters(
        self, config: Any, values: Mapping[str, Floats], effects: Collection[str]
    ) -> Iterator[ParameterValue]:
        """Yield the parameters that a result keeps; by default those that are swept alone."""
        del effects
        for name in values:
            one = config.parameters[name]
            yield ParameterValue(
                one.name, one.units, one.long_name, one.symbol, values[name], "given"
            )

    def scales(self, config: Any, values: Mapping[str, Floats]) -> Scales:
        """Return the physical scales of some lanes, as far as they are known."""
        del config, values
        return Scales()

    def actuated(
        self, config: Any, values: Mapping[str, Floats], system: LaneSystem, actuator: str
    ) -> LaneSystem:
        """Return the system of some lanes such that its steady input is an actuator.

        By default a model has one steady input.
        """
        del config, values, actuator
        return system

    def input_unit(self, config: Any, values: Mapping[str, Floats]) -> Floats | None:
        """Return the size of an input of 1 in its own unit, N m or force, None if not known.

        An array that broadcasts to (lanes,).
        """
        del config, values
        return None

    def remarks(
        self, config: Any, system: LaneSystem, parameters: Mapping[str, Floats]
    ) -> Iterator[str]:
        """Yield remarks for the user before the sweep runs, about some of its lanes."""
        del config, system, parameters
        yield from ()

    def facts(self, config: Any, repeats_after: int) -> dict[str, Any]:
        """Return attributes that a result has beside those of every model."""
        del config, repeats_after
        return {}

    def loads(self, loads: Floats, system: LaneSystem) -> dict[str, Floats]:
        """Return the loads of lanes by the name of the output, each of shape (lanes,).

        ``loads`` (lanes, elements + signals, 4): as an `Outcome` has them.
        """
        del loads, system
        return {}

    def motion(
        self, system: LaneSystem, states: Floats, steps_per_period: int, first_period: int
    ) -> dict[str, Array]:
        """Return what a response holds beside the states, each (lanes, samples), by name.

        By default the accelerations. ``states`` (lanes, samples, states): one step apart, after
        ``first_period`` mesh periods.
        """
        found = evaluate(system, states, steps_per_period, first_period)
        return accelerations(system, found.accelerations)


def accelerations(system: LaneSystem, values: Floats) -> dict[str, Array]:
    """Return accelerations, (lanes, samples, coordinates), by the names that files have."""
    names = (acceleration_of(name) for name in system.states[::2])
    columns = np.moveaxis(values, 2, 0)
    return {name: column.copy() for name, column in zip(names, columns, strict=True)}
