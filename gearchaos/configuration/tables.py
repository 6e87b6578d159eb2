"""The tables of every configuration, for any model, and the swept values."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np

from gearchaos.arrays import Floats, Integers
from gearchaos.configuration.keys import AS_LIST, Key, Table, key, keys_of
from gearchaos.configuration.messages import Fault, suggestion
from gearchaos.configuration.ranges import Range
from gearchaos.configuration.run_tables import (
    Control,
    Integration,
    Outputs,
    Scene,
    Start,
    Sweep,
)


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model that a sweep can vary.

    Attributes
    ----------
    name : str
        Value of ``sweep.parameter``.
    path : str
        Dotted path of the key with its value.
    valid : Range
        Valid values.
    units, long_name, symbol : str
        Unit, ``"1"`` if dimensionless; description; mathtext symbol if it has one.
    """

    name: str
    path: str
    valid: Range
    units: str = "1"
    long_name: str = ""
    symbol: str = ""


class Titled(Table):
    """The keys at the top of every file."""

    title: str = key("title of the sweep, for figures and files", default="")
    unusual: Annotated[tuple[str, ...], AS_LIST] = key(default=())
    """paths of keys whose values are meant although they are unusual: no warning is printed"""


class Tables(Titled):
    """The tables that every configuration has; a model adds those of its parameters.

    Attributes
    ----------
    parameters : mapping of str to Parameter
        The parameters of the model that a sweep can vary, by name.
    realisation_words : str
        What realisations are, in the plural.
    discrete_parameters : frozenset of str
        Parameters without values between two of their values.
    tables_of_lanes : frozenset of str
        Tables that must be free of faults before `lane_faults` is called.
    actuators : tuple of str
        Inputs that a controller can change.
    absolute_limit : str
        Key of [control] for the largest change of an input in its own unit.
    """

    parameters: ClassVar[Mapping[str, Parameter]] = MappingProxyType({})
    realisation_words: ClassVar[str] = "realisations"
    discrete_parameters: ClassVar[frozenset[str]] = frozenset()
    tables_of_lanes: ClassVar[frozenset[str]] = frozenset({"sweep", "second_sweep", "scene"})
    actuators: ClassVar[tuple[str, ...]] = ()
    absolute_limit: ClassVar[str] = "limit_Nm"

    scene: Scene = key("which effects exist", default=Scene())
    start: Start[str] = key("the state in which the lanes start", default=Start())
    sweep: Sweep = key("the swept parameter and its values")
    second_sweep: Sweep | None = key(default=None)
    """a second swept parameter: every value of it with every one of [sweep]"""
    integration: Integration = key("the fixed grid of the integration", default=Integration())
    outputs: Outputs[str] = key("the kept outputs of every lane", default=Outputs())
    control: Control[str] | None = key("a controller of every lane", default=None)
    files: dict[str, str] | None = key(default=None)
    """files that are named above, word for word, as a result keeps them"""

    @property
    def sweeps(self) -> dict[str, Sweep]:
        """The sweeps that exist, by the name of their table."""
        tables = {name: self.__dict__.get(name) for name in ("sweep", "second_sweep")}
        return {name: sweep for name, sweep in tables.items() if sweep is not None}

    @property
    def swept(self) -> dict[str, str]:
        """The key that names each swept parameter, such as ``sweep.parameter``."""
        return {sweep.parameter: f"{table}.parameter" for table, sweep in self.sweeps.items()}

    @property
    def unit_of_inputs(self) -> str:
        """Unit of the inputs, as names of efforts and of `absolute_limit` end."""
        return self.absolute_limit.removeprefix("limit_")

    def is_idle(self, actuator: str) -> bool:
        """Whether the steady value of an input is 0, so that nothing is a share of it."""
        del actuator
        return False

    def input_fault(self, given: str | None) -> tuple[str, str] | None:
        """Return the rule that an input breaks and the remedy, None if a controller can change it.

        ``given``: its name, None for the only one.
        """
        known, actuator = (
            " or ".join(f'"{name}"' for name in self.actuators),
            self.actuator_of(given),
        )
        if not self.actuators:
            rule = "the machine has no input that a controller could change"
            return rule, "give it a force or a torque"
        if actuator in self.actuators:
            return None
        rule = f"a controller can change {known} only"
        if not actuator:
            rule = "is missing: the machine has several inputs"
        elif actuator == "speed":
            rule += "; another speed would change the length of the mesh period itself"
        return rule, f"set actuator = {known}"

    def actuator_of(self, given: str | None) -> str:
        """Return the input that a controller changes, by default the only one; "" if none is."""
        alone = self.actuators[0] if len(self.actuators) == 1 else ""
        return alone if given is None else given

    @property
    def states(self) -> tuple[str, ...]:
        """States of the scene, each coordinate followed by its rate."""
        raise NotImplementedError

    def states_of(self, effects: Collection[str]) -> tuple[str, ...]:
        """Return the states of the scene with some of its effects; by default all states."""
        del effects
        return self.states

    @property
    def needed_effects(self) -> tuple[str, ...]:
        """Effects of the scene that act on the outputs; by default all."""
        return self.scene.effects

    @property
    def realisations(self) -> Integers:
        """Numbers of the drawn realisations of each value, (realisations,)."""
        return np.zeros(1, dtype=np.intp)

    def keys_of_realisation(self, number: float) -> dict[str, float]:
        """Return keys by path, and values, with which this realisation is the only one.

        Empty if none is drawn.
        """
        del number
        return {}

    @classmethod
    def default_of(cls, key: Key) -> Any:
        """Return the default of a key, None where it has none."""
        return None if key.field.is_required() else key.field.default

    def parameter_remedy(self, unknown: str) -> str:
        """Return which parameter to sweep instead of an unknown one."""
        return suggestion(unknown, self.parameters) or f"parameters: {', '.join(self.parameters)}"

    def lane_faults(self) -> Iterator[Fault]:
        """Yield the faults of parameters of the lanes, once each table is free of faults."""
        yield from ()


def swept_values(sweep: Sweep) -> Floats:
    """Return the values of a sweep, shape (values,), in the unit of its parameter, ascending."""
    if sweep.values is not None:
        return np.sort(np.asarray(sweep.values, dtype=np.float64))
    first, count = sweep.from_, sweep.count
    assert first is not None and count is not None
    last = first if sweep.to is None or count == 1 else sweep.to
    # One rounding per value: 586 * 15 / 1500 is 5.86, 586 * 0.01 is not always.
    steps = np.arange(count, dtype=np.float64)
    values = first + steps * (last - first) / max(count - 1, 1)
    values[-1] = last
    return values


def axis_values(config: Tables) -> dict[str, Floats]:
    """Return the swept values by parameter, in the order of the axes: [second_sweep] first.

    Each array has the shape (values,) and the unit of its parameter.
    """
    return {one.parameter: swept_values(one) for one in reversed(config.sweeps.values())}


OF_CONTROLLERS = MappingProxyType(
    {
        path: Parameter(path, path, one.valid, one.units or "1", one.wording)
        for one in keys_of(Control)
        for path in [f"control.{one.path}"]
        if one.is_number and one.path != "found_at"
    }
)
"""Keys of [control] that a sweep may vary, by path; the machine does not depend on them."""


def of_the_machine(config: Tables) -> dict[str, Sweep]:
    """Return the sweeps of parameters of the machine, not of a controller, by their table."""
    return {
        table: sweep
        for table, sweep in config.sweeps.items()
        if sweep.parameter not in OF_CONTROLLERS
    }
