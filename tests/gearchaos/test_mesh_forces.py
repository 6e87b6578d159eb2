"""Mesh forces, contact and accelerations of given states, against statics and a slow twin."""

import numpy as np
import pytest
from gearchaos.dynamics.mesh_forces import (
    APART,
    BACK_FLANK,
    DRIVING_FLANK,
    accelerations,
    excitation,
    mesh_forces,
)
from gearchaos_kernels import STATE_ROWS, Scene

from ..kernels.reference import COSINE, FULL, SINE, lanes_of, pan2021
from ..kernels.twin import Twin

STEPS, SAMPLES = 24, 61
SCENES = [
    FULL,
    Scene(axial=False),
    Scene(transverse=False, axial=False),
    Scene(transverse=False),
    Scene(pitch_error=False, backlash=False),
    Scene(stiffness_variation=False),
]
NO_ERROR = Scene(pitch_error=False, stiffness_variation=False)


def model_of_three_lanes():
    return pan2021(
        [0.0, 5.86, 12.5],
        error_mean=[0.0, 0.1, -0.2],
        error_phase=[0.0, 0.5, 2.0],
        stiffness_variation_scale=[0.5, 1.0, 0.0],
    )


def evaluate(scene, model, states, rederived=False):
    imposed = excitation(scene, model, COSINE, SINE, STEPS, states.shape[1])
    forces = mesh_forces(scene, model, imposed, states, rederived=rederived)
    return forces, accelerations(scene, model, imposed, states, forces)


def with_delta_5(values) -> np.ndarray:
    states = np.zeros((1, len(values), len(STATE_ROWS)))
    states[0, :, STATE_ROWS["delta_5"]] = values
    return states


@pytest.mark.parametrize("rederived", [False, True])
@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_accelerations_are_those_of_the_twin(scene, rederived):
    model = model_of_three_lanes()
    states = np.random.default_rng(1).normal(0.0, 2.0, (3, SAMPLES, len(STATE_ROWS)))
    present = np.tile(np.repeat([True, scene.transverse, scene.axial], [1, 2, 2]), 2)
    states[..., ~present] = 0.0
    _, found = evaluate(scene, model, states, rederived)
    assert set(found) == {name for name, row in STATE_ROWS.items() if row < 5 and present[row]}
    for lane in range(3):
        groups = type(model)(*(group[0] for group in lanes_of(model, [lane])))
        twin = Twin(groups, scene, rederived)
        tau = 2.0 * np.pi / groups.mesh_frequency / STEPS * np.arange(SAMPLES)
        joint = np.concatenate([states[lane], np.zeros((SAMPLES, 10))], axis=1)
        slopes = np.array([twin.slope(*instant) for instant in zip(tau, joint, strict=True)])
        for name, values in found.items():
            expected = slopes[:, 5 + STATE_ROWS[name]]
            np.testing.assert_allclose(values[lane], expected, rtol=1e-11, atol=1e-11)


def test_the_statically_loaded_mesh_rests():
    """Clearance taken up, and the spring compressed until cos(beta_b) N_y carries the load."""
    model = pan2021(0.0)
    cosine = np.cos(model.base_helix_angle)
    y_1 = model.half_backlash * cosine + model.load / cosine
    forces, found = evaluate(NO_ERROR, model, with_delta_5(y_1))
    assert forces.tangential[0] == pytest.approx(model.load / cosine)
    assert abs(found["delta_5"][0, 0]) < 1e-15


def test_both_gears_feel_the_same_force_in_opposite_directions():
    """From rest, masses times accelerations add up to nothing in either direction."""
    model = pan2021([3.0, 9.0])
    states = np.zeros((2, SAMPLES, len(STATE_ROWS)))
    states[..., STATE_ROWS["delta_5"]] = np.linspace(-3.0, 3.0, SAMPLES)
    _, found = evaluate(FULL, model, states)
    for driving, driven in (("delta_1", "delta_2"), ("delta_3", "delta_4")):
        pushed = found[driving] / model.mass_ratio_p[:, np.newaxis]
        pulled = found[driven] / model.mass_ratio_g[:, np.newaxis]
        assert np.max(np.abs(pushed)) > 0.1
        np.testing.assert_allclose(pushed, -pulled, rtol=1e-13, atol=1e-15)


def test_the_clearance_tells_the_contact():
    model = pan2021(0.0)
    edge = float(model.half_backlash[0] * np.cos(model.base_helix_angle[0]))
    places = np.array([-2.0, -1.0 - 1e-9, -1.0 + 1e-9, 0.0, 1.0 - 1e-9, 1.0 + 1e-9, 2.0]) * edge
    forces, _ = evaluate(NO_ERROR, model, with_delta_5(places))
    contacts = [BACK_FLANK] * 2 + [APART] * 3 + [DRIVING_FLANK] * 2
    assert forces.contact_tangential[0].tolist() == contacts
    pressed = np.array([-edge, 0.0, 0.0, 0.0, 0.0, 0.0, edge])
    np.testing.assert_allclose(forces.tangential[0], pressed, atol=2e-9)


def test_without_clearance_the_teeth_never_part():
    scene = NO_ERROR._replace(backlash=False)
    forces, _ = evaluate(scene, pan2021(0.0), with_delta_5([-0.5, 0.5]))
    assert forces.contact_tangential[0].tolist() == [BACK_FLANK, DRIVING_FLANK]
    np.testing.assert_allclose(forces.tangential[0], [-0.5, 0.5])


def test_the_excitation_repeats_bit_for_bit_with_the_mesh():
    imposed = excitation(FULL, model_of_three_lanes(), COSINE, SINE, STEPS, 2 * STEPS + 1)
    for values in imposed:
        assert np.array_equal(values[:, :STEPS], values[:, STEPS:-1])
        assert np.array_equal(values[:, 0], values[:, -1])
