"""The lanes of a configured sweep: their axes, and the system and the start of any of them."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from gearchaos_kernels import LaneSystem

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.configuration.tables import Parameter
from gearchaos.models import Configuration, axis_values, swept_values
from gearchaos.models.protocol import Model, ParameterValue
from gearchaos.models.registry import model_of, system_of
from gearchaos.outputs.names import DIRECTION, HARMONIC, REALISATION, START, axis_name
from gearchaos.outputs.variable import Variable, coordinate

_DRAWS_PER_LANE = 12
"""Random numbers set aside per lane: a multiple of the four that one Philox counter yields."""

_PHILOX_WIDTH = 4


class Lanes:
    """The product of all axes as a flat list, the last axis running fastest.

    A lane's result depends on its number in this list and nothing else. ``axes``: a coordinate for
    each dimension, the second swept parameter, the first one, the drawn gear pair, the start, the
    direction, those that there are; ``effects``: those that act on what is kept, and ``states``:
    those that they leave; ``starts``: of one value, or pair of values, with one gear pair;
    ``directions``, in which states are carried; ``repeats``: lanes of one value, or pair of values,
    with all its gear pairs, starts and directions.
    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self.model = model_of(config)
        self._values = axis_values(config)
        self.axes = [
            axis_of(config.parameters[name], one, self.model) for name, one in self._values.items()
        ]
        # What the system of a lane depends on, in the order of the axes.
        self._of_systems: dict[str, Array] = dict(self._values)
        numbers = config.realisations
        if numbers.size > 1:
            self.axes.append(self.model.catalogue.axis(REALISATION, numbers))
            self._of_systems[REALISATION] = numbers
        self.starts = config.start.size
        if self.starts > 1:
            self.axes.append(self.model.catalogue.axis(START, np.arange(self.starts)))
        self.directions = 2 if config.start.carry == "both" else 1
        if self.directions > 1:
            self.axes.append(self.model.catalogue.axis(DIRECTION, np.arange(2)))
        self.repeats = numbers.size * self.starts * self.directions
        self.effects = config.needed_effects
        self.states = config.states_of(self.effects)

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes."""
        return tuple(len(axis.values) for axis in self.axes)

    def __len__(self) -> int:
        return math.prod(self.shape)

    @cached_property
    def repeats_after(self) -> int:
        """Mesh periods after which the excitation of every lane repeats."""
        return self.system_of(np.arange(1)).repeats_after

    @cached_property
    def clearance(self) -> bool:
        """Whether the elements have clearance."""
        return self.system_of(np.arange(1)).clearance

    @property
    def side_by_side(self) -> int:
        """Lanes that wait for no other: of a carried sweep one of each line, otherwise all."""
        carried = self.config.start.carry != "none"
        return len(self) // (swept_values(self.config.sweep).size if carried else 1)

    def computed_at(self, places: Integers) -> Integers:
        """Return the lanes at some places in the order of computation.

        A carried sweep takes a lane of each line along the first swept parameter, then the next one
        of each; any other sweep goes through its list.
        """
        carry, values = self.config.start.carry, swept_values(self.config.sweep).size
        if carry == "none":
            return places
        directions, repeats = self.directions, self.repeats // self.directions
        lines = self.side_by_side // self.repeats
        shape = (values, directions, lines, repeats)
        step, direction, line, repeat = np.unravel_index(places, shape)
        downwards = direction == 1 if carry == "both" else carry == "downwards"
        value = np.where(downwards, values - 1 - step, step)
        place = (line, value, repeat, direction)
        return np.ravel_multi_index(place, (lines, values, repeats, directions))

    def values_of(self, lanes: Integers) -> dict[str, Floats]:
        """Return the value of each swept parameter in some lanes, and the number of the pair."""
        index = np.unravel_index(lanes, self.shape)
        found = zip(self._of_systems.items(), index, strict=False)
        return {parameter: values[at] for (parameter, values), at in found}

    def system_of(self, lanes: Integers) -> LaneSystem:
        """Return the system of some lanes."""
        return system_of(self.config, self.values_of(lanes), self.effects)

    def start_of(self, lanes: Integers) -> Floats:
        """Return the configured start states of some lanes, shape (lanes, states)."""
        # Both directions of a carried sweep begin alike.
        return start_states(self.config, self.system_of(lanes), lanes // self.directions)

    def spread(self, count: int) -> Integers:
        """Return the numbers of at most so many lanes, spread evenly over all."""
        chosen = np.linspace(0, len(self) - 1, min(count, len(self)))
        return np.unique(chosen.round().astype(np.intp))

    @property
    def parameters(self) -> dict[str, Variable]:
        """The parameters of the model that some effect needs, with their origin."""
        names = [axis_name(parameter) for parameter in self._values]
        sizes = [values.size for values in self._values.values()]
        values = dict(zip(self._values, np.ix_(*self._values.values()), strict=True))
        found = self.model.parameters(self.config, values, self.effects)
        kept = (_kept(one, names, sizes) for one in found)
        scale_of = self.model.catalogue.scale_of
        return {one.name: replace(one, scale=scale_of(one.name)) for one in kept}


def _kept(one: ParameterValue, names: Sequence[str], sizes: Sequence[int]) -> Variable:
    """Return a parameter as a result keeps it; ``names``, ``sizes``: of the swept axes."""
    value, origin = one.value, one.origin
    dims: tuple[str, ...] = (HARMONIC,) if one.is_list else ()
    if np.ndim(value) > 0 and not dims:
        origin = "swept"
        along = [n for n, size in enumerate(np.shape(value)) if size > 1]
        # With one value on the axis nothing shows whether the parameter depends on it.
        along = along or list(range(len(names)))
        dims = tuple(names[n] for n in along)
        value = np.broadcast_to(np.squeeze(value), [sizes[n] for n in along])
    texts = one.units, one.long_name, one.symbol
    return Variable(one.name, dims, "float64", *texts, values=value, origin=origin)


def axis_of(parameter: Parameter, values: Floats, model: Model) -> Variable:
    """Return the axis of a swept parameter of a model, with values (values,)."""
    name = axis_name(parameter.name)
    texts = parameter.units, parameter.long_name, parameter.symbol
    return coordinate(name, *texts, values, model.catalogue.scale_of(name))


def start_states(config: Configuration, system: LaneSystem, numbers: Integers) -> Floats:
    """Return the start states, shape (lanes, states), of lanes with this system.

    ``numbers`` (lanes,): those that they have in the whole sweep: the random state of a lane
    depends on its number and the seed alone.
    """
    values: dict[Any, Any] = dict.fromkeys(system.states, 0.0)
    kind, spread = config.start.kind, config.start.spread
    box: dict[Any, tuple[float, float]] = {**config.start.box}
    values |= config.start.state
    if kind == "contact":
        values |= dict(zip(system.states, system.contact_state().T, strict=True))
    elif kind == "grid":
        count = config.start.count
        places = np.unravel_index(numbers % config.start.size, [count] * len(box))
        for (name, bounds), at in zip(box.items(), places, strict=True):
            values[name] = np.linspace(*bounds, count)[at]
        box = {**config.start.drawn}
    elif kind == "random" and not box:
        box = dict.fromkeys(config.states, (-spread, spread))
    if box:
        runs = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1)
        draws = np.concatenate([_draws(config.start.seed, run) for run in runs])
        for name, (low, high) in box.items():
            place = draws[:, config.states.index(name)]
            values[name] = (low + high) / 2.0 + (high - low) / 2.0 * place
    # What starts in a state that nothing kept depends on is not computed.
    columns = [np.broadcast_to(values[name], system.lanes) for name in system.states]
    return np.stack(columns, axis=1).astype(np.float64)


def _draws(seed: int, run: Integers) -> Floats:
    """Draw the random numbers of consecutive lanes, shape (lanes, draws)."""
    generator = np.random.Philox(seed)
    generator.advance(int(run[0]) * (_DRAWS_PER_LANE // _PHILOX_WIDTH))
    shape = run.size, _DRAWS_PER_LANE
    return np.random.Generator(generator).uniform(-1.0, 1.0, shape)
