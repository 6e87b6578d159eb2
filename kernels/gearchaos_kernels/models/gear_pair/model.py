"""The gear pair as a model: its flags and its entries in the model protocol."""

from collections import namedtuple
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.models.gear_pair import equations, forcing, teeth
from gearchaos_kernels.models.gear_pair.coefficients import Lane
from gearchaos_kernels.models.gear_pair.forcing import Forcing, Phase, forcing_at
from gearchaos_kernels.models.protocol import ElementKind, MapFormulas, Model
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import flag, implement


@dataclass(frozen=True)
class OwnHarmonics:
    """Harmonics of the mesh stiffness that differ between lanes.

    Attributes
    ----------
    count : int
        Number of harmonics.
    """

    count: int


@dataclass(frozen=True)
class GearPair:
    """Flags of a gear pair: True for what the compiled loop contains, None for what it leaves out.

    Attributes
    ----------
    damped_in_contact : True or None
        The damper of the mesh acts only while teeth are in contact.
    harmonics : OwnHarmonics or None
        Harmonics of the mesh stiffness that differ between lanes; None if lanes share them.
    pitch_error, stiffness_variation, transverse, axial, friction : True or None
        The effects of these names; see `Effects`.
    phase : True or None
        The pitch error of eq. 14 has a phase.
    teeth : True or None
        Every tooth has its own pitch error.
    undamped : True or None
        These errors act on the springs of the mesh and not on its damper.
    wide : True or None
        More than four tooth pairs are in mesh at once.
    """

    pitch_error: Any
    phase: Any
    teeth: Any
    undamped: Any
    wide: Any
    stiffness_variation: Any
    transverse: Any
    axial: Any
    friction: Any
    damped_in_contact: Any = None
    harmonics: OwnHarmonics | None = None

    @property
    def own(self) -> bool | None:
        """Whether each lane has harmonics of its own, as a flag."""
        return flag(self.harmonics)

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of the harmonics that each lane has of its own."""
        return tuple(range(1, self.harmonics.count + 1)) if self.harmonics else ()


def _coordinates_of(flags: GearPair) -> tuple[bool, ...]:
    """Return for each of the five coordinates whether a scene has it."""
    transverse, axial = bool(flags.transverse), bool(flags.axial)
    return True, transverse, transverse, axial, axial


def _elements(flags: GearPair) -> int:
    """Return the number of directions of the mesh: tangential, and axial in a scene with it."""
    return 2 if flags.axial else 1


def _kinds(flags: GearPair) -> tuple[ElementKind, ...]:
    """Return the kind of each direction of the mesh."""
    return (ElementKind(damped_in_contact=bool(flags.damped_in_contact)),) * _elements(flags)


def _inputs(flags: GearPair) -> NDArray[Any]:
    """Return how the inputs force a pair: the load, then sine and cosine part of the pitch error.

    See `MapFormulas.inputs`. A scene without pitch error, or without its phase, has fewer inputs.
    """
    functions = 3 + 2 * len(flags.orders)
    inputs = np.zeros((3, functions, functions))
    inputs[0, 0, 0] = 1.0
    # The first part is sin(phase), with the derivative cos(phase). The second part is a quarter of
    # a turn ahead: cos(phase), with the derivative -sin(phase).
    inputs[1, 1, 1] = inputs[1, 2, 2] = 1.0
    inputs[2, 1, 2], inputs[2, 2, 1] = 1.0, -1.0
    return inputs[: 1 + bool(flags.pitch_error) + bool(flags.pitch_error and flags.phase)]


def _apart(flags: GearPair) -> tuple[frozenset[int], frozenset[int]]:
    """Return the axial states and the axial element, which do not act on the others (eq. 13)."""
    if not flags.axial:
        return frozenset(), frozenset()
    states = 2 * sum(_coordinates_of(flags))
    return frozenset(range(states - 4, states)), frozenset([1])


def _gap_coefficients(flags: GearPair) -> tuple[str, ...]:
    """Return the names of the coefficients on which the gaps depend (eqs 6, 7)."""
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


@scalar
def _point_of_waves(waves, scene):
    """Return the mesh phase with this sine and cosine, the first two of the waves."""
    return Phase(0.0, waves[0], waves[1], -waves[0])


@scalar
def _unit_forcing(lane, drive, waves, scene):
    """Return the forcing of a lane of unit inputs by a drive, and by these values of the waves."""
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
    """Return the stiffness of each direction relative to the mesh stiffness."""
    if scene.model.axial is None:
        return (1.0,)
    return 1.0, lane.axial_share


@scalar
def _inputs_of(lane, scene):
    """Return the load and the amplitudes of both parts of the pitch error."""
    amplitude = 0.5 * lane.axial_error_amplitude
    if scene.model.pitch_error is None:
        return (lane.load,)
    if scene.model.phase is None:
        return lane.load, amplitude
    return lane.load, amplitude * lane.cos_phase, amplitude * lane.sin_phase


@scalar
def _mean_gaps(lane, scene):
    """Return by how much the mean pitch error reduces each gap."""
    tangential, axial = 0.0, 0.0
    if scene.model.pitch_error is not None:
        tangential, axial = lane.error_mean, lane.axial_error_mean - lane.error_mean
    if scene.model.axial is None:
        return (tangential,)
    return tangential, axial


MAPS = MapFormulas(
    inputs=_inputs,
    apart=_apart,
    gap_coefficients=_gap_coefficients,
    stiffness=("mean_stiffness", "stiffness_variation"),
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
    kinds=_kinds,
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
    driven=forcing.driven,
    actuated="load",
    from_kept=equations.from_kept,
    to_kept=equations.to_kept,
    kept_accelerations=equations.kept_accelerations,
    elements_at=equations.elements_at,
    gap_speeds=equations.gap_speeds,
    gaps_at=equations.gaps_at,
    accelerations=equations.accelerations,
    switches=lambda flags: bool(flags.friction),
    next_switch=equations.next_sliding,
    switch=equations.change_sliding,
    observed_at=equations.observed_at,
    maps=MAPS,
)


def _own_stiffness(flags: GearPair, coefficients: Floats) -> Floats:
    """Return the stiffness of both directions as parts of the waves; see `Model.stiffness`."""
    first, waves = len(Lane._fields), 2 * len(flags.orders)
    columns = [Lane._fields.index(name) for name in MAPS.stiffness]
    mean, variation = coefficients[:, columns].T
    own = variation[:, np.newaxis] * coefficients[:, first : first + waves]
    # The variation that lanes share, and sine and cosine, which force the pair, are left out.
    nothing = np.zeros((len(mean), 3))
    parts = np.concatenate([mean[:, np.newaxis], nothing, own], axis=1)
    return np.repeat(parts[:, np.newaxis], _elements(flags), axis=1)


@cache
def model_of(flags: GearPair) -> Model:
    """Return the model of gear pairs: lanes with harmonics of their own have more coefficients."""
    if flags.harmonics is None:
        return MODEL
    names = [f"{kind}_{order}" for order in flags.orders for kind in ("cosine", "sine")]
    return replace(
        MODEL,
        lane=namedtuple("Lane", [*Lane._fields, *names]),
        maps=replace(MAPS, waves=(*MAPS.waves, *names), stiffness_parts=_own_stiffness),
    )


implement(GearPair, model_of)
