"""A configured sweep is computed block by block."""

import numpy as np
import pytest

from gearchaos.engine.computing import block_lanes, compute_block
from gearchaos.engine.kept import variables_of

from .short_sweeps import (
    RANDOM,
    SHORT,
    assert_same,
    computed,
    computed_blocks,
    joined,
    simulation,
    unlabelled,
)

NO_ENDS = np.zeros((0, 0))
"""End states of a sweep that is not carried."""


@pytest.mark.parametrize(
    "overrides",
    [(), ("start.kind=contact",), RANDOM, ("integration.method=flow_map", *RANDOM)],
)
def test_a_sweep_does_not_depend_on_the_size_of_its_blocks(overrides):
    sweep = simulation(*overrides)
    whole = computed(sweep)
    for values in (1, 4, 12):
        assert_same(computed(sweep, values), whole)


def test_two_parameters_of_which_one_changes_the_maps_are_those_of_fine_runge_kutta_steps():
    where = (
        "sweep.count=3",
        "second_sweep={parameter='mesh_frequency', values=[0.8, 0.3]}",
        "outputs.exponents=true",
    )
    exact = simulation(*where, "integration={method='flow_map'}", *SHORT[1:3])
    arrays = computed(exact)
    assert_same(computed(exact, 1), arrays)
    fine = computed(simulation(*where, "integration.steps_per_period=1600"))
    for name in ("end_state", "section_delta_5", "lyapunov_exponents"):
        assert np.abs(arrays[name] - fine[name]).max() < 1e-7


def test_blocks_need_not_hold_whole_values_where_nothing_is_carried():
    sweep = unlabelled(*RANDOM)
    odd = [(first, min(first + 7, 39)) for first in range(0, 39, 7)]
    assert_same(joined(sweep, computed_blocks(sweep, odd)), computed(sweep))


@pytest.mark.parametrize("threads", [1, 3, 64])
def test_blocks_feed_every_thread_and_carried_ones_hold_whole_steps(threads):
    assert block_lanes(unlabelled(*RANDOM), threads) >= 32 * threads
    carried = block_lanes(unlabelled(*RANDOM, "start.carry=both"), threads)
    assert carried >= 32 * threads
    assert carried % 6 == 0
    # If more lanes are side by side than a block holds, a step is divided.
    many = unlabelled(*RANDOM, "start.carry=both", "start.count=5000")
    assert many.lanes.side_by_side == 10_000
    assert block_lanes(many, 1) < 5000


def test_all_lines_of_a_carried_sweep_are_computed_side_by_side():
    sweep = unlabelled(*TWO, *RANDOM, "start.carry=both")
    assert sweep.lanes.shape == (3, 4, 3, 2)
    assert sweep.lanes.side_by_side == 18
    places = sweep.lanes.computed_at(np.arange(72))
    assert np.array_equal(np.sort(places), np.arange(72))
    line, value, start, direction = np.unravel_index(places.reshape(4, 2, 3, 3), (3, 4, 3, 2))
    step, way, *others = np.indices((4, 2, 3, 3))
    assert np.array_equal(direction, way)
    assert np.array_equal(value, np.where(way == 0, step, 3 - step))
    assert np.array_equal([line, start], others)


def test_every_array_of_a_block_is_a_variable_of_the_sweep():
    sweep = simulation(*RANDOM)
    arrays = compute_block(sweep, (3, 10), NO_ENDS)
    assert {name: array.shape[0] for name, array in arrays.items()} == dict.fromkeys(arrays, 7)
    axes = tuple(axis.name for axis in sweep.lanes.axes)
    assert {*arrays} == {v.name for v in variables_of(sweep) if v.dims[: len(axes)] == axes}
    without = compute_block(unlabelled("outputs.lyapunov=false"), (0, 2), NO_ENDS)
    assert not [name for name in without if "lyapunov" in name]


def test_all_exponents_come_with_the_sum_that_the_damping_gives():
    sweep = unlabelled("outputs.exponents=true", "integration.steps_per_period=800")
    arrays = compute_block(sweep, (0, 3), NO_ENDS)
    assert arrays["lyapunov_exponents"].shape == (3, len(sweep.lanes.states))
    total = arrays["lyapunov_exponents"].sum(axis=1)
    assert np.allclose(total, arrays["lyapunov_sum"], rtol=0.0, atol=1e-6)


def test_a_mesh_stiffness_below_zero_is_noted():
    assert unlabelled().notes == ()
    (note,) = unlabelled("groups.stiffness_variation_scale=9").notes
    assert "the mesh stiffness falls to -0.034 of its mean" in note
    without = 'scene.effects=["pitch_error", "backlash"]'
    assert unlabelled(without).notes == ()


TWO = ('second_sweep={parameter="mesh_frequency", values=[0.8, 0.9, 1.0]}', "sweep.count=4")


@pytest.mark.parametrize("overrides", [(), RANDOM, ("start.carry=downwards", *RANDOM)])
def test_a_line_of_two_parameters_is_the_sweep_of_that_line_bit_for_bit(overrides):
    both = unlabelled(*TWO, *overrides)
    assert both.lanes.shape[:2] == (3, 4)
    whole = computed(both, 5)
    line = len(both.lanes) // 3
    for number, frequency in enumerate((0.8, 0.9, 1.0)):
        one = unlabelled(TWO[1], f"groups.mesh_frequency={frequency}", *overrides)
        if "random" in str(overrides):
            # Random starts depend on the number of the lane, which differs here.
            starts = both.lanes.start_of(np.arange(number * line, (number + 1) * line))
            one.lanes.start_of = lambda lanes, _system, starts=starts: starts[lanes].copy()
        mine = {name: array[number * line : (number + 1) * line] for name, array in whole.items()}
        assert_same(mine, computed(one))


def test_two_parameters_give_every_lane_its_own_pair_of_values():
    sweep = unlabelled(*TWO, *RANDOM)
    lanes = np.arange(len(sweep.lanes))
    values = sweep.lanes.values_of(lanes)
    assert sweep.lanes.shape == (3, 4, 3)
    assert values["mesh_frequency"].reshape(3, 4, 3)[:, 0, 0].tolist() == [0.8, 0.9, 1.0]
    assert values["pitch_error"].reshape(3, 4, 3)[1, :, 2].tolist() == [0.0, 5.0, 10.0, 15.0]
    system = sweep.lanes.system_of(lanes)
    assert np.array_equal(system.groups.mesh_frequency, values["mesh_frequency"])
    assert len(np.unique(system.groups.error_amplitude)) == 4


def test_parameters_run_along_the_axes_on_which_they_depend():
    speeds = 'second_sweep={parameter="half_backlash", values=[0.8, 0.9]}'
    parameters = unlabelled(speeds).lanes.parameters
    assert parameters["half_backlash"].dims == ("half_backlash",)
    assert parameters["pitch_error"].dims == ("pitch_error",)
    assert parameters["pitch_error"].values.shape == (13,)
    assert parameters["load"].dims == ()
    assert parameters["stiffness_sine"].dims == ("harmonic",)
