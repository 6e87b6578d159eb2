"""The gear pair as a model: its flags, and what it gives the engine."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.models.gear_pair import equations, forcing, teeth
from gearchaos_kernels.models.gear_pair.coefficients import Lane
from gearchaos_kernels.models.gear_pair.forcing import Forcing, Phase, forcing_at
from gearchaos_kernels.models.protocol import MapFormulas, Model
from gearchaos_kernels.scene import implement


@dataclass(frozen=True)
class GearPair:
    """What the compiled loop of a gear pair has: True, or None where it is left out.

    Attributes
    ----------
    pitch_error, stiffness_variation, transverse, axial
        The effects of these names.
    phase
        A pitch error (eq. 14) that has a phase.
    teeth, undamped, wide
        Pitch errors tooth by tooth, those that act on the springs of the mesh alone, and with more
        than four pairs in mesh.
    """

    pitch_error: Any
    phase: Any
    teeth: Any
    undamped: Any
    wide: Any
    stiffness_variation: Any
    transverse: Any
    axial: Any


def _coordinates_of(flags: GearPair) -> tuple[bool, ...]:
    transverse, axial = bool(flags.transverse), bool(flags.axial)
    return True, transverse, transverse, axial, axial


def _elements(flags: GearPair) -> int:
    return 2 if flags.axial else 1


def _inputs(flags: GearPair) -> NDArray[Any]:
    """Load, then as far as there are: sine and cosine part of the pitch error."""
    inputs = np.zeros((3, 3, 3))
    inputs[0, 0, 0] = 1.0
    # sin and cos of the phase feed its sine and its cosine, those shifted by a quarter of a turn
    # its cosine and its negative sine.
    inputs[1, 1, 1] = inputs[1, 2, 2] = 1.0
    inputs[2, 1, 2], inputs[2, 2, 1] = 1.0, -1.0
    return inputs[: 1 + bool(flags.pitch_error) + bool(flags.pitch_error and flags.phase)]


def _apart(flags: GearPair) -> tuple[frozenset[int], frozenset[int]]:
    """The axial pair: eq. 13 drives it one way."""
    if not flags.axial:
        return frozenset(), frozenset()
    states = 2 * sum(_coordinates_of(flags))
    return frozenset(range(states - 4, states)), frozenset([1])


def _gap_coefficients(flags: GearPair) -> tuple[str, ...]:
    names = ["half_backlash"]
    if flags.transverse or flags.axial:
        names += ["mass_ratio_p", "mass_ratio_g"]
    if flags.pitch_error:
        names += ["error_mean", "error_amplitude", "error_rate"]
        if flags.axial:
            names += ["axial_error_mean", "axial_error_amplitude", "axial_error_rate"]
        if flags.phase:
            names += ["cos_phase", "sin_phase"]
    return tuple(names)


def _stiffness(coefficients: NDArray[Any]) -> NDArray[Any]:
    columns = [Lane._fields.index(name) for name in ("mean_stiffness", "stiffness_variation")]
    return coefficients[:, columns]


@scalar
def _point_of_waves(waves, scene):
    """Return the mesh phase with this sine and cosine."""
    sine, cosine = waves
    return Phase(0.0, sine, cosine, -sine)


@scalar
def _unit_forcing(lane, drive, waves, scene):
    """Return what a drive and these values of sine and cosine do."""
    acting = forcing_at(lane, _point_of_waves(waves, scene), scene)
    return Forcing(
        acting.stiffness,
        drive + acting.drive,
        acting.error,
        acting.error_rate,
        acting.axial_error,
        acting.axial_error_rate,
    )


@scalar
def _mobility_forces(lane, scene):
    """Return the share that each direction has of the mesh stiffness."""
    if scene.model.axial is None:
        return (1.0,)
    return 1.0, lane.axial_share


@scalar
def _inputs_of(lane, scene):
    """Return load, and both parts of the pitch error."""
    amplitude = 0.5 * lane.axial_error_amplitude
    if scene.model.pitch_error is None:
        return (lane.load,)
    if scene.model.phase is None:
        return lane.load, amplitude
    return lane.load, amplitude * lane.cos_phase, amplitude * lane.sin_phase


@scalar
def _mean_gaps(lane, scene):
    """Return what the mean pitch error takes from the gaps."""
    tangential, axial = 0.0, 0.0
    if scene.model.pitch_error is not None:
        tangential, axial = lane.error_mean, lane.axial_error_mean - lane.error_mean
    if scene.model.axial is None:
        return (tangential,)
    return tangential, axial


MAPS = MapFormulas(
    waves=("sine", "cosine"),
    inputs=_inputs,
    apart=_apart,
    gap_coefficients=_gap_coefficients,
    stiffness=_stiffness,
    point_of_waves=_point_of_waves,
    unit_forcing=_unit_forcing,
    mobility_forces=_mobility_forces,
    inputs_of=_inputs_of,
    mean_gaps=_mean_gaps,
)

MODEL = Model(
    coordinates=equations.Coordinates,
    coordinates_of=_coordinates_of,
    lane=Lane,
    elements=_elements,
    rows=lambda flags: teeth.ROWS if flags.teeth else 0,
    observed=("transmission_error",),
    begin_period=teeth.begin_period,
    grid_at=teeth.grid_at,
    grid_within=teeth.grid_within,
    first_point=teeth.first_point,
    keep_point=teeth.keep_point,
    point_at=teeth.point_at,
    point_within=teeth.point_within,
    forcing_at=forcing_at,
    unforced=forcing.unforced,
    from_kept=equations.from_kept,
    to_kept=equations.to_kept,
    kept_accelerations=equations.kept_accelerations,
    elements_at=equations.elements_at,
    half_clearances=equations.half_clearances,
    gap_speeds=equations.gap_speeds,
    gaps_at=equations.gaps_at,
    accelerations=equations.accelerations,
    observed_at=equations.observed_at,
    maps=MAPS,
)

implement(GearPair, MODEL)
