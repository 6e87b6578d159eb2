"""Piecewise-linear systems as a model: their flags and their entries in the model protocol."""

from collections import namedtuple
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.tuples import each, zeros_of
from gearchaos_kernels.models.linear.structure import Structure, numbered, places_of
from gearchaos_kernels.models.protocol import (
    Element,
    ElementKind,
    Gap,
    MapFormulas,
    Model,
    SeriesFormulas,
)
from gearchaos_kernels.models.sums import Terms, sums
from gearchaos_kernels.models.waves import waves_in_row, waves_within
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import implement


@dataclass(frozen=True)
class Linear:
    """Flags of a piecewise-linear system.

    Attributes
    ----------
    structure : Structure
        What its equations contain.
    """

    structure: Structure

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of the harmonics whose cosine and sine are waves."""
        return self.structure.orders


class Forcing(NamedTuple):
    """Forces and stiffnesses of a lane at a mesh phase; each entry is a tuple.

    Attributes
    ----------
    forces : tuple of float
        Force on each coordinate over its mass, per step squared.
    stiffness : tuple of float
        Stiffness of each element, per step squared.
    motion, motion_rate : tuple of float
        By how much the excitation reduces each gap, and its rate per step.
    """

    forces: Any
    stiffness: Any
    motion: Any
    motion_rate: Any


@cache
def coordinates_of(structure: Structure) -> Any:
    """Return the type of the coordinates of a structure."""
    return _numbered_type("Coordinates", structure.coordinates)


@cache
def _numbered_type(name: str, count: int) -> Any:
    return namedtuple(name, [f"x{number}" for number in range(count)])


def _rows(
    structure: Structure, names: tuple[str, ...], rows: int, widths: tuple[int, ...]
) -> Terms:
    """Return the products of matrices with factors that follow each other, row by row."""
    terms: list[list[tuple[int | None, int]]] = [[] for _ in range(rows)]
    first = 0
    for name, width in zip(names, widths, strict=True):
        for coefficient, row, column in numbered(structure, name):
            terms[row].append((coefficient, first + column))
        first += width
    return terms


def _acceleration_terms(flags: Linear) -> Terms:
    """Return the terms of the accelerations: forces, positions, rates, and pushes of elements."""
    structure = flags.structure
    count = structure.coordinates
    products = _rows(
        structure,
        ("position", "rate", "reaction"),
        count,
        (count, count, structure.elements),
    )
    # The forces come last among the factors and first in the sum.
    first = 2 * count + structure.elements
    return [[(None, first + row), *terms] for row, terms in enumerate(products)]


def _of_waves(name: str, rows: str) -> Any:
    """Return sums over the waves, the constant 1 first, for all coordinates or elements."""

    def terms(flags: Linear) -> Terms:
        given = flags.structure
        return _rows(given, (name,), getattr(given, rows), (1 + given.waves,))

    return sums(terms)


def _of_coordinates(flags: Linear) -> Terms:
    """Return the terms of the gaps."""
    structure = flags.structure
    return _rows(structure, ("gap",), structure.elements, (structure.coordinates,))


def _of_forces(flags: Linear) -> Terms:
    """Return the terms of the forces; the input of a controller follows the waves."""
    structure = flags.structure
    widths = (1 + structure.waves, 1)
    return _rows(structure, ("force", "actuator"), structure.coordinates, widths)


_forces = sums(_of_forces)
_stiffnesses = _of_waves("stiffness", "elements")
_motions = _of_waves("motion", "elements")
_motion_rates = _of_waves("motion_rate", "elements")
_gap_sums = sums(_of_coordinates)
_accelerations = sums(_acceleration_terms, lambda flags: coordinates_of(flags.structure))


def _picked(name: str) -> Any:
    """Return an intrinsic that returns one coefficient of a lane for each element."""

    @intrinsic
    def picked(_typing_context: Any, lane: Any, scene: Any) -> Any:
        structure = scene.scene.model.structure
        first = getattr(places_of(structure), name)
        returned = types.UniTuple(types.float64, structure.elements)

        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            found = [
                builder.extract_value(arguments[0], first + element)
                for element in range(structure.elements)
            ]
            return context.make_tuple(builder, returned, found)

        return returned(lane, scene), generate

    return picked


_half_clearances = _picked("half_clearance")
_dampings = _picked("damping")


@scalar
def half_clearances(lane, scene):
    """Return the half clearance of each element."""
    return _half_clearances(lane, scene)


@intrinsic
def _speed_of(_typing_context: Any, lane: Any, scene: Any) -> Any:
    """Return the steps per unit of tau of a lane."""
    at = places_of(scene.scene.model.structure).speed

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.extract_value(arguments[0], at)

    return types.float64(lane, scene), generate


def _input_or(otherwise: float) -> Any:
    """Return an intrinsic that returns the controller's input to a lane, or a constant."""

    @intrinsic
    def input_of(_typing_context: Any, lane: Any, scene: Any) -> Any:
        structure = scene.scene.model.structure

        def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            if not structure.actuator:
                return ir.Constant(ir.DoubleType(), otherwise)
            return builder.extract_value(arguments[0], places_of(structure).input)

        return types.float64(lane, scene), generate

    return input_of


_added = _input_or(0.0)
_first_input = _input_or(1.0)


@scalar
def grid_at(table, row, scene):
    """Return the waves at a row of the grid of half steps, a tuple."""
    return waves_in_row(table, row, scene)


@scalar
def point_within(memory, slot, table, number, fraction, scene):
    """Return the waves at a fraction of a step, the same for all lanes."""
    return waves_within(table, number, fraction, scene)


@scalar
def forcing_at(lane, point, scene):
    """Return what acts on a lane at these values of the waves."""
    return part_of_forcing(lane, 1.0, point, scene)


@scalar
def part_of_forcing(lane, share, point, scene):
    """Return what a share of all that is constant, and these values of waves, do to a lane."""
    return Forcing(
        _forces(lane, scene, share, point, share * _added(lane, scene)),
        _stiffnesses(lane, scene, share, point),
        _motions(lane, scene, share, point),
        _motion_rates(lane, scene, share, point),
    )


_no_waves = zeros_of(lambda scene: scene.model.structure.waves)


@scalar
def unforced(lane, scene):
    """Return what acts without excitation, with the mean stiffness of every element."""
    return driven(lane, 0.0, scene)


@scalar
def driven(lane, drive, scene):
    """Return what acts without excitation by this input of a controller."""
    nothing = _no_waves(scene)
    return Forcing(
        _forces(lane, scene, 0.0, nothing, drive),
        _stiffnesses(lane, scene, 1.0, nothing),
        _motions(lane, scene, 0.0, nothing),
        _motion_rates(lane, scene, 0.0, nothing),
    )


@scalar
def elements_at(lane, forcing, scene):
    """Return the clearance elements."""
    return each(_element, forcing.stiffness, _dampings(lane, scene), half_clearances(lane, scene))


@scalar
def _element(stiffness, damping, half_clearance):
    """Return an element."""
    return Element(stiffness, damping, half_clearance)


@scalar
def gap_speeds(lane, scene):
    """Return the factor from the rate of each gap per step to its rate per unit of tau."""
    return each(_second, half_clearances(lane, scene), _speed_of(lane, scene))


@scalar
def _second(_first, second):
    """Return the second one of two numbers."""
    return second


@scalar
def gaps_at(state, lane, forcing, scene):
    """Return the gaps y_j = n_j x - e_j."""
    values = _gap_sums(lane, scene, state.position)
    rates = _gap_sums(lane, scene, state.rate)
    return each(_gap, values, rates, forcing.motion, forcing.motion_rate)


@scalar
def _gap(value, rate, motion, motion_rate):
    """Return a gap less its excitation."""
    return Gap(value - motion, rate - motion_rate, rate - motion_rate)


@scalar
def _force_of(push):
    """Return the force of a push."""
    return push.force


@scalar
def accelerations(state, pushes, forcing, lane, scene):
    """Return the accelerations; coefficients of springs, dampers and reactions are negative."""
    forces = each(_force_of, pushes)
    return _accelerations(lane, scene, state.position, state.rate, forces, forcing.forces)


@scalar
def observed_at(state, lane, point, scene):
    """Return the gaps: the observed signals."""
    return each(_value_of, gaps_at(state, lane, forcing_at(lane, point, scene), scene))


@scalar
def _value_of(gap):
    """Return the value of a gap."""
    return gap.value


@intrinsic
def _moving(_typing_context: Any, waves: Any, scene: Any) -> Any:
    """Return the waves without the constant one that follows them if there is an actuator."""
    count = scene.scene.model.structure.waves
    returned = types.UniTuple(types.float64, count)

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        numbers = [builder.extract_value(arguments[0], at) for at in range(count)]
        return context.make_tuple(builder, returned, numbers)

    return returned(waves, scene), generate


@intrinsic
def _constant_or(_typing_context: Any, waves: Any, otherwise: Any, scene: Any) -> Any:
    """Return the value of the constant wave, or another number if there is no actuator."""
    structure = scene.scene.model.structure

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        if not structure.actuator:
            return arguments[1]
        return builder.extract_value(arguments[0], structure.waves)

    return types.float64(waves, types.float64, scene), generate


@scalar
def unit_forcing(lane, drive, waves, scene):
    """Return what acts on a lane by a drive and by these values of waves.

    The drive is the share of the steady forces, or the input of the actuator if there is one.
    """
    steady, moving = _constant_or(waves, drive, scene), _moving(waves, scene)
    return Forcing(
        _forces(lane, scene, steady, moving, drive),
        _stiffnesses(lane, scene, 1.0, _no_waves(scene)),
        _motions(lane, scene, 0.0, moving),
        _motion_rates(lane, scene, 0.0, moving),
    )


@scalar
def point_of_waves(waves, scene):
    """Return the waves themselves, without the constant one."""
    return _moving(waves, scene)


@scalar
def inputs_of(lane, scene):
    """Return the inputs: the maps of a lane already contain its forces and waves."""
    return _first_input(lane, scene), 1.0


@scalar
def mean_gaps(lane, scene):
    """Return the constant part of the excitation of each gap."""
    return _motions(lane, scene, 1.0, _no_waves(scene))


def _map_waves(structure: Structure) -> int:
    """Return the number of waves of flow maps.

    With an actuator, which is then the drive, the steady forces are those of a constant wave.
    """
    return structure.waves + (1 if structure.actuator else 0)


def _inputs(flags: Linear) -> NDArray[Any]:
    """Return the inputs of the maps: the steady forces or the actuator, and all waves."""
    functions = 1 + _map_waves(flags.structure)
    inputs = np.zeros((2, functions, functions))
    inputs[0, 0, 0] = 1.0
    for wave in range(1, functions):
        inputs[1, wave, wave] = 1.0
    return inputs


def _stiffness_parts(flags: Linear, coefficients: Floats) -> Floats:
    """Return the stiffness of every element as parts of the waves; see `Model.stiffness`."""
    structure = flags.structure
    parts = np.zeros((len(coefficients), structure.elements, 2 + _map_waves(structure)))
    for coefficient, element, wave in numbered(structure, "stiffness"):
        # No variation is shared.
        parts[:, element, wave + 1 if wave else 0] = coefficients[:, coefficient]
    return parts


def _kinds(flags: Linear) -> tuple[ElementKind, ...]:
    """Return the kind of each element."""
    of = flags.structure
    return tuple(ElementKind(*one) for one in zip(of.one_sided, of.damped_in_contact, strict=True))


@cache
def model_of(flags: Linear) -> Model:
    """Return the model of systems of one structure."""
    structure = flags.structure
    lane = _numbered_type("Coefficients", places_of(structure).total)
    return Model(
        coordinates=coordinates_of(structure),
        lane=lane,
        elements=lambda flags: flags.structure.elements,
        kinds=_kinds,
        observed=tuple(f"gap_{number}" for number in range(structure.elements)),
        grid_at=grid_at,
        grid_within=waves_within,
        point_within=point_within,
        forcing_at=forcing_at,
        unforced=unforced,
        driven=driven,
        actuated=lane._fields[places_of(structure).input] if structure.actuator else "",
        elements_at=elements_at,
        half_clearances=half_clearances,
        gap_speeds=gap_speeds,
        gaps_at=gaps_at,
        accelerations=accelerations,
        observed_at=observed_at,
        maps=MapFormulas(
            waves=tuple(f"wave_{number}" for number in range(_map_waves(structure))),
            inputs=_inputs,
            stiffness_parts=_stiffness_parts,
            point_of_waves=point_of_waves,
            unit_forcing=unit_forcing,
            inputs_of=inputs_of,
            mean_gaps=mean_gaps,
        ),
        series=SeriesFormulas(orders=lambda flags: flags.orders, part_of_forcing=part_of_forcing),
    )


implement(Linear, model_of)
