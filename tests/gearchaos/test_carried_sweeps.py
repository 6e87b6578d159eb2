"""Sweeps whose lanes start from the end states of their neighbours, and diverged lanes."""

import numpy as np
import pytest
from gearchaos_kernels import Status

from gearchaos.engine.computing import EndStates
from gearchaos.engine.computing import blocks as blocks_of

from .short_sweeps import (
    METHODS,
    RANDOM,
    assert_same,
    computed,
    computed_blocks,
    joined,
    kernel,
    listing,
    starts_of,
    unlabelled,
    values_of,
)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("direction", ["upwards", "downwards"])
def test_carried_sweep_is_the_chain_of_its_lanes_made_by_hand(direction, method):
    sweep = unlabelled(f"start.carry={direction}", f"integration.method={method}")
    arrays = computed(sweep, 5)
    state = np.zeros(6)
    for value in range(13) if direction == "upwards" else reversed(range(13)):
        state = kernel(sweep, value, state)
        assert np.array_equal(arrays["end_state"][value], state)


@pytest.mark.parametrize(
    ("direction", "overrides"),
    [
        ("upwards", RANDOM),
        ("downwards", ()),
        ("both", ()),
        ("both", ("integration.method=flow_map", *RANDOM)),
    ],
)
def test_carried_sweep_does_not_depend_on_the_size_of_its_blocks(direction, overrides):
    sweep = unlabelled(f"start.carry={direction}", *overrides)
    whole = computed(sweep)
    for values in (1, 4):
        assert_same(computed(sweep, values), whole)
    # Blocks may end between lanes that are computed side by side.
    odd = computed_blocks(sweep, blocks_of(sweep, sweep.lanes.side_by_side + 1))
    assert_same(joined(sweep, odd), whole)


@pytest.mark.parametrize("overrides", [(), (*RANDOM, "integration.error_check=0.4")])
def test_both_directions_at_once_are_the_two_sweeps_bit_for_bit(overrides):
    second = 'second_sweep={parameter="mesh_frequency", values=[0.8, 0.9]}'
    more = ("sweep.count=5", second, *overrides)
    both = computed(unlabelled("start.carry=both", *more))
    for number, direction in enumerate(("upwards", "downwards")):
        one = {name: array[number::2] for name, array in both.items()}
        assert_same(one, computed(unlabelled(f"start.carry={direction}", *more)))


@pytest.mark.parametrize("direction", ["upwards", "both"])
def test_carried_sweep_goes_on_from_a_finished_block(direction):
    sweep = unlabelled(f"start.carry={direction}", *RANDOM)
    bounds = blocks_of(sweep, 8)
    everything = computed_blocks(sweep, bounds)
    resumed = unlabelled(f"start.carry={direction}", *RANDOM)
    ends = EndStates(resumed)
    for block in bounds[:2]:
        ends.keep(block[0], everything[block]["end_state"])
    rest = computed_blocks(resumed, bounds[2:], ends)
    for block, arrays in rest.items():
        assert_same(arrays, everything[block])


def test_several_starts_are_carried_side_by_side():
    sweep = unlabelled("start.carry=upwards", *RANDOM)
    arrays = computed(sweep)
    states = list(starts_of(sweep, 0, 3))
    for value in range(13):
        for start in range(3):
            lane = 3 * value + start
            states[start] = kernel(sweep, lane, states[start])
            assert np.array_equal(arrays["end_state"][lane], states[start])
            if value > 0:
                assert np.array_equal(arrays["start_state"][lane], arrays["end_state"][lane - 3])


def test_sweeping_up_and_down_differ_where_two_motions_coexist():
    where = ("sweep.from=0.4", "sweep.to=2.4", "sweep.count=41")
    long = ("integration.transient_periods=150", *where)
    section = computed(unlabelled("start.carry=both", *long))["section_delta_5"]
    up, down = section[0::2, -1], section[1::2, -1]
    apart = np.abs(up - down) > 1e-3
    values = values_of(unlabelled(*long))
    assert apart[(values > 0.9) & (values < 1.5)].all()
    assert not apart[(values < 0.6) | (values > 2.0)].any()


# The load makes the first lane in the direction of the sweep diverge.
FIRST_DIVERGES = {
    "upwards": ("load", [-1e150, 0.2, 0.3]),
    "downwards": ("load", [0.2, 0.3, 1e150]),
}


@pytest.mark.parametrize("values", [1, 3])
@pytest.mark.parametrize("direction", FIRST_DIVERGES)
def test_a_lane_that_diverged_hands_nothing_on(tmp_path, direction, values):
    sweep = listing(
        tmp_path,
        *FIRST_DIVERGES[direction],
        "start.kind=contact",
        f"start.carry={direction}",
    )
    arrays = computed(sweep, values)
    way = [0, 1, 2] if direction == "upwards" else [2, 1, 0]
    assert arrays["status"][way].tolist() == [Status.DIVERGED, Status.OK, Status.OK]
    assert np.isnan(arrays["end_state"][way[0]]).all()
    anew = kernel(sweep, way[1], starts_of(sweep)[way[1]])
    assert np.array_equal(arrays["end_state"][way[1]], anew)
    carried = kernel(sweep, way[2], anew)
    assert np.array_equal(arrays["end_state"][way[2]], carried)


def test_a_lane_that_diverged_has_a_status_a_period_and_no_numbers(tmp_path):
    arrays = computed(listing(tmp_path, *FIRST_DIVERGES["upwards"]))
    assert arrays["diverged_period"].tolist() == [0, -1, -1]
    for name in ("section_delta_5", "lyapunov_exponent", "end_state"):
        assert np.isnan(arrays[name][0]).all()
        assert np.isfinite(arrays[name][1:]).all()


def test_exponent_of_a_swept_mesh_frequency_is_per_unit_of_time(tmp_path):
    # The rate of decay does not depend on the period of the forcing.
    frequencies = [0.4, 0.8, 1.6]
    sweep = listing(
        tmp_path,
        "mesh_frequency",
        frequencies,
        "scene.effects=[]",
        "integration.recorded_periods=400",
        "integration.steps_per_period=200",
    )
    groups = sweep.lanes.system_of(np.arange(3)).groups
    decay = groups.damping_ratio * np.cos(groups.base_helix_angle)
    assert computed(sweep)["lyapunov_exponent"] == pytest.approx(-decay, rel=1e-4)
