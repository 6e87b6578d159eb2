"""The lanes of a configured sweep: their axes, systems and starts."""

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from gearchaos_kernels import METHODS, LaneSystem

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.configuration.tables import Parameter
from gearchaos.models import Configuration, axis_values, swept_values
from gearchaos.models.protocol import Model, ParameterValue
from gearchaos.models.registry import model_of, system_of
from gearchaos.outputs.names import DIRECTION, HARMONIC, REALISATION, START, axis_name
from gearchaos.outputs.variable import Variable, coordinate

if TYPE_CHECKING:
    from gearchaos.engine.control import Controllers

_FEWEST_DRAWS = 12
"""Fewest random numbers that are reserved per lane, a multiple of `_PHILOX_WIDTH`."""

_PHILOX_WIDTH = 4
"""Random numbers per Philox counter."""


class Lanes:
    """The product of all axes as a list of lanes; the last axis varies fastest.

    The result of a lane depends on its number in this list only.

    Attributes
    ----------
    axes : list of Variable
        Coordinates of the axes that exist, in the order second swept parameter, first swept
        parameter, realisation, start, direction.
    effects : tuple of str
        Effects that act on the outputs.
    states : tuple of str
        States with these effects.
    starts : int
        Starts per realisation.
    directions : int
        Directions of a carried sweep, otherwise 1.
    repeats : int
        Lanes per value, or pair of values, of the swept parameters.
    controllers : Controllers or None
        The controllers of the lanes; see `controlled_by`.
    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self.controllers: Controllers | None = None
        self.model = model_of(config)
        self._values = axis_values(config)
        self.axes = [
            axis_of(config.parameters[name], one, self.model) for name, one in self._values.items()
        ]
        # Parameters of the system of a lane, in the order of the axes.
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
    def _first(self) -> LaneSystem:
        """The system of the first lane, for what all lanes have in common."""
        return self.system_of(np.arange(1))

    @property
    def repeats_after(self) -> int:
        """Mesh periods per excitation period, for all lanes."""
        return self._first.repeats_after

    @property
    def clearance(self) -> bool:
        """Whether the elements have clearance."""
        return self._first.clearance

    @property
    def side_by_side(self) -> int:
        """Lanes that can be computed at once: in a carried sweep one per line, otherwise all."""
        carried = self.config.start.carry != "none"
        return len(self) // (swept_values(self.config.sweep).size if carried else 1)

    def computed_at(self, places: Integers) -> Integers:
        """Return the lanes at positions (lanes,) in the order of computation.

        A carried sweep computes the first lane of every line along the first swept parameter, then
        the second of every line, and so on. In other sweeps lanes that share what the method
        prepares are neighbours; apart from that, the order is that of the list.
        """
        carry, values = self.config.start.carry, swept_values(self.config.sweep).size
        if carry == "none":
            order = self._slowest_first
            index = np.unravel_index(places, [self.shape[axis] for axis in order])
            by_axis = dict(zip(order, index, strict=True))
            return np.ravel_multi_index([by_axis[n] for n in range(len(order))], self.shape)
        directions, repeats = self.directions, self.repeats // self.directions
        lines = self.side_by_side // self.repeats
        shape = (values, directions, lines, repeats)
        step, direction, line, repeat = np.unravel_index(places, shape)
        downwards = direction == 1 if carry == "both" else carry == "downwards"
        value = np.where(downwards, values - 1 - step, step)
        place = (line, value, repeat, direction)
        return np.ravel_multi_index(place, (lines, values, repeats, directions))

    @property
    def reordered(self) -> bool:
        """Whether the lanes are computed in another order than that of the list."""
        carried = self.config.start.carry != "none"
        return carried or self._slowest_first != list(range(len(self.shape)))

    @cached_property
    def _slowest_first(self) -> list[int]:
        """The axes in the order of computation: first those on which prepared maps depend."""
        sharing = METHODS[self.config.integration.method].sharing
        every = range(len(self.shape))
        alone: dict[int, bool] = {}
        for axis in every:
            # The lanes along this axis, from the first lane on.
            step = math.prod(self.shape[axis + 1 :])
            ends = step * np.unique([0, self.shape[axis] // 2, self.shape[axis] - 1])
            alone[axis] = bool(np.ptp(sharing(self.system_of(ends))))
        return sorted(every, key=lambda axis: not alone[axis])

    def values_of(self, lanes: Integers) -> dict[str, Floats]:
        """Return the value of each swept parameter, and the realisation, of some lanes (lanes,)."""
        index = np.unravel_index(lanes, self.shape)
        found = zip(self._of_systems.items(), index, strict=False)
        return {parameter: values[at] for (parameter, values), at in found}

    def controlled_by(self, controllers: "Controllers") -> Self:
        """Return the lanes with controllers, which the system of every lane has from then on."""
        lanes = copy(self)
        lanes.controllers = controllers
        return lanes

    def system_of(self, lanes: Integers) -> LaneSystem:
        """Return the system of some lanes, with their controllers if they have any."""
        values = self.values_of(lanes)
        system = system_of(self.config, values, self.effects)
        if self.controllers is None:
            return system
        return system.controlled(self.controllers.of(lanes, values, system))

    def start_of(self, lanes: Integers, system: LaneSystem | None = None) -> Floats:
        """Return the configured start states of some lanes, shape (lanes, states).

        ``system``: their system, if it is known.
        """
        system = self.system_of(lanes) if system is None else system
        # Both directions of a carried sweep have the same start.
        return start_states(self.config, system, lanes // self.directions)

    def spread(self, count: int) -> Integers:
        """Return the numbers of at most ``count`` lanes, spread evenly over the sweep."""
        chosen = np.linspace(0, len(self) - 1, min(count, len(self)))
        return np.unique(chosen.round().astype(np.intp))

    @cached_property
    def parameters(self) -> dict[str, Variable]:
        """Parameters of the model that its effects need, with their origin."""
        names = [axis_name(parameter) for parameter in self._values]
        sizes = [values.size for values in self._values.values()]
        values = dict(zip(self._values, np.ix_(*self._values.values()), strict=True))
        found = self.model.parameters(self.config, values, self.effects)
        kept = (_kept(one, names, sizes) for one in found)
        scale_of = self.model.catalogue.scale_of
        return {one.name: replace(one, scale=scale_of(one.name)) for one in kept}


def _kept(one: ParameterValue, names: Sequence[str], sizes: Sequence[int]) -> Variable:
    """Return a parameter as a result variable; ``names``, ``sizes``: of the swept axes."""
    value, origin = one.value, one.origin
    harmonic: tuple[str, ...] = (HARMONIC,) if one.is_list else ()
    shape = np.shape(value)
    over, of_each = shape[: len(shape) - len(harmonic)], shape[len(shape) - len(harmonic) :]
    dims = harmonic
    if over:
        origin = "swept"
        along = [n for n, size in enumerate(over) if size > 1]
        # With one value per axis, the shape does not show on which axes the parameter depends.
        along = along or list(range(len(names)))
        dims = (*(names[n] for n in along), *harmonic)
        whole = [sizes[n] for n in along]
        value = np.broadcast_to(
            np.reshape(value, [*[over[n] for n in along], *of_each]), [*whole, *of_each]
        )
    texts = one.units, one.long_name, one.symbol
    return Variable(one.name, dims, "float64", *texts, values=value, origin=origin)


def axis_of(parameter: Parameter, values: Floats, model: Model) -> Variable:
    """Return the axis of a swept parameter of a model, with values (values,)."""
    name = axis_name(parameter.name)
    texts = parameter.units, parameter.long_name, parameter.symbol
    return coordinate(name, *texts, values, model.catalogue.scale_of(name))


def start_states(config: Configuration, system: LaneSystem, numbers: Integers) -> Floats:
    """Return the start states, shape (lanes, states), of lanes with this system.

    ``numbers`` (lanes,): numbers of the lanes in the whole sweep. The random state of a lane
    depends on its number and the seed only.
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
        count = len(config.states)
        draws = np.concatenate([_draws(config.start.seed, run, count) for run in runs])
        for name, (low, high) in box.items():
            place = draws[:, config.states.index(name)]
            values[name] = (low + high) / 2.0 + (high - low) / 2.0 * place
    # States on which no output depends are left out.
    columns = [np.broadcast_to(values[name], system.lanes) for name in system.states]
    return np.stack(columns, axis=1).astype(np.float64)


def _draws(seed: int, run: Integers, count: int) -> Floats:
    """Draw random numbers for consecutive lanes, at least ``count`` for each."""
    counters = -(-max(count, _FEWEST_DRAWS) // _PHILOX_WIDTH)
    generator = np.random.Philox(seed)
    generator.advance(int(run[0]) * counters)
    shape = run.size, counters * _PHILOX_WIDTH
    return np.random.Generator(generator).uniform(-1.0, 1.0, shape)
