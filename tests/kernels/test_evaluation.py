"""Jacobian, mesh forces and accelerations of given states, against statics and the twin."""

from types import SimpleNamespace

import numpy as np
import pytest
from gearchaos_kernels import STATES, Effects, Groups, jacobian, mesh_motion

from .reference import FULL, columns, lanes_of, pan2021, system_of
from .test_twin import MODEL, named
from .twin import Twin

STEPS, SAMPLES = 24, 61
SCENES = [
    FULL,
    Effects(axial=False),
    Effects(transverse=False, axial=False),
    Effects(transverse=False),
    Effects(pitch_error=False, backlash=False),
    Effects(stiffness_variation=False),
]
FOLLOWED = [FULL, Effects(axial=False), Effects(pitch_error=False, backlash=False)]
"""Few scenes, because each one is compiled; `test_twin` has the same formulas in more scenes."""
APART, DRIVING_FLANK, BACK_FLANK = 0, 1, 2


def three_lanes() -> Groups:
    return pan2021(
        [0.0, 5.86, 12.5],
        error_mean=[0.0, 0.1, -0.2],
        error_phase=[0.0, 0.5, 2.0],
        stiffness_variation_scale=[0.5, 1.0, 0.0],
    )


def lane(groups: Groups, number: int) -> SimpleNamespace:
    return SimpleNamespace(**{n: float(g[number]) for n, g in groups._asdict().items()})


def accelerations(twin: Twin, tau: float, full: np.ndarray) -> np.ndarray:
    """Return the five accelerations of the twin at one state, in the order of `STATES`."""
    joint = np.concatenate([full[0::2], full[1::2], np.zeros(10)])
    return twin.slope(tau, joint)[5:10]


@pytest.mark.parametrize("scene", SCENES, ids=named)
def test_the_jacobian_is_that_of_the_printed_equations_on_every_branch(scene):
    for number in range(2):
        groups = lane(MODEL, number)
        twin = Twin(groups, scene)
        kappa, tangent = twin.stiffness(0.3), np.tan(groups.base_helix_angle)
        limits = groups.half_backlash * np.array(
            [np.cos(groups.base_helix_angle), np.sin(groups.base_helix_angle)]
        )
        kept = columns(scene)
        # Approach 5 without and with the axial motion that cancels it in y_2, axial motion only,
        # and no motion.
        for approach, taken_back in ((5.0, 0.0), (5.0, 5.0 * tangent), (0.0, 2.0), (0.0, 0.0)):
            point = np.zeros(10)
            point[[STATES.index("delta_5"), STATES.index("delta_3")]] = approach, taken_back
            relative = twin.relative(point[0::2], twin.error(0.3)[0])
            touching = np.abs(relative) > limits
            slopes = kappa * np.where(scene.backlash, touching, True)
            wanted = np.zeros((10, 10))
            wanted[0::2, 1::2] = np.eye(5)
            for column in kept:
                shift = np.zeros(10)
                shift[column] = 1e-3
                ahead = accelerations(twin, 0.3, point + shift)
                wanted[1::2, column] = (ahead - accelerations(twin, 0.3, point - shift)) / 2e-3
            system = system_of(lanes_of(MODEL, [number]), scene)
            found = jacobian(system, slopes[np.newaxis, : system.elements])[0]
            scale = 1.0 + np.max(np.abs(found))
            assert found == pytest.approx(wanted[np.ix_(kept, kept)], abs=1e-9 * scale)


@pytest.mark.parametrize("scene", FOLLOWED, ids=named)
def test_accelerations_are_those_of_the_twin(scene):
    groups = three_lanes()
    if scene != FULL:
        # A phase needs another loop; other tests have compiled these scenes without a phase.
        groups = groups._replace(error_phase=np.zeros(3))
    kept = columns(scene)
    full = np.random.default_rng(1).normal(0.0, 2.0, (3, SAMPLES, len(STATES)))
    full[..., [column for column in range(len(STATES)) if column not in kept]] = 0.0
    for physical in (False, True):
        motion = mesh_motion(system_of(groups, scene, physical), full[..., kept], STEPS)
        assert motion.accelerations.shape == (3, SAMPLES, len(kept) // 2)
        for number in range(3):
            twin = Twin(lane(groups, number), scene, physical)
            tau = 2.0 * np.pi / groups.mesh_frequency[number] / STEPS * np.arange(SAMPLES)
            instants = zip(tau, full[number], strict=True)
            wanted = np.array([accelerations(twin, *instant) for instant in instants])
            found = motion.accelerations[number]
            wanted = wanted[:, [column // 2 for column in kept[0::2]]]
            np.testing.assert_allclose(found, wanted, rtol=1e-11, atol=1e-11)
            errors = [twin.error(instant)[0] for instant in tau]
            np.testing.assert_allclose(motion.pitch_error[number], errors, rtol=0, atol=1e-13)


def with_delta_5(values) -> np.ndarray:
    states = np.zeros((1, len(values), len(STATES)))
    states[0, :, STATES.index("delta_5")] = values
    return states


def test_the_statically_loaded_mesh_rests():
    """The clearance is closed, and the spring is compressed until cos(beta_b) N_y is the load."""
    groups = pan2021(0.0, stiffness_variation_scale=0.0)
    cosine = np.cos(groups.base_helix_angle)
    y_1 = groups.half_backlash * cosine + groups.load / cosine
    motion = mesh_motion(system_of(groups), with_delta_5(y_1), STEPS)
    assert motion.force_tangential[0] == pytest.approx(groups.load / cosine)
    assert abs(motion.accelerations[0, 0, 0]) < 1e-15


def test_both_gears_get_the_same_force_in_opposite_directions():
    """From rest, the sum of mass times acceleration is zero in both directions."""
    groups = pan2021([3.0, 9.0])
    states = np.repeat(with_delta_5(np.linspace(-3.0, 3.0, SAMPLES)), 2, axis=0)
    motion = mesh_motion(system_of(groups), states, STEPS)
    for driving, driven in ((1, 2), (3, 4)):
        pushed = motion.accelerations[..., driving] / groups.mass_ratio_p[:, np.newaxis]
        pulled = motion.accelerations[..., driven] / groups.mass_ratio_g[:, np.newaxis]
        assert np.max(np.abs(pushed)) > 0.1
        np.testing.assert_allclose(pushed, -pulled, rtol=1e-13, atol=1e-15)


def test_the_axial_force_is_that_of_eq_13():
    groups = pan2021([3.0, 9.0])
    states = np.repeat(with_delta_5(np.linspace(-3.0, 3.0, SAMPLES)), 2, axis=0)
    motion = mesh_motion(system_of(groups), states, STEPS)
    pushed = -groups.mass_ratio_p * np.sin(groups.base_helix_angle)
    wanted = pushed[:, np.newaxis] * motion.force_axial
    np.testing.assert_allclose(motion.accelerations[..., 3], wanted, rtol=1e-12, atol=1e-14)


def test_the_clearance_reports_the_contact():
    groups = pan2021(0.0, stiffness_variation_scale=0.0)
    edge = float(groups.half_backlash[0] * np.cos(groups.base_helix_angle[0]))
    places = np.array([-2.0, -1.0 - 1e-9, -1.0 + 1e-9, 0.0, 1.0 - 1e-9, 1.0 + 1e-9, 2.0]) * edge
    motion = mesh_motion(system_of(groups), with_delta_5(places), STEPS)
    contacts = [BACK_FLANK] * 2 + [APART] * 3 + [DRIVING_FLANK] * 2
    assert motion.contact_tangential[0].tolist() == contacts
    # The driving flank of one direction is the back flank of the other: y_2 = -tan(beta_b) y_1.
    turned = [{1: 2, 2: 1}.get(contact, 0) for contact in contacts]
    assert motion.contact_axial[0].tolist() == turned
    pressed = np.array([-edge, 0.0, 0.0, 0.0, 0.0, 0.0, edge])
    np.testing.assert_allclose(motion.force_tangential[0], pressed, atol=2e-9)


def test_without_clearance_the_teeth_never_part():
    scene = Effects(pitch_error=False, backlash=False)
    groups = pan2021(0.0, stiffness_variation_scale=0.0)
    motion = mesh_motion(system_of(groups, scene), with_delta_5([-0.5, 0.5]), STEPS)
    assert motion.contact_tangential[0].tolist() == [BACK_FLANK, DRIVING_FLANK]
    np.testing.assert_allclose(motion.force_tangential[0], [-0.5, 0.5])


def test_forces_repeat_bit_for_bit_with_the_mesh():
    states = np.zeros((3, 2 * STEPS + 1, len(STATES)))
    motion = mesh_motion(system_of(three_lanes()), states, STEPS)
    for values in motion:
        assert np.array_equal(values[:, :STEPS], values[:, STEPS:-1])
        assert np.array_equal(values[:, 0], values[:, -1])
