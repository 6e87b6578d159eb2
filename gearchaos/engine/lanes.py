"""From a configuration to what the kernels take: the groups and the start state of every lane."""

from __future__ import annotations

from typing import Any

import numpy as np
from gearchaos_kernels import STATE_ROWS, Model
from numpy.typing import NDArray

from gearchaos.configuration import Configuration
from gearchaos.gear.groups import GROUP_TABLE, Groups

Floats = NDArray[np.float64]

_DRAWS_PER_LANE = 12
"""Random numbers set aside per lane: a multiple of the four that one Philox counter yields."""

_PHILOX_WIDTH = 4


def select(groups: Groups, values: NDArray[np.intp]) -> Groups:
    """Return the groups at some values of the sweep; what all lanes share stays a number."""
    chosen: dict[str, Any] = {}
    for row in GROUP_TABLE:
        value = getattr(groups, row.name)
        varies = isinstance(value, np.ndarray) and not row.is_list
        chosen[row.name] = value[values] if varies else value
    return Groups(**chosen, origin=groups.origin)


def model(groups: Groups, lanes: int) -> Model:
    """Return the kernels' model of some lanes.

    Parameters
    ----------
    groups : Groups
        Numbers, or arrays of shape (lanes,).
    lanes : int
        Number of lanes.
    """

    def filled(value: float | Floats | None, absent: float = 0.0) -> Floats:
        return np.broadcast_to(np.float64(absent) if value is None else value, lanes).astype(float)

    multiple = filled(groups.pitch_error)
    return Model(
        mesh_frequency=filled(groups.mesh_frequency),
        load=filled(groups.load),
        damping_ratio=filled(groups.damping_ratio),
        base_helix_angle=np.radians(filled(groups.base_helix_angle_deg)),
        half_backlash=filled(groups.half_backlash),
        # "5.86 e(tau)" multiplies mean and amplitude of one pitch error alike (eq. 14).
        error_mean=multiple * filled(groups.pitch_error_mean),
        error_amplitude=multiple * filled(groups.pitch_error_amplitude),
        error_phase=np.radians(filled(groups.pitch_error_phase_deg)),
        stiffness_variation_scale=filled(groups.stiffness_variation_scale),
        mass_ratio_p=filled(groups.mass_ratio_p, absent=1.0),
        mass_ratio_g=filled(groups.mass_ratio_g, absent=1.0),
        transverse_stiffness_p=filled(groups.transverse_stiffness_p),
        transverse_damping_p=filled(groups.transverse_damping_p),
        transverse_stiffness_g=filled(groups.transverse_stiffness_g),
        transverse_damping_g=filled(groups.transverse_damping_g),
        axial_stiffness_p=filled(groups.axial_stiffness_p),
        axial_damping_p=filled(groups.axial_damping_p),
        axial_stiffness_g=filled(groups.axial_stiffness_g),
        axial_damping_g=filled(groups.axial_damping_g),
    )


def start_states(config: Configuration, model: Model, numbers: NDArray[np.intp]) -> Floats:
    """Return the start states of some lanes, shape (lanes, 10), columns of `STATE_ROWS`.

    Parameters
    ----------
    config : Configuration
        Its table ``start`` decides.
    model : Model
        Of these lanes.
    numbers : ndarray of int, shape (lanes,)
        Their numbers in the whole sweep, ascending: the random state of a lane depends on its
        number and the seed alone.
    """
    lanes = model.load.size
    start = np.zeros((lanes, len(STATE_ROWS)))
    columns = [STATE_ROWS[name] for name in config.scene.states]
    kind = config.start.kind
    if kind == "given":
        for name, value in config.start.state.items():
            start[:, STATE_ROWS[name]] = value
    elif kind == "contact":
        start[:, STATE_ROWS["delta_5"]] = _contact(config, model)
    elif kind == "random":
        first = int(numbers[0])
        generator = np.random.Philox(config.start.seed)
        generator.advance(first * (_DRAWS_PER_LANE // _PHILOX_WIDTH))
        shape = (int(numbers[-1]) - first + 1, _DRAWS_PER_LANE)
        draws = np.random.Generator(generator).uniform(-1.0, 1.0, shape)[numbers - first]
        start[:, columns] = config.start.spread * draws[:, : len(columns)]
    return start


def _contact(config: Configuration, model: Model) -> Floats:
    """Clearance taken up towards the load, and the deflection f_n of a mesh of stiffness 1."""
    clearance = np.zeros_like(model.load)
    if "backlash" in config.scene.effects:
        clearance = model.half_backlash * np.cos(model.base_helix_angle)
    return np.copysign(clearance, model.load) + model.load
