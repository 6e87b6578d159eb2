"""Models that consist of equations alone; everything else follows from their lanes.

A `LaneSystem` names its parameters, coordinates and signals. That is enough for a configuration
with one key for each parameter, for the outputs, and for sweeps, labels, orbits and files.
"""

from collections.abc import Collection, Mapping
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np
from gearchaos_kernels import LaneSystem
from gearchaos_kernels.scene import provider_of
from pydantic import create_model

from gearchaos.arrays import Floats
from gearchaos.configuration import Configuration
from gearchaos.configuration.keys import Table
from gearchaos.configuration.ranges import Range
from gearchaos.configuration.tables import Parameter
from gearchaos.models.protocol import Model
from gearchaos.models.registry import MODELS
from gearchaos.outputs import catalogue
from gearchaos.outputs.entries import Kind, Subject, motion_subjects
from gearchaos.outputs.listing import Catalogue


class DeclaredConfiguration(Configuration):
    """A configuration whose only table of its own holds the parameters of the lanes.

    Attributes
    ----------
    named_states : tuple of str
        Names of the states of the scene.
    """

    named_states: ClassVar[tuple[str, ...]] = ()

    @property
    def states(self) -> tuple[str, ...]:
        """States of the scene, each coordinate followed by its rate."""
        return self.named_states


class DeclaredModel(Model):
    """A model with named elements, made of lanes.

    Parameters
    ----------
    lanes : type
        The class of its lanes.
    elements : tuple of str
        Names of its clearance elements.
    """

    def __init__(self, lanes: type[LaneSystem], elements: tuple[str, ...]) -> None:
        example = _example_of(lanes)
        motion = [motion_subjects(name, name, f"{{}} of {name}") for name in example.states[::2]]
        subjects = {
            Kind.STATE: tuple(one for state in motion for one in state[:2]),
            Kind.ACCELERATION: tuple(state[2] for state in motion),
            Kind.ELEMENT: tuple(Subject(name, name, f"$F_{{{name}}}$") for name in elements),
        }
        self.catalogue = Catalogue(parts=catalogue.PARTS, subjects=subjects)
        self.signals = provider_of(example.flags()).observed
        self._lanes, self._elements = lanes, elements

    def system(
        self, config: Any, values: Mapping[str, Floats], _effects: Collection[str]
    ) -> LaneSystem:
        """Return the lanes of a configuration: its parameters, where they are not swept."""
        given = {**getattr(config, config.kind).tables(), **values}
        columns = np.broadcast_arrays(*(given[name] for name in parameters_of(self._lanes)))
        return self._lanes(*(np.array(one, dtype=np.float64) for one in columns))

    def elements(self, _effects: Collection[str]) -> tuple[str, ...]:
        """Return the names of the elements."""
        return self._elements


def parameters_of(lanes: type[LaneSystem]) -> tuple[str, ...]:
    """Return the names of the parameters of lanes, in their order."""
    shared = {field.name for field in fields(LaneSystem)}
    return tuple(field.name for field in fields(lanes) if field.name not in shared)


def _example_of(lanes: type[LaneSystem]) -> LaneSystem:
    """Return one lane all of whose parameters are 1."""
    return lanes(*np.ones((len(parameters_of(lanes)), 1)))


def declare_model(
    kind: str, lanes: type[LaneSystem], elements: tuple[str, ...], **defaults: float
) -> type[DeclaredConfiguration]:
    """Make compiled lanes a model that can be configured, swept, plotted and kept in files.

    Parameters
    ----------
    kind : str
        Value of ``model.kind``, and name of the table with the parameters.
    lanes : type
        The class of the lanes: a frozen dataclass derived from `gearchaos_kernels.LaneSystem` whose
        fields are the parameters, each an array of shape (lanes,).
    elements : tuple of str
        Names of the clearance elements, in the order of the compiled formulas.
    **defaults : float
        Values of the parameters where a configuration gives none. A parameter without one is 0.

    Returns
    -------
    type
        The class of the configurations of this kind. `gearchaos.run` and all commands that run in
        this process know the kind from now on.

    Raises
    ------
    ValueError
        If a default belongs to no parameter, or the number of elements is not that of the lanes.

    Examples
    --------
    ::

        Config = declare_model("oscillator", Oscillators, ("stop",), frequency=0.7, damping=0.05)
        sweep = {"parameter": "frequency", "from": 0.4, "to": 1.9, "count": 100}
        result = gearchaos.run(Config.from_tables({"sweep": sweep}))
    """
    names = parameters_of(lanes)
    if unknown := defaults.keys() - set(names):
        raise ValueError(f"{kind}: {sorted(unknown)} are no parameters; there are {names}")
    if len(elements) != _example_of(lanes).elements:
        raise ValueError(f"{kind}: the lanes have another number of elements than {elements}")
    values: dict[str, Any] = {name: (float, defaults.get(name, 0.0)) for name in names}
    table = create_model(kind, __base__=Table, **values)
    facts = {
        "kind": kind,
        "__module__": __name__,
        "__doc__": f"A configuration of the model {kind}.",
        "parameters": {name: Parameter(name, f"{kind}.{name}", Range()) for name in names},
        "named_states": _example_of(lanes).states,
        "__annotations__": {kind: table},
        kind: table(),
    }
    configuration = type(f"{kind.title()}Configuration", (DeclaredConfiguration,), facts)
    model = DeclaredModel(lanes, elements)
    MODELS[kind] = lambda _config: model
    return configuration
