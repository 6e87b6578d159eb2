"""The Jacobian of eq. 13 against the equations as printed, differentiated numerically."""

import numpy as np
import pytest
from gearchaos.dynamics.jacobian import COORDINATES, coordinates, jacobian
from gearchaos_kernels import STATE_ROWS, Model, Scene

from ..kernels.twin import Twin
from .random_pairs import EVERY_SCENE, name_of, random_pairs

STATES = ["delta_5", "delta_1", "delta_2", "delta_3", "delta_4"]


@pytest.mark.parametrize("scene", EVERY_SCENE, ids=name_of)
def test_jacobian_of_every_scene_is_that_of_the_printed_equations_on_every_branch(scene):
    for seed in range(3):
        model = random_pairs(1, seed)
        groups = Model(*(float(group[0]) for group in model))
        twin = Twin(groups, scene)
        kappa, tangent = twin.stiffness(0.3), np.tan(groups.base_helix_angle)
        # Approach 5 with and without the axial approach that undoes it, and nothing at all.
        for approach, taken_back in ((5.0, 0.0), (5.0, 5.0 * tangent), (0.0, 2.0), (0.0, 0.0)):
            point = np.zeros(20)
            point[:5] = approach, 0.0, 0.0, taken_back, 0.0
            y_1, y_2 = twin.relative(point[:5], twin.error(0.3)[0])
            limits = groups.half_backlash * np.array(
                [np.cos(groups.base_helix_angle), np.sin(groups.base_helix_angle)]
            )
            touching = np.abs([y_1, y_2]) > limits
            slopes = kappa * np.where(scene.backlash, touching, True)
            columns = [STATE_ROWS[name] for name in scene_states(scene)]
            wanted = np.zeros((10, 10))
            for column in columns:
                shift = np.zeros(20)
                shift[column] = 1e-3
                ahead, behind = twin.slope(0.3, point + shift), twin.slope(0.3, point - shift)
                wanted[:, column] = (ahead - behind)[:10] / 2e-3
            found = jacobian(scene, model, slopes[:1], slopes[1:])[0]
            scale = 1.0 + np.max(np.abs(found))
            assert found == pytest.approx(wanted[np.ix_(columns, columns)], abs=1e-9 * scale)


def scene_states(scene: Scene) -> list[str]:
    kept = np.repeat([True, scene.transverse, scene.axial], [1, 2, 2])
    names = [name for name, present in zip(STATES, kept, strict=True) if present]
    return [state for name in names for state in (name, f"{name}_rate")]


def test_coordinates_of_a_scene_are_named():
    names = [COORDINATES[row] for row in coordinates(Scene(transverse=False))]
    assert names == [
        "torsion",
        *(f"axial bearing of the {gear} gear" for gear in ("driving", "driven")),
    ]
