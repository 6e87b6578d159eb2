"""The tables of flow maps, computed from the formulas of a model; see `store`."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.methods.flow_map.layout import layout_of
from gearchaos_kernels.methods.flow_map.series import (
    ORDER,
    TAIL,
    differentiate,
    make_maps,
)
from gearchaos_kernels.plan import Floats
from gearchaos_kernels.scene import Scene, provider_of

MOST_MAP_STEPS = 4096
"""Largest number of steps per period up to which it is doubled."""


def make_tables(
    system: Any, sets: NDArray[np.intp], steps: int, scene: Scene
) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Compute the maps of lanes for some sets of branches, ``sets`` (lanes, sets in a step).

    Returns them, shape (lanes, steps, size of a step), whether the series of each lane converge,
    and whether its coefficients are finite.
    """
    place, model = layout_of(scene), provider_of(scene.model)
    inputs = np.ascontiguousarray(model.maps.inputs(scene.model))
    system, lanes = system.of_unit_inputs(), system.lanes
    coefficients = system.coefficients(system.mesh_period / steps)
    tables, tails = np.zeros((lanes, steps, place.step_size)), np.zeros(lanes)
    edges = system.wave_values(2.0 * np.pi / steps * np.arange(steps + 1))
    tables[:, :, : place.waves] = edges[:-1]
    tables[:, :, place.waves : 2 * place.waves] = edges[1:]
    width = place.states + 1 + place.waves + place.elements
    matrices = np.zeros((lanes, place.states + place.elements, width))
    dampers = np.zeros((lanes, place.elements, width - place.elements + 1))
    seen = max(0, place.signals - place.elements)
    # The last column of the observed signals is their constant part.
    observed = np.zeros((lanes, seen, width - place.elements + 1))
    traced = observed, np.zeros((lanes, place.elements, 3))
    differentiate(coefficients, matrices, dampers, traced, scene)
    engaged = 1.0 - (sets[:, :, np.newaxis] >> np.arange(place.elements)) % 2
    elements_on = engaged, dampers, model.stiffness(scene.model, coefficients), *traced
    forcing = system.wave_series(steps, ORDER)
    make_maps(matrices, elements_on, inputs, forcing, tables, tails, place)
    return tables, tails < TAIL, np.isfinite(coefficients).all(axis=1)
