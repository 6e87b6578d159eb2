"""Taylor series of piecewise-linear systems against an adaptive method with events."""

import numba
import numpy as np
import pytest
from gearchaos_kernels import Plan, Status, gap_polynomials, gaps_along, integrate
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.polynomial import polynomial

from .oscillator import Oscillators
from .piecewise import (
    PERIODS,
    SIZES,
    WITH_LOADS,
    assert_exact,
    exact,
    lanes_of,
    random_machine,
)
from .reference import assert_same_bits, lanes_out_of

SERIES = WITH_LOADS | {"method": "taylor"}


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("steps", [1, 4, 30])
def test_series_are_exact_where_elements_of_every_kind_cross(size, steps):
    machines, start, section, growth, crossings = exact(*size)
    found = integrate(lanes_of(machines), start, Plan(steps, **SERIES))
    assert crossings.sum() >= 20
    assert found.crossings.tolist() == crossings.tolist()
    assert found.section == pytest.approx(section, abs=1e-11)
    assert found.growth == pytest.approx(growth, abs=1e-11)


@settings(max_examples=12)
@given(
    size=st.sampled_from(SIZES),
    seed=st.integers(100, 10_000),
    # Not 0: terms that are zero in all lanes are left out, which would need another loop.
    held=st.sampled_from([1.0, 0.01, -0.05]),
    steps=st.sampled_from([1, 4, 30]),
)
# Here a contact is shorter than a step that the adaptive method would choose.
@example(size=(3, 2), seed=961, held=-0.05, steps=1)
def test_series_are_exact_for_random_systems_with_and_without_springs_to_the_ground(
    size, seed, held, steps
):
    assert_exact(random_machine(seed, *size, held), seed, Plan(steps, **SERIES))


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_contact_and_crossings_are_those_of_flow_maps(size):
    machines, start, _, _, _ = exact(*size)
    system = lanes_of(machines)
    found = integrate(system, start, Plan(4, **SERIES))
    maps = integrate(system, start, Plan(60, **WITH_LOADS, method="flow_map"))
    assert found.contact == pytest.approx(maps.contact, rel=1e-10, abs=1e-10)
    assert found.slowest_crossing == pytest.approx(maps.slowest_crossing, rel=1e-10)


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_gaps_within_a_step_are_those_of_flow_maps(size):
    """The states are random, so that elements begin steps on every flank and apart."""
    machines, _, _, _, _ = exact(*size)
    system, steps = lanes_of(machines), 120
    states = np.random.default_rng(4).normal(size=(system.lanes, steps + 1, 2 * size[0]))
    gaps = gaps_along(system, states, steps)
    samples = np.arange(system.lanes) * 7 % steps
    flanks = gaps.flank[np.arange(system.lanes), samples]
    assert {0, 1, 2} <= set(flanks.ravel().tolist()) or size[1] == 1
    places = np.linspace(-1.0, 1.0, 5)
    for element in range(size[1]):
        along = [
            polynomial.polyval(
                places,
                gap_polynomials(
                    system,
                    Plan(steps, **SERIES | {"method": method}),
                    states,
                    gaps,
                    (samples, element),
                ).T,
            )
            for method in ("taylor", "flow_map")
        ]
        assert along[0] == pytest.approx(along[1], rel=1e-11, abs=1e-12)


def test_gaps_of_steps_longer_than_a_series_reaches_are_not_numbers():
    system = lanes_of([random_machine(1, 2, 1)])
    states = np.zeros((1, 2, 4))
    gaps = gaps_along(system, states, 1)
    terms = gap_polynomials(system, Plan(1, **SERIES), states, gaps, (np.zeros(1, dtype=int), 0))
    assert np.isnan(terms).all()


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_series_record_the_loads_of_fine_steps(size):
    machines, start, _, _, _ = exact(*size)
    system = lanes_of(machines)
    wanted = integrate(system, start, Plan(3200, **WITH_LOADS)).loads
    found = integrate(system, start, Plan(4, **SERIES)).loads
    size = np.abs(wanted[..., :2]).max(axis=2)
    # Forces jump where dampers act in contact only. These jumps are sampled by 240 and by 3200
    # steps.
    assert (np.abs(found[..., :2] - wanted[..., :2]).max(axis=2) <= 2e-3 * size).all()
    assert (np.abs(found[..., 2] - wanted[..., 2]) <= 2e-3 * size).all()


@pytest.fixture(scope="module")
def crowd():
    """Lanes of three machines with six coordinates and four elements; start, plan and outcome."""
    system = lanes_of([random_machine(n % 3, 6, 4) for n in range(43)])
    start = 0.5 * np.random.default_rng(3).normal(size=(system.lanes, 12))
    start[5] = np.nan
    plan = Plan(4, **SERIES)
    return system, start, plan, integrate(system, start, plan)


@pytest.mark.parametrize("chosen", [np.arange(43)[::-1], [3, 40, 1], [4]], ids=len)
def test_lanes_of_any_split_and_order_have_the_same_bits(crowd, chosen):
    system, start, plan, whole = crowd
    assert np.flatnonzero(whole.status).tolist() == [5]
    assert np.unique(whole.crossings).size > 5
    some = integrate(system.of(chosen), start[chosen], plan)
    assert_same_bits(some, lanes_out_of(whole, chosen))


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
def test_one_thread_gives_the_same_bits_as_all(crowd):
    system, start, plan, whole = crowd
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        assert_same_bits(integrate(system, start, plan), whole)
    finally:
        numba.set_num_threads(before)


def test_the_history_has_the_steps_of_the_plan(crowd):
    system, start, plan, whole = crowd
    found = integrate(system, start, plan._replace(history_periods=1))
    assert found.history.shape[1] == 5
    assert np.array_equal(found.history[:, -1], whole.section[:, -1], equal_nan=True)


def test_a_lane_that_is_too_fast_is_stopped_alone(crowd):
    system, start, plan, whole = crowd
    wild = system.of(np.arange(4))
    wild.rate[1] *= 1e7
    some = integrate(wild, start[:4], plan)
    assert some.status.tolist() == [0, Status.TOO_FAST, 0, 0]
    assert np.isnan(some.section[1]).all() and np.isnan(some.growth[1]).all()
    assert np.array_equal(some.section[[0, 2, 3]], whole.section[[0, 2, 3]])


def test_no_lanes_have_no_outcome(crowd):
    system, start, plan, _ = crowd
    assert integrate(system.of([]), start[:0], plan).section.shape == (0, PERIODS, 12)


def test_a_model_without_formulas_for_series_is_refused():
    lanes = np.ones(2)
    system = Oscillators(lanes, 0.05 * lanes, lanes, 0.1 * lanes, 0.1 * lanes)
    with pytest.raises(ValueError, match="the model has no formulas for Taylor series"):
        integrate(system, np.zeros((2, 2)), Plan(4, 0, 1, 1, method="taylor"))
