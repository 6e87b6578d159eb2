"""A configured sweep, computed block by block."""

import numpy as np
import pytest

from gearchaos.engine.simulation import compute_all

from .short_sweeps import RANDOM, assert_same, blocks, computed, joined, simulation


@pytest.mark.parametrize("overrides", [(), ("start.kind=contact",), RANDOM])
@pytest.mark.parametrize("values", [1, 4, 12])
def test_a_sweep_does_not_depend_on_the_size_of_its_blocks(overrides, values):
    sweep = simulation(*overrides)
    assert_same(computed(sweep, values), computed(sweep))


def test_blocks_need_not_hold_whole_values_where_nothing_is_carried():
    sweep = simulation(*RANDOM)
    odd = [(first, min(first + 7, 39)) for first in range(0, 39, 7)]
    assert_same(joined(dict(compute_all(sweep, odd))), computed(sweep))


@pytest.mark.parametrize("threads", [1, 3, 64])
def test_blocks_feed_every_thread_and_carried_ones_hold_whole_values(threads):
    assert simulation(*RANDOM).block_lanes(threads) >= 32 * threads
    carried = simulation(*RANDOM, "start.carry=upwards").block_lanes(threads)
    assert carried >= 32 * threads
    assert carried % 3 == 0


def test_a_value_with_more_starts_than_a_block_holds_is_carried_whole():
    sweep = simulation(*RANDOM, "start.carry=upwards", "start.count=5000")
    assert sweep.block_lanes(1) == 5000


def test_blocks_are_computed_the_way_of_the_carrying():
    bounds = [(4, 8), (0, 4), (8, 12)]
    assert simulation("start.carry=upwards").in_order(bounds) == sorted(bounds)
    assert simulation("start.carry=downwards").in_order(bounds) == sorted(bounds)[::-1]


def test_finished_blocks_are_not_computed_again():
    sweep = simulation()
    bounds = blocks(sweep, 4)
    everything = dict(compute_all(sweep, bounds))
    rest = dict(compute_all(sweep, bounds, {bounds[1]: lambda: everything[bounds[1]]}))
    assert sorted(rest) == sorted({*bounds} - {bounds[1]})
    for block, arrays in rest.items():
        assert_same(arrays, everything[block])


def test_every_array_of_a_block_is_a_variable_of_the_sweep():
    sweep = simulation(*RANDOM)
    arrays = sweep.compute(3, 10)
    assert {name: array.shape[0] for name, array in arrays.items()} == dict.fromkeys(arrays, 7)
    lanes = {variable.name for variable in sweep.variables if variable.dims[0] == sweep.axis}
    assert {*arrays} == lanes
    without = simulation("outputs.lyapunov=false").compute(0, 2)
    assert not [name for name in without if "lyapunov" in name]


def test_all_exponents_come_with_the_sum_that_the_damping_gives():
    sweep = simulation("outputs.spectrum=true", "integration.steps_per_period=800")
    arrays = sweep.compute(0, 3)
    assert arrays["lyapunov_spectrum"].shape == (3, len(sweep.states))
    total = arrays["lyapunov_spectrum"].sum(axis=1)
    assert np.allclose(total, arrays["lyapunov_sum"], rtol=0.0, atol=1e-6)


def test_a_mesh_stiffness_below_zero_is_noted():
    assert simulation().notes == []
    (note,) = simulation("groups.stiffness_variation_scale=9").notes
    assert "the mesh stiffness falls to -0.034 of its mean" in note
    without = 'scene.effects=["pitch_error", "backlash"]'
    assert simulation(without).notes == []
