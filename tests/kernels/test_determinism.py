"""Results have the same bits for any number of threads and any split, order and neighbours."""

from collections.abc import Callable

import numba
import numpy as np
import pytest
from gearchaos_kernels import LANES, Outcome

from .reference import FLOW_MAP, FULL, assert_same_bits, lanes_of, lanes_out_of, pan2021, run, state

TOTAL = 3 * LANES + 4
MODEL = pan2021(
    np.linspace(0.0, 15.0, TOTAL),
    # Lanes with the same maps are integrated together, also if they are not neighbours.
    mesh_frequency=np.resize([0.7, 0.9, 1.0, 1.3, 1.4], TOTAL),
    load=np.linspace(0.2, 0.3, TOTAL),
)
START = np.random.default_rng(7).uniform(-1.5, 1.5, (TOTAL, 10))
# Two lanes diverge: one in its first period, one later.
START[40] = state(delta_5=np.nan)
MODEL.transverse_damping_g[77] = -1.8
HOW = {"steps": 72, "transient": 10, "periods": 20, "points": 15}


WAYS = [False, True, FLOW_MAP]


@pytest.fixture(scope="module", params=WAYS, ids=["plain", "resolved", "flow-map"])
def integrate(request) -> Callable[..., Outcome]:
    """Function that integrates lanes of this test by plain steps, resolved steps or flow maps."""

    def some(chosen) -> Outcome:
        model, start = lanes_of(MODEL, chosen), START[chosen]
        return run(model, FULL, start, **HOW, resolved=request.param)

    some.resolved = request.param
    return some


@pytest.fixture(scope="module")
def whole(integrate) -> Outcome:
    return integrate(np.arange(TOTAL))


def joined(parts: list[Outcome]) -> Outcome:
    return Outcome(*map(np.concatenate, zip(*parts, strict=True)))


def test_two_lanes_of_this_test_diverge_and_the_others_differ_from_one_another(integrate, whole):
    assert np.flatnonzero(whole.status).tolist() == [40, 77]
    assert whole.diverged_period[40] == 0
    assert whole.diverged_period[77] > HOW["transient"]
    assert np.unique(whole.end_state[:, 0]).size == TOTAL - 1
    # With resolved steps all lanes cross, at different speeds; plain steps count no crossings.
    assert np.unique(whole.slowest_crossing).size == (TOTAL if integrate.resolved else 1)


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
def test_one_thread_and_two_give_the_same_bits(integrate, whole):
    threads = numba.get_num_threads()
    try:
        for number in (1, 2):
            numba.set_num_threads(number)
            assert_same_bits(integrate(np.arange(TOTAL)), whole)
    finally:
        numba.set_num_threads(threads)


@pytest.mark.parametrize("size", [1, LANES - 1, LANES, LANES + 1])
def test_any_split_into_batches_gives_the_same_bits(integrate, whole, size):
    parts = [
        integrate(np.arange(first, min(first + size, TOTAL))) for first in range(0, TOTAL, size)
    ]
    assert_same_bits(joined(parts), whole)


def test_any_order_of_lanes_gives_the_same_bits(integrate, whole):
    order = np.random.default_rng(0).permutation(TOTAL)
    assert_same_bits(integrate(order), lanes_out_of(whole, order))


@pytest.mark.parametrize("resolved", WAYS)
def test_lanes_with_their_own_periods_have_the_bits_of_separate_calls(resolved):
    how = {**HOW, "resolved": resolved}
    own = np.resize([20, 5, 12, 1, 20], TOTAL)
    together = run(MODEL, FULL, START, **how, own=own)
    for periods in np.unique(own):
        chosen = np.flatnonzero(own == periods)
        points = min(HOW["points"], HOW["transient"] + periods)
        alone = {**how, "periods": periods, "points": points}
        separate = run(lanes_of(MODEL, chosen), FULL, START[chosen], **alone)
        found = lanes_out_of(together, chosen)
        sound = separate.status == 0
        assert np.isnan(found.section[:, :-points][sound]).all()
        assert not found.growth[sound, periods:].any()
        section, growth = found.section[:, -points:], found.growth[:, :periods]
        found = found._replace(section=section.copy(), growth=growth.copy())
        assert_same_bits(found, separate)


def test_a_second_run_gives_the_same_bits(integrate, whole):
    assert_same_bits(integrate(np.arange(TOTAL)), whole)


def test_integration_leaves_its_arguments_alone(whole):
    model = pan2021(np.linspace(0.0, 15.0, TOTAL))
    copies = [group.copy() for group in model]
    start = START.copy()
    run(model, FULL, start, **HOW)
    assert np.array_equal(start, START, equal_nan=True)
    assert all(np.array_equal(group, copy) for group, copy in zip(model, copies, strict=True))
    assert whole.section.shape == (TOTAL, HOW["points"], 10)


@pytest.mark.parametrize("resolved", WAYS)
def test_a_longer_transient_is_the_same_motion_recorded_later(resolved):
    how = {**HOW, "resolved": resolved}
    longer = run(MODEL, FULL, START, **{**how, "transient": 15, "periods": 15})
    shorter = run(MODEL, FULL, START, **how)
    assert np.array_equal(longer.section, shorter.section, equal_nan=True)
    assert np.array_equal(longer.growth, shorter.growth[:, 5:], equal_nan=True)
    assert np.array_equal(longer.end_state, shorter.end_state, equal_nan=True)


def test_no_lanes_give_empty_arrays(integrate):
    nothing = integrate(np.arange(0))
    assert nothing.section.shape == (0, HOW["points"], 10)
    assert nothing.status.shape == (0,)
