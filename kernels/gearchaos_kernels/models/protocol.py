"""The interface of models: the equations of motion of a system with clearance elements.

A model has coordinates, each with a rate, and elements that act on them. All formulas are in scaled
coordinates per step: displacements in a scale that the model chooses, rates per step, accelerations
and forces per step squared.

Entries that a model leaves out are those of `defaults` and `mesh_phase`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.models import defaults, mesh_phase
from gearchaos_kernels.plan import Floats


class Gap(NamedTuple):
    """The gap of an element, in scaled coordinates.

    Attributes
    ----------
    value : float
        The gap.
    rate : float
        Its rate per step.
    closing : float
        Rate at which the flanks approach, per step; the damper acts on it. It differs from ``rate``
        where the excitation changes the gap without moving the flanks.
    """

    value: float
    rate: float
    closing: float


class ElementKind(NamedTuple):
    """The kind of an element.

    Attributes
    ----------
    one_sided : bool
        Whether the spring acts on positive gaps only; there is no back flank.
    damped_in_contact : bool
        Whether the damper acts only while the element is in contact. Its force then jumps where a
        contact begins or ends.
    """

    one_sided: bool = False
    damped_in_contact: bool = False


class Element(NamedTuple):
    """A clearance element: a spring behind a clearance, and a damper; see `ElementKind`.

    Attributes
    ----------
    stiffness : float
        Stiffness of the spring at this instant, per step squared.
    damping : float
        Damping coefficient, per step.
    half_clearance : float
        The gap at which the spring comes into contact.
    """

    stiffness: float
    damping: float
    half_clearance: float


@cache
def _compiled(formula: Callable[..., Any]) -> Any:
    """Return a formula compiled, if it is a plain Python function."""
    return formula if hasattr(formula, "py_func") else scalar(formula)


@dataclass(frozen=True, kw_only=True)
class Model:
    """One model: what the engine needs to know about it, and its compiled formulas.

    Entries with an argument ``flags`` are Python functions; they receive the model's part of a
    scene. All other functions are formulas that compiled code calls: functions compiled by
    `scalar`, or plain Python functions, which are compiled on their first use.

    Attributes
    ----------
    coordinates : type
        Named tuple of the coordinates.
    coordinates_of : callable, optional
        ``coordinates_of(flags)``: for each coordinate whether a scene has it; by default it has
        all.
    lane : type
        Named tuple of the coefficients of one lane.
    elements : callable, optional
        ``elements(flags)``: number of clearance elements, 1 by default.
    kinds : callable, optional
        ``kinds(flags)``: the `ElementKind` of each element, a tuple; by default two-sided, with a
        damper that always acts.
    rows : callable, optional
        ``rows(flags)``: rows of a block that the model uses for itself, 0 by default.
    observed : tuple of str
        Names of the signals that `observed_at` returns.
    begin_period(memory, slot, index, period, tables, scene)
        Prepares a lane for a mesh period; does nothing by default.
    grid_at(tables, row, scene), grid_within(tables, number, fraction, scene)
        What all lanes share at a row of the grid of half steps, and at a fraction of step
        ``number``. By default a `MeshPhase` from the tables of `LaneSystem.tables`.
    first_point(memory, slot, grid, scene), keep_point(memory, slot, point, scene)
        The mesh phase of a lane at the beginning of a step; storing that at the end of a step for
        the next one. By default lanes share the mesh phase, and nothing is stored.
    point_at(memory, slot, grid, scene)
        The mesh phase of a lane on the grid, by default the shared one.
    point_within(memory, slot, tables, number, fraction, scene)
        The mesh phase of a lane at a fraction of a step, by default a `MeshPhase`.
    forcing_at(lane, point, scene), unforced(lane, scene)
        What acts on a lane at a mesh phase; the same without excitation and with mean stiffness. By
        default the forcing is one number, the drive, and 0 if unforced.
    driven(lane, drive, scene)
        What acts on an unforced lane by a steady input; by default the input itself.
    actuated : str
        Name of the coefficient of a lane that is its steady input, to which a controller adds its
        own; by default a lane has none.
    from_kept(state, forcing, scene), to_kept(state, forcing, scene)
        A state in the coordinates of the equations from one as it is stored, and back. By default
        both are the same.
    kept_accelerations(changes, lane, point, scene)
        The accelerations of the stored coordinates from those of the equations.
    elements_at(lane, forcing, scene)
        The elements, a tuple of `Element`. Only the stiffness may depend on the forcing.
    half_clearances(lane, scene)
        The half clearance of each element, a tuple; by default those of `elements_at`.
    gap_speeds(lane, scene)
        Factor from the rate of each gap per step to its speed per unit of tau, a tuple. By default
        the coefficient ``speed`` of the lane.
    gaps_at(state, lane, forcing, scene)
        The gaps, a tuple of `Gap`.
    accelerations(state, pushes, forcing, lane, scene)
        The equations of motion: accelerations of the coordinates, from the forces of the elements
        (`Push`), the forcing and the state.
    switches : callable, optional
        ``switches(flags)``: whether the coefficients of a lane switch at known moments of the mesh
        period; by default they never do. The state is continuous at a switch, the accelerations
        need not be. A method ends a step, or a part of one, at each of these moments.
    next_switch(lane, scene)
        The moment of the next switch in steps since the mesh period began, more than 0 and at most
        the steps of a period. Two switches never coincide.
    switch(memory, slot, lane, scene)
        Stores the coefficients that a lane has after its next switch.
    observed_at(state, lane, point, scene)
        The observed signals of a state in the coordinates of the equations, a tuple.
    maps : MapFormulas or None
        What flow maps need in addition; None if they cannot integrate the model.
    series : SeriesFormulas or None
        What Taylor series need in addition; None if they cannot integrate the model.
    """

    coordinates: Any
    coordinates_of: Callable[[Any], tuple[bool, ...]] | None = None
    lane: Any
    elements: Callable[[Any], int] = lambda _flags: 1
    kinds: Callable[[Any], tuple[ElementKind, ...]] | None = None
    rows: Callable[[Any], int] = lambda _flags: 0
    observed: tuple[str, ...]
    begin_period: Any = defaults.prepare_nothing
    grid_at: Any = mesh_phase.grid_at
    grid_within: Any = mesh_phase.grid_within
    first_point: Any = defaults.shared_point
    keep_point: Any = defaults.keep_nothing
    point_at: Any = defaults.shared_point
    point_within: Any = mesh_phase.point_within
    forcing_at: Any
    unforced: Any = defaults.no_drive
    driven: Any = defaults.drive_alone
    actuated: str = ""
    from_kept: Any = defaults.same_state
    to_kept: Any = defaults.same_state
    kept_accelerations: Any = defaults.same_accelerations
    elements_at: Any
    half_clearances: Any = defaults.clearances_of_elements
    gap_speeds: Any = defaults.speeds_of_lane
    gaps_at: Any
    accelerations: Any
    switches: Callable[[Any], bool] = lambda _flags: False
    next_switch: Any = defaults.never
    switch: Any = defaults.switch_nothing
    observed_at: Any
    maps: "MapFormulas | None" = None
    series: "SeriesFormulas | None" = None

    def function(self, name: str, _scene: Any) -> Any:
        """Return a compiled formula by its name."""
        parts = (MapFormulas, self.maps), (SeriesFormulas, self.series)
        owner = next((part for kind, part in parts if name in kind.__annotations__), self)
        return _compiled(getattr(owner, name))

    def present(self, flags: Any) -> tuple[bool, ...]:
        """Return for each coordinate whether a scene with these flags has it."""
        if self.coordinates_of is None:
            return (True,) * len(self.coordinates._fields)
        return self.coordinates_of(flags)

    def kinds_of(self, flags: Any) -> tuple[ElementKind, ...]:
        """Return the kind of each element of a scene with these flags."""
        return self.kinds(flags) if self.kinds else (ElementKind(),) * self.elements(flags)

    def states(self, flags: Any) -> int:
        """Return the number of states of a scene with these flags."""
        return 2 * sum(self.present(flags))

    def gap_columns(self, flags: Any) -> list[int]:
        """Return the places of the coefficients of a lane on which its gaps depend."""
        named = self.maps and self.maps.gap_coefficients
        names = named(flags) if named else self.lane._fields
        return [self.lane._fields.index(name) for name in names]

    def stiffness(self, flags: Any, coefficients: Floats) -> Floats:
        """Return the parts of the stiffness of every element, shape (lanes, elements, parts).

        The parts are those of the constant 1, of the shared variation, and of the waves. In a model
        whose elements share their stiffness, only the first two are not 0.
        """
        if self.maps and self.maps.stiffness_parts is not None:
            parts: Floats = self.maps.stiffness_parts(flags, coefficients)
            return parts
        waves = len(self.maps.waves) if self.maps else 0
        stiffness = np.zeros((len(coefficients), self.elements(flags), 2 + waves))
        for number, name in enumerate(self.maps.stiffness if self.maps else ()):
            column = coefficients[:, self.lane._fields.index(name)]
            stiffness[:, :, number] = column[:, np.newaxis]
        return stiffness


@dataclass(frozen=True, kw_only=True)
class MapFormulas:
    """The formulas of a model for flow maps; its excitation is a sum of waves.

    Attributes
    ----------
    waves : tuple of str, optional
        Names of the functions of the mesh phase that excite the model; sine and cosine by default.
    inputs : callable, optional
        ``inputs(flags)``: array of shape (inputs, functions, 1 + waves). An input is a number of a
        lane that forces it, either steadily or through waves. The functions are the arguments of
        `unit_forcing`: the drive, then the waves. Entry (i, f, w) is the share of wave w (0: the
        constant 1) that input i contributes to function f. The first input is the steady one. By
        default the inputs are a load and the amplitude of a harmonic.
    apart : callable, optional
        ``apart(flags)``: numbers of the states and of the elements that act on nothing but
        themselves, two sets; both are empty by default.
    gap_coefficients : callable, optional
        ``gap_coefficients(flags)``: names of the coefficients of a lane on which its gaps depend,
        all by default.
    stiffness : tuple of str, optional
        Names of the coefficients that are mean and variation of the stiffness that all elements
        share; only ``stiffness``, which is constant, by default.
    stiffness_parts : callable, optional
        ``stiffness_parts(flags, coefficients)``: see `Model.stiffness`, for a model whose elements
        have stiffnesses of their own.
    point_of_waves(waves, scene)
        The mesh phase at which the waves have these values, by default a `MeshPhase`.
    unit_forcing(lane, drive, waves, scene)
        The forcing of a lane of unit inputs by a drive and these values of the waves. By default
        both add up.
    mobility_forces(lane, scene)
        Stiffness of each element relative to the shared one, a tuple; 1 by default.
    inputs_of(lane, scene)
        The inputs of a lane, a tuple: the steady one per step squared, as the drive, and the others
        relative to those of `LaneSystem.of_unit_inputs`.
    mean_gaps(lane, scene)
        By how much constant parts of the excitation reduce each gap, a tuple; 0 by default.
    """

    waves: tuple[str, ...] = mesh_phase.MeshPhase._fields
    inputs: Callable[[Any], NDArray[Any]] = defaults.load_and_harmonic
    apart: Callable[[Any], tuple[frozenset[int], frozenset[int]]] = lambda _flags: (
        frozenset(),
        frozenset(),
    )
    gap_coefficients: Callable[[Any], tuple[str, ...]] | None = None
    stiffness: tuple[str, ...] = ("stiffness",)
    stiffness_parts: Callable[[Any, Floats], Floats] | None = None
    point_of_waves: Any = mesh_phase.point_of_waves
    unit_forcing: Any = defaults.drive_with_waves
    mobility_forces: Any = defaults.equal_shares
    inputs_of: Any
    mean_gaps: Any = defaults.no_mean_gaps


@dataclass(frozen=True, kw_only=True)
class SeriesFormulas:
    """The formulas of a model for Taylor series.

    On a contact branch its equations are linear in the state, and linear in the waves. The series
    of forcing, gaps and accelerations then follow from the model's formulas, term by term.

    Attributes
    ----------
    orders : callable
        ``orders(flags)``: the orders of the harmonics of the mesh phase whose cosine and sine, in
        this sequence, are the waves: the mesh phase of the model is the tuple of them.
    part_of_forcing(lane, share, point, scene)
        What acts on a lane by a share of all that is constant, and by these values of the waves.
    """

    orders: Callable[[Any], tuple[int, ...]]
    part_of_forcing: Any
