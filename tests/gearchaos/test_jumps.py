"""A jump between two branches is found; a bend of one branch is not a jump."""

import json

import numpy as np
import pytest

import gearchaos
from gearchaos.results.reading.jumps import jump_sizes, jumps

from .commands import run_module
from .short_sweeps import PAN2021

VALUES = np.linspace(0.0, 1.0, 41)


def section(*points: np.ndarray, times: int = 3) -> np.ndarray:
    """Return a section with one state of lanes that visit these points in turn."""
    return np.tile(np.stack(points, axis=1), (1, times))[:, :, np.newaxis]


def test_a_step_on_a_smooth_branch_is_a_jump():
    branch = np.sin(VALUES) + 0.3 * (VALUES > 0.5)
    assert np.flatnonzero(jump_sizes(np.full(41, 1), section(branch))).tolist() == [20]
    # The two points of a period-2 orbit may be in either order.
    other = np.cos(VALUES)
    swapped = np.where(VALUES > 0.25, branch, other), np.where(VALUES > 0.25, other, branch)
    assert np.flatnonzero(jump_sizes(np.full(41, 2), section(*swapped))).tolist() == [20]


@pytest.mark.parametrize(
    "branch",
    [
        VALUES**2,
        np.sqrt(VALUES - VALUES[0]),  # Begins at a fold.
        np.sqrt(1.0 - VALUES),  # Ends at a fold.
        np.tanh(30.0 * (VALUES - 0.51)),  # Steep, but resolved.
        np.zeros(41),
        1e-3 * np.random.default_rng(1).normal(size=41),
    ],
)
def test_a_branch_that_bends_does_not_jump(branch):
    assert not jump_sizes(np.full(41, 1), section(branch)).any()


@pytest.mark.parametrize(("times", "found"), [(4.5, []), (5.5, [20])])
def test_a_step_five_times_those_beside_it_is_a_jump(times, found):
    steps = np.full(40, 0.01)
    steps[20] *= times
    branch = np.concatenate([[0.0], np.cumsum(steps)])
    assert np.flatnonzero(jump_sizes(np.full(41, 1), section(branch))).tolist() == found


@pytest.mark.parametrize(("times", "found"), [(4.0, []), (6.0, [0])])
@pytest.mark.parametrize("alone", [0.0, np.nan])
def test_the_outermost_step_is_compared_with_the_one_beside_it(times, found, alone):
    steps = np.full(20, 0.03)
    steps[0] *= times
    branch = 1.0 + np.concatenate([[0.0], np.cumsum(steps)])
    assert np.flatnonzero(jump_sizes(np.full(21, 1), section(branch), 1.0, alone)).tolist() == found


def test_only_motions_of_the_same_period_are_compared():
    branch = np.where(VALUES > 0.5, 1.0, 0.0)
    period = np.where(VALUES > 0.5, 2, 1)
    assert not jump_sizes(period, section(branch)).any()
    assert not jump_sizes(np.zeros(41, int), section(branch)).any()
    # The section has fewer points than the period.
    assert not jump_sizes(np.full(41, 4), section(branch)).any()


@pytest.fixture(scope="module")
def hop():
    return gearchaos.run(
        gearchaos.load_config(PAN2021, ["sweep.from=0.94", "sweep.to=1.12", "sweep.count=19"])
    )


def test_the_hop_of_figure_7_is_a_jump_within_period_1(hop, tmp_path):
    (jump,) = jumps(hop)
    assert (jump.below, jump.above) == pytest.approx((1.04, 1.05))
    hop.save(tmp_path / "hop.h5")
    told = run_module("gearchaos.stages", "hop.h5", cwd=tmp_path)
    assert told.out.splitlines()[3:] == [
        "",
        "1.04 to 1.05: jumps to another motion of period 1",
    ]
    facts = json.loads(run_module("gearchaos.stages", "hop.h5", "--json", cwd=tmp_path).out)
    assert facts["jumps"] == [{"below": jump.below, "above": jump.above, "label": "period 1"}]


@pytest.mark.parametrize(("returns", "found"), [(2e-5, 1), (1e-2, 0)])
def test_a_jump_is_larger_than_what_a_lane_that_converges_may_be_off(hop, returns, found):
    away = np.where(hop["pitch_error"] > 1.045, returns, 0.0)
    data = {name: hop[name] for name in hop.variables} | {"return_distance": away}
    variables = [*hop.variables.values()]
    other = gearchaos.Result(hop.axes, variables, data, hop.parameters, hop.metadata)
    assert len(jumps(other)) == found


def test_neighbours_an_excitation_period_apart_have_not_jumped():
    gear = "pitch_error={kind='teeth', driving={file='inspection.csv', column='driving'}}"
    starts = "start={kind='random', spread=1.0}"
    lengths = ("integration.transient_periods=2100", "integration.recorded_periods=126")
    values = "sweep={parameter='pitch_error', from=107.8, to=108.2, count=9}"
    scene = "scene.effects=['pitch_error', 'stiffness_variation', 'backlash']"
    overrides = [gear, starts, *lengths, values, scene, "outputs.section_points=42"]
    result = gearchaos.run(gearchaos.load_config("sweeps/inspection.toml", overrides))
    assert result["period"].tolist() == [2] * 9
    apart = np.abs(result["section_delta_5"][1:, -1] - result["section_delta_5"][:-1, -1])
    assert apart.max() > 0.02  # starts settle on either half of the orbit
    assert jumps(result) == []
