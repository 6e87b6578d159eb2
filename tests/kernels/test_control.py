"""Control of an input: results against NumPy, tangent vector, noise and determinism."""

import numpy as np
import pytest
from gearchaos_kernels import Control, Plan, integrate
from scipy.special import ndtri

from .oscillator import Oscillators

METHODS = [("rk4", 40), ("flow_map", 8)]


GOLDEN, WHOLE = 0x9E3779B97F4A7C15, 2**64


def split_mix(number: int) -> int:
    """Return the output function of SplitMix64 (Steele, Lea, Flood 2014)."""
    number = ((number ^ number >> 30) * 0xBF58476D1CE4E5B9) % WHOLE
    number = ((number ^ number >> 27) * 0x94D049BB133111EB) % WHOLE
    return number ^ number >> 31


def gaussian(seed: int, number: int) -> float:
    """Return a normally distributed number, the quantile of a uniform number."""
    share = (float(split_mix((seed + (number + 1) * GOLDEN) % WHOLE) >> 12) + 0.5) * 2.0**-52
    return float(ndtri(share))


def oscillators(lanes: int) -> Oscillators:
    """Return oscillators with different loads that cross their clearance."""
    one = np.ones(lanes)
    load = np.linspace(0.1, 0.3, lanes)
    return Oscillators(0.7 * one, 0.05 * one, 0.2 * one, load, 0.4 * one)


def controlled(lanes: int, points: int = 1) -> Control:
    """Return a controller with an arbitrary target and gain."""
    rng = np.random.default_rng(3)
    target = rng.normal(size=(lanes, points, 2))
    gain = 0.3 * rng.normal(size=(lanes, points, 2))
    return Control.of_states(target, gain, np.full(lanes, 0.5))


@pytest.mark.parametrize(("method", "steps"), METHODS)
def test_each_input_is_what_the_gain_demands(method: str, steps: int) -> None:
    system, control = oscillators(9), controlled(9, points=3)
    start = np.zeros((9, 2))
    outcome = integrate(
        system.controlled(control), start, Plan(steps, 2, 18, 20, True, method=method)
    )
    states = np.concatenate([start[:, np.newaxis], outcome.section[:, :-1]], axis=1)
    deviation = states[:, :, np.newaxis] - control.points[:, np.newaxis]
    nearest = np.argmin(np.sum(deviation**2, axis=3), axis=2)
    lanes, periods = np.indices(nearest.shape)
    chosen = deviation[lanes, periods, nearest]
    wanted = -np.sum(control.gain[lanes, nearest] * chosen, axis=2)
    wanted[np.abs(wanted) > control.limit[:, np.newaxis]] = 0.0
    np.testing.assert_allclose(outcome.inputs[:, :19], wanted[:, :19], atol=1e-14)
    assert 0.0 < np.mean(outcome.inputs == 0.0) < 1.0


@pytest.mark.parametrize(("method", "steps"), METHODS)
def test_an_input_acts_as_a_load_of_this_size(method: str, steps: int) -> None:
    """Each mesh period is integrated separately, with the load that the controller has chosen."""
    system, control = oscillators(5), controlled(5)
    plan = Plan(steps, 0, 6, 6, tangent=True, method=method, contact=True)
    outcome = integrate(system.controlled(control), np.zeros((5, 2)), plan)
    state = np.zeros((5, 2))
    for period in range(6):
        loaded = system.replace(load=system.load + outcome.inputs[:, period])
        once = Plan(steps, 0, 1, 1, tangent=True, method=method, first_period=period)
        state = integrate(loaded, state, once).end_state
        np.testing.assert_allclose(outcome.section[:, period], state, atol=1e-14)


# RK4 needs many steps: its tangent vector is not the derivative of a step across a boundary.
@pytest.mark.parametrize(("method", "steps"), [("rk4", 400), ("flow_map", 8)])
def test_the_tangent_vector_is_that_of_the_closed_loop(method: str, steps: int) -> None:
    system, control = oscillators(1), controlled(1)._replace(limit=np.full(1, 10.0))
    start = np.array([[0.3, -0.1]])
    vectors = np.eye(2)
    plan = Plan(steps, 0, 3, 3, tangent=True, method=method)
    both = system.of(np.zeros(2, dtype=np.intp))
    given = control.of([0, 0])
    ended = integrate(both.controlled(given), np.tile(start, (2, 1)), plan, tangent_start=vectors)
    found = (ended.end_tangent * np.exp(np.sum(ended.growth, axis=1))[:, np.newaxis]).T
    assert np.all(ended.inputs != 0.0)
    h = 1e-6
    around = start + h * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    four = system.of(np.zeros(4, dtype=np.intp))
    given = control.of([0, 0, 0, 0])
    ends = integrate(four.controlled(given), around, plan).end_state
    expected = np.column_stack([ends[0] - ends[1], ends[2] - ends[3]]) / (2.0 * h)
    np.testing.assert_allclose(found, expected, rtol=2e-6, atol=2e-7)


def test_an_estimate_follows_its_equations() -> None:
    """The estimate of the kernel equals the same recursion in NumPy, including the noise."""
    rng = np.random.default_rng(5)
    lanes, system = 3, oscillators(3)
    control = controlled(lanes)._replace(
        measured=np.array([0]),
        noise=np.full((lanes, 1), 0.01),
        seeds=np.array([7, 8, 9], dtype=np.uint64),
        transition=0.4 * rng.normal(size=(lanes, 1, 2, 2)),
        response=rng.normal(size=(lanes, 1, 2)),
        correction=0.5 * rng.normal(size=(lanes, 1, 2, 1)),
    )
    outcome = integrate(system.controlled(control), np.zeros((lanes, 2)), Plan(40, 0, 12, 12))
    for lane in range(lanes):
        target, gain = control.points[lane, 0], control.gain[lane, 0]
        estimate, state = target.copy(), np.zeros(2)
        for period in range(12):
            noise = 0.01 * gaussian(int(control.seeds[lane]), period)
            error = state[0] + noise - estimate[0]
            estimate = estimate + control.correction[lane, 0, :, 0] * error
            wanted = -gain @ (estimate - target)
            wanted = wanted if abs(wanted) <= control.limit[lane] else 0.0
            assert outcome.inputs[lane, period] == pytest.approx(wanted, abs=1e-13)
            moved = control.transition[lane, 0] @ (estimate - target)
            estimate = target + moved + control.response[lane, 0] * wanted
            state = outcome.section[lane, period]


def test_delayed_feedback_compares_with_an_earlier_state() -> None:
    control = controlled(2)._replace(delay=2, limit=np.full(2, 10.0))
    outcome = integrate(oscillators(2).controlled(control), np.zeros((2, 2)), Plan(40, 0, 8, 8))
    states = np.concatenate([np.zeros((2, 3, 2)), outcome.section[:, :-1]], axis=1)
    expected = -np.einsum("ls,lns->ln", control.gain[:, 0], states[:, 2:] - states[:, :-2])
    np.testing.assert_allclose(outcome.inputs, expected, atol=1e-14)


def test_noise_is_normal() -> None:
    """This is the noise of the reference; the kernel uses the same noise in its estimates."""
    drawn = np.array([gaussian(11, n) for n in range(4000)])
    assert abs(drawn.mean()) < 4.0 / np.sqrt(4000)
    assert drawn.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(8000))
    assert abs(np.corrcoef(drawn[:-1], drawn[1:])[0, 1]) < 4.0 / np.sqrt(4000)
    # The first output of SplitMix64 with the seed 0.
    assert split_mix(GOLDEN) == 0xE220A8397B1DCDAF


@pytest.mark.parametrize(("method", "steps"), METHODS)
def test_bits_do_not_depend_on_the_lanes_beside(method: str, steps: int) -> None:
    lanes, plan = 70, Plan(steps, 3, 9, 9, tangent=True, method=method)
    rng = np.random.default_rng(6)
    control = controlled(lanes)._replace(
        noise=np.full((lanes, 2), 0.01), seeds=rng.integers(0, 2**63, lanes, dtype=np.uint64)
    )
    system, start = oscillators(lanes), np.zeros((lanes, 2))
    whole = integrate(system.controlled(control), start, plan)
    some = np.array([69, 3, 40, 41])
    part = integrate(system.controlled(control).of(some), start[some], plan)
    for name in ("section", "growth", "inputs", "end_tangent"):
        assert np.array_equal(getattr(whole, name)[some], getattr(part, name))


def test_control_begins_at_its_period() -> None:
    control = controlled(4)._replace(begins=5)
    plan = Plan(40, 0, 10, 10, tangent=True)
    outcome = integrate(oscillators(4).controlled(control), np.zeros((4, 2)), plan)
    free = integrate(oscillators(4), np.zeros((4, 2)), plan)
    assert np.all(outcome.inputs[:, :5] == 0.0)
    assert np.any(outcome.inputs[:, 5:] != 0.0)
    assert np.array_equal(outcome.section[:, :5], free.section[:, :5])
