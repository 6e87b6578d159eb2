"""A gear pair of ten states has the same motion when written as a piecewise-linear machine."""

from pathlib import Path

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate
from gearchaos_kernels.models.gear_pair.coefficients import Lane
from gearchaos_kernels.models.linear.system import LinearSystems

import gearchaos
from gearchaos.models.registry import system_of

SWEEPS = Path(__file__).parents[2] / "sweeps"
VALUES = np.array([0.0, 2.0, 5.86, 10.75, 12.47])


def as_machine(pairs):
    """Return gear pairs with axial motion (eq. 13) as machines, in the scaled coordinates."""
    lane = Lane(*pairs.coefficients(np.ones(pairs.lanes)).T)
    nothing, one = np.zeros(pairs.lanes), np.ones(pairs.lanes)
    orders = range(1, pairs.stiffness_cosine.size + 1)
    waves = 1 + 2 * len(orders)

    def wave(mean, sine):
        """Return the waves of a mean and a sine of the mesh phase."""
        return np.stack([mean, nothing, sine, *[nothing] * (waves - 3)], axis=1)

    def diagonal(*names):
        return np.stack(
            [np.diag([0.0, *row]) for row in np.transpose([getattr(lane, n) for n in names])]
        )

    bearings = ("transverse_{}_p", "transverse_{}_g", "axial_{}_p", "axial_{}_g")
    p, g = lane.mass_ratio_p, lane.mass_ratio_g
    row = np.stack([one, p, g, nothing, nothing], axis=1)
    axial = np.stack([nothing, nothing, nothing, p, g], axis=1)
    stiffness = np.zeros((pairs.lanes, waves))
    stiffness[:, 0] = lane.mean_stiffness
    stiffness[:, 1::2] = np.outer(lane.stiffness_variation, pairs.stiffness_cosine)
    stiffness[:, 2::2] = np.outer(lane.stiffness_variation, pairs.stiffness_sine)
    shares = np.stack([one, lane.axial_share], axis=1)
    error = wave(lane.error_mean, lane.error_amplitude)
    axial_error = wave(lane.axial_error_mean, lane.axial_error_amplitude)
    force = np.zeros((pairs.lanes, 5, waves))
    force[:, 0] = wave(lane.load, lane.error_inertia)
    return LinearSystems(
        frequency=2.0 * np.pi / pairs.mesh_period,
        position=diagonal(*(name.format("stiffness") for name in bearings)),
        rate=diagonal(*(name.format("damping") for name in bearings)),
        # The axial force acts only on the axial coordinates.
        reaction=np.tile(np.array([[1, 1, 1, 0, 0], [0, 0, 0, 1, 1.0]]).T, (pairs.lanes, 1, 1)),
        gap=np.stack([row, axial - row], axis=1),
        force=force,
        motion=np.stack([error, axial_error - error], axis=1),
        stiffness=shares[:, :, np.newaxis] * stiffness[:, np.newaxis],
        damping=shares * lane.mesh_damping[:, np.newaxis],
        half_clearance=np.tile(lane.half_backlash[:, np.newaxis], 2),
        orders=tuple(orders),
        damped_in_contact=(pairs.damped_in_contact_only,) * 2,
    )


@pytest.mark.parametrize("method", ["rk4", "flow_map"])
@pytest.mark.parametrize("in_contact", [False, True])
def test_a_gear_pair_as_a_machine_moves_as_the_gear_pair(method, in_contact):
    config = gearchaos.load_config(SWEEPS / "pan2021_full.toml")
    effects = ("pitch_error", "stiffness_variation", "backlash", "transverse", "axial")
    pairs = system_of(config, {"pitch_error": VALUES}, effects)
    pairs = pairs.replace(damped_in_contact_only=in_contact)
    scales = pairs.scales(np.ones(VALUES.size))
    start = np.random.default_rng(1).uniform(-0.3, 0.3, scales.shape)
    plan = Plan(200, 0, 20, 20, tangent=True, contact=True, method=method)
    expected, found = (
        integrate(system, state, plan)
        for system, state in ((pairs, start), (as_machine(pairs), start / scales))
    )
    assert (found.crossings == expected.crossings).all() and found.crossings.min() > 5
    # The last lane is chaotic: it amplifies rounding errors, more with less damping.
    error = np.abs(found.section * scales[:, np.newaxis] - expected.section).max(axis=(1, 2))
    assert error[:-1].max() < 1e-12 and error[-1] < (1e-8 if in_contact else 1e-10)
    assert found.contact[:, :, :4] == pytest.approx(expected.contact[:, :, :4], abs=1e-8)
