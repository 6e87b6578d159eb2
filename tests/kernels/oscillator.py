"""A second model, which shows what a model needs: x'' + 2 zeta x' + D(x; b) = F + A cos(W tau)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.models.protocol import Element, Gap, MapFormulas, Model
from gearchaos_kernels.scene import implement


class X(NamedTuple):
    x: float


class Lane(NamedTuple):
    stiffness: float
    damping: float
    half_clearance: float
    load: float
    amplitude: float
    per_step: float


@dataclass(frozen=True)
class Oscillator:
    """It has no effects that could be left out."""


@dataclass(frozen=True)
class System:
    """Lanes of oscillators: every field has the shape (lanes,)."""

    frequency: np.ndarray
    damping: np.ndarray
    half_clearance: np.ndarray
    load: np.ndarray
    amplitude: np.ndarray
    states = "x", "x_rate"
    clearance, repeats_after, flags = True, 1, Oscillator
    lanes = property(lambda self: self.frequency.size)
    mesh_period = property(lambda self: 2.0 * np.pi / self.frequency)

    def of(self, lanes):
        return System(*(getattr(self, name)[lanes] for name in self.__dataclass_fields__))

    def coefficients(self, step):
        force, one = step**2, np.ones(self.lanes)
        lane = one * force, 2.0 * self.damping * step, self.half_clearance
        return np.array([*lane, self.load * force, self.amplitude * force, 1.0 / step]).T.copy()

    def scales(self, step):
        return np.stack([np.ones(self.lanes), 1.0 / step], axis=1)

    def tables(self, steps):
        return (np.cos(np.pi / steps * np.arange(2 * steps + 1)),)

    def growth_rates(self):
        return 2.0 * self.damping + 1.0

    def of_unit_inputs(self):
        nothing = np.zeros(self.lanes)
        return System(self.frequency, self.damping, nothing, nothing, nothing + 1.0)

    def owned(self):
        return np.stack([self.frequency, self.damping], axis=1)

    def wave_series(self, steps, terms):
        half, term = np.pi / steps, np.arange(terms)
        middle = half * (2 * np.arange(steps) + 1)
        factor = half**term / np.cumprod(np.maximum(term, 1.0))
        cosine = (np.exp(1j * middle) * (1j**term * factor)[:, np.newaxis]).real
        return np.stack([np.zeros_like(cosine), cosine])

    def wave_values(self, phase):
        return np.cos(phase)[:, np.newaxis]

    def shared(self):
        return ()

    def harmonics(self):
        return 0

    def refuses_maps(self):
        return ""


@scalar
def grid_at(tables, row, scene):
    return tables[0][row]


@scalar
def point_within(memory, slot, tables, number, fraction, scene):
    return np.cos(4.0 * np.pi * (number + fraction) / (tables[0].shape[0] - 1))


@scalar
def grid_within(tables, number, fraction, scene):
    return point_within(None, 0, tables, number, fraction, scene)


@scalar
def forcing_at(lane, cosine, scene):
    return lane.load + lane.amplitude * cosine


@scalar
def unforced(lane, scene):
    return 0.0


@scalar
def elements_at(lane, forcing, scene):
    return (Element(lane.stiffness, lane.damping, lane.half_clearance),)


@scalar
def half_clearances(lane, scene):
    return (lane.half_clearance,)


@scalar
def gap_speeds(lane, scene):
    return (lane.per_step,)


@scalar
def gaps_at(state, lane, forcing, scene):
    return (Gap(state.position.x, state.rate.x, state.rate.x),)


@scalar
def accelerations(state, pushes, forcing, lane, scene):
    return X(forcing - pushes[0].force)


@scalar
def observed_at(state, lane, cosine, scene):
    return (state.position.x,)


@scalar
def point_of_waves(waves, scene):
    return waves[0]


@scalar
def unit_forcing(lane, drive, waves, scene):
    return drive + waves[0]


@scalar
def mobility_forces(lane, scene):
    return (1.0,)


@scalar
def inputs_of(lane, scene):
    return lane.load, lane.amplitude


@scalar
def mean_gaps(lane, scene):
    return (0.0,)


MAPS = MapFormulas(
    waves=("cosine",),
    inputs=lambda _flags: np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]]),
    apart=lambda _flags: (frozenset(), frozenset()),
    gap_coefficients=lambda _flags: ("half_clearance",),
    stiffness=lambda lanes: np.stack([lanes[:, 0], 0.0 * lanes[:, 0]], axis=1),
    point_of_waves=point_of_waves,
    unit_forcing=unit_forcing,
    mobility_forces=mobility_forces,
    inputs_of=inputs_of,
    mean_gaps=mean_gaps,
)
implement(
    Oscillator,
    Model(
        coordinates=X,
        coordinates_of=lambda _flags: (True,),
        lane=Lane,
        elements=lambda _flags: 1,
        observed=("x",),
        grid_at=grid_at,
        grid_within=grid_within,
        point_within=point_within,
        forcing_at=forcing_at,
        unforced=unforced,
        elements_at=elements_at,
        half_clearances=half_clearances,
        gap_speeds=gap_speeds,
        gaps_at=gaps_at,
        accelerations=accelerations,
        observed_at=observed_at,
        maps=MAPS,
    ),
)
