"""The protocol of models serves not only the gear pair, but also an oscillator with clearance."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate, jacobian

from .oscillator import Oscillators

ZETA, LOAD, HALF_CLEARANCE = 0.05, 0.1, 1.0
RECORDED = {"tangent": True, "contact": True, "loads": True}
"""Records of all tests, so that one loop per method serves all of them."""


def oscillators(frequency: np.ndarray, amplitude: float) -> Oscillators:
    """Return lanes of x'' + 2 zeta x' + D(x; 1) = 0.1 + amplitude W^2 cos(W tau)."""
    alike = (np.full(frequency.size, value) for value in (ZETA, HALF_CLEARANCE, LOAD))
    return Oscillators(frequency, *alike, amplitude * frequency**2)


def linear_response(system: Oscillators) -> np.ndarray:
    """Return x and x' at tau = 0 of the motion that never leaves the flank, in closed form."""
    w = system.frequency
    wave = system.amplitude / (1.0 - w**2 + 2j * ZETA * w)
    return np.stack([HALF_CLEARANCE + LOAD + wave.real, -w * wave.imag], axis=1)


FREQUENCY = np.array([0.5, 0.7, 0.8, 1.3, 1.9])


@pytest.mark.parametrize(
    ("method", "steps", "error"), [("rk4", 200, 1e-7), ("flow_map", 12, 1e-13)]
)
def test_the_motion_on_a_flank_is_the_linear_response(method, steps, error):
    system = oscillators(FREQUENCY, 0.02)
    start = linear_response(system)
    plan = Plan(steps, 0, 20, 20, method=method, **RECORDED)
    outcome = integrate(system, start, plan)
    assert outcome.section == pytest.approx(np.repeat(start[:, np.newaxis], 20, axis=1), abs=error)
    # The mass stays on the driving flank for all 20 periods.
    assert outcome.contact[:, 0, 0] == pytest.approx(20.0)
    mean_force = outcome.loads[:, 0, 2]
    assert mean_force == pytest.approx(LOAD, abs=1e-6)
    assert outcome.loads[:, 1, 2] == pytest.approx(HALF_CLEARANCE + LOAD, abs=1e-6)


def test_both_methods_agree_where_the_mass_leaves_the_flank():
    system = oscillators(FREQUENCY, 0.1)
    start = np.tile([1.3, 0.0], (FREQUENCY.size, 1))
    exact, finer = (
        integrate(system, start, Plan(steps, 0, 10, 10, method="flow_map", **RECORDED))
        for steps in (24, 48)
    )
    assert exact.section == pytest.approx(finer.section, abs=1e-12)
    assert (exact.crossings >= 2).all()
    errors = []
    for steps in (100, 200, 400):
        found = integrate(system, start, Plan(steps, 0, 10, 10, **RECORDED))
        errors.append(np.abs(found.section - exact.section).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 3.5).all()


def test_a_lane_does_not_depend_on_its_neighbours():
    system = oscillators(np.linspace(0.4, 1.8, 37), 0.1)
    start = np.tile([1.3, 0.0], (37, 1))
    for method in ("rk4", "flow_map"):
        plan = Plan(24, 2, 5, 5, method=method, **RECORDED)
        together = integrate(system, start, plan)
        alone = integrate(system.of(np.array([20])), start[:1], plan)
        assert np.array_equal(together.section[20:21], alone.section)
        assert np.array_equal(together.growth[20:21], alone.growth)


def test_states_follow_from_the_coordinates():
    system = oscillators(FREQUENCY, 0.1)
    assert system.states == ("x", "x_rate")
    assert system.elements == 1 and system.lanes == FREQUENCY.size
    assert system.repeated(2).frequency.tolist() == np.repeat(FREQUENCY, 2).tolist()


def test_the_jacobian_is_that_of_the_equation_on_either_branch():
    system = oscillators(FREQUENCY, 0.1)
    for stiffnesses, k in zip(system.branch_stiffnesses(), (1.0, 0.0), strict=True):
        found = jacobian(system, stiffnesses)
        assert found == pytest.approx(np.tile([[0.0, 1.0], [-k, -2.0 * ZETA]], (5, 1, 1)))


def test_lanes_share_flow_maps_that_differ_in_what_forces_them():
    system = oscillators(np.ones(4), 0.1)
    two = np.array([1.0, 2.0, 1.0, 1.0])
    for alike in ("half_clearance", "load", "amplitude"):
        other = system.replace(**{alike: two})
        assert np.array_equal(other.map_parameters(), system.map_parameters())
        for name, value in vars(other.of_unit_inputs()).items():
            assert np.array_equal(value, vars(system.of_unit_inputs())[name])
    for differing in ("frequency", "damping"):
        rows = system.replace(**{differing: two}).map_parameters()
        assert len(np.unique(rows, axis=0)) == 2
