"""What a model is: the equations of motion of a system with clearance elements.

A model has coordinates, each with a rate, and elements that act on them. Everything is in scaled
coordinates per step: displacements as the model scales them, rates, accelerations and forces per
step and per step squared.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.scene import Interface


class Gap(NamedTuple):
    """The gap that an element sees, per step.

    ``rate``: its rate; ``closing``: the rate at which its flanks approach, which the damper sees.
    The two differ where the excitation moves the gap without moving the flanks.
    """

    value: float
    rate: float
    closing: float


class Element(NamedTuple):
    """A spring behind a clearance with a damper beside both, per step.

    ``stiffness``: of the spring now; ``damping``: of the damper, which always acts;
    ``half_clearance``: the gap at which the spring is met.
    """

    stiffness: float
    damping: float
    half_clearance: float


@scalar
def prepare_nothing(memory, slot, index, period, tables, scene):
    """Prepare nothing for a mesh period."""


@scalar
def shared_point(memory, slot, grid, scene):
    """Return the mesh phase of all lanes."""
    return grid


@scalar
def keep_nothing(memory, slot, point, scene):
    """Keep no mesh phase of its own for a lane."""


@scalar
def same_state(state, forcing, scene):
    """Return a state that is kept as the equations of motion take it."""
    return state


@scalar
def same_accelerations(changes, lane, point, scene):
    """Return the accelerations of a state that is kept as the equations of motion take it."""
    return changes


@dataclass(frozen=True, kw_only=True)
class Model:
    """One model: what the engine has to know of it, and its compiled formulas.

    Functions of ``flags`` take the model's part of a scene; all other functions are compiled. Those
    with a default serve models whose lanes share the mesh phase and whose states are kept as the
    equations of motion take them.

    Attributes
    ----------
    coordinates : type
        Named tuple of the coordinates.
    coordinates_of : callable
        ``coordinates_of(flags)``: for each of them whether a scene has it.
    lane : type
        Named tuple of the coefficients of one lane.
    elements : callable
        ``elements(flags)``: number of clearance elements.
    rows : callable
        ``rows(flags)``: rows of a block that the model keeps for itself.
    observed : tuple of str
        Names of the signals that `observed_at` returns.
    begin_period(memory, slot, index, period, tables, scene)
        Prepares a lane for a mesh period.
    grid_at(tables, row, scene), grid_within(tables, number, fraction, scene)
        What all lanes share at a row of the grid of half steps, and at a fraction of a step.
    first_point(memory, slot, grid, scene), keep_point(memory, slot, point, scene)
        The mesh phase at which a step begins, and keeping that at which the last one ended.
    point_at(memory, slot, grid, scene)
        The mesh phase of a lane on the grid.
    point_within(memory, slot, tables, number, fraction, scene)
        The mesh phase of a lane at a fraction of a step.
    forcing_at(lane, point, scene), unforced(lane, scene)
        What acts on a lane at a mesh phase, and nothing but a constant mean stiffness.
    from_kept(state, forcing, scene), to_kept(state, forcing, scene)
        A state as the equations of motion take it, from one as it is kept, and back.
    kept_accelerations(changes, lane, point, scene)
        The accelerations of the state that is kept, from those of the equations.
    elements_at(lane, forcing, scene)
        The elements, a tuple of `Element`. Only the stiffness may depend on the forcing, and half
        clearances are those of `half_clearances`.
    half_clearances(lane, scene), gap_speeds(lane, scene)
        Tuples of the half clearance of each element, and of what turns the rate of its gap into a
        speed per unit of tau.
    gaps_at(state, lane, forcing, scene)
        The gaps, a tuple of `Gap`.
    accelerations(state, pushes, forcing, lane, scene)
        The equations of motion: accelerations from the forces of the elements.
    observed_at(state, lane, point, scene)
        Tuple of further signals that can be recorded, of a state as the equations take it.
    maps : MapFormulas or None
        What flow maps need besides; None if the model has none.
    """

    coordinates: Any
    coordinates_of: Callable[[Any], tuple[bool, ...]]
    lane: Any
    elements: Callable[[Any], int]
    rows: Callable[[Any], int] = lambda _flags: 0
    observed: tuple[str, ...]
    begin_period: Any = prepare_nothing
    grid_at: Any
    grid_within: Any
    first_point: Any = shared_point
    keep_point: Any = keep_nothing
    point_at: Any = shared_point
    point_within: Any
    forcing_at: Any
    unforced: Any
    from_kept: Any = same_state
    to_kept: Any = same_state
    kept_accelerations: Any = same_accelerations
    elements_at: Any
    half_clearances: Any
    gap_speeds: Any
    gaps_at: Any
    accelerations: Any
    observed_at: Any
    maps: "MapFormulas | None" = None

    def function(self, name: str, _scene: Any) -> Any:
        """Return a compiled formula by its name."""
        return getattr(self.maps if name in MapFormulas.__annotations__ else self, name)


@dataclass(frozen=True)
class MapFormulas:
    """What flow maps need of a model whose excitation is a sum of waves.

    Attributes
    ----------
    waves : tuple of str
        The functions of the mesh phase that excite the model.
    inputs : callable
        ``inputs(flags)``: array of shape (inputs, functions, 1 + waves). An input is a number of a
        lane that forces it: steadily through the drive, or through waves. Entry (i, f, w): share of
        wave w (0: the constant 1) in what input i feeds into function f of `unit_forcing`. The
        first input is the steady one.
    apart : callable
        ``apart(flags)``: states and elements that act on nothing but themselves, two sets.
    gap_coefficients : callable
        ``gap_coefficients(flags)``: names of the coefficients of a lane on which gaps depend.
    stiffness : callable
        ``stiffness(coefficients)``: mean and variation of the stiffness of a lane, per step.
    point_of_waves(waves, scene)
        The mesh phase at which the waves have these values.
    unit_forcing(lane, drive, waves, scene)
        What a drive and these values of the waves do to a lane of unit inputs.
    mobility_forces(lane, scene)
        The force of each element per unit of what its spring and half clearance share: a tuple.
    inputs_of(lane, scene)
        The inputs of a lane, a tuple.
    mean_gaps(lane, scene)
        What constant parts of the excitation take from the gaps, a tuple.
    """

    waves: tuple[str, ...]
    inputs: Callable[[Any], NDArray[Any]]
    apart: Callable[[Any], tuple[frozenset[int], frozenset[int]]]
    gap_coefficients: Callable[[Any], tuple[str, ...]]
    stiffness: Callable[[Any], Any]
    point_of_waves: Any
    unit_forcing: Any
    mobility_forces: Any
    inputs_of: Any
    mean_gaps: Any


begin_period = Interface("model", "begin_period")
grid_at = Interface("model", "grid_at")
grid_within = Interface("model", "grid_within")
first_point = Interface("model", "first_point")
keep_point = Interface("model", "keep_point")
point_at = Interface("model", "point_at")
point_within = Interface("model", "point_within")
forcing_at = Interface("model", "forcing_at")
unforced = Interface("model", "unforced")
from_kept = Interface("model", "from_kept")
to_kept = Interface("model", "to_kept")
kept_accelerations = Interface("model", "kept_accelerations")
elements_at = Interface("model", "elements_at")
half_clearances = Interface("model", "half_clearances")
gap_speeds = Interface("model", "gap_speeds")
gaps_at = Interface("model", "gaps_at")
accelerations = Interface("model", "accelerations")
observed_at = Interface("model", "observed_at")
point_of_waves = Interface("model", "point_of_waves")
unit_forcing = Interface("model", "unit_forcing")
mobility_forces = Interface("model", "mobility_forces")
inputs_of = Interface("model", "inputs_of")
mean_gaps = Interface("model", "mean_gaps")
