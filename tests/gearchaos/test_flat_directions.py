"""A search finds the directions that observations leave open, within its candidates."""

import re
from contextlib import suppress

import numpy as np
import pytest

from gearchaos.identification.flat_directions import ALONG, ONE_UNIT, directions_at
from gearchaos.identification.loading import load_targets
from gearchaos.identification.observations import misfit
from gearchaos.identification.search import DRAWN, STEPS_ALONE, budget_of, judge, proposals
from gearchaos.identification.targets import Search
from gearchaos.identification.tried import read_tried

from .test_identify import command

TRUTH = np.array([0.45, 0.4, 0.55])
FREE = np.array([1.0, 0.7, -0.7]) / np.sqrt(1.98)
"""A direction along which the residuals of `sums` do not change."""

WIDTHS = 40.0


def sums(points):
    """Return two residuals that are linear in three parameters and do not change along FREE."""
    across = np.linalg.svd(FREE[np.newaxis])[2][1:]
    return WIDTHS * (points - TRUTH) @ across.T


def each(points):
    """Return residuals that determine every parameter."""
    return WIDTHS * (points - TRUTH)


def searched(residuals, **settings):
    """Return run, points and misfits of all candidates of a search with these residuals."""
    asking = proposals(Search(**settings), TRUTH.size)
    asked, every = next(asking), []
    while True:
        run, points = asked
        found = residuals(points)
        every.append((np.full(len(points), run), points, misfit(found)))
        try:
            asked = asking.send(np.column_stack([every[-1][2], found]))
        except StopIteration:
            return [np.concatenate(part) for part in zip(*every, strict=True)]


def alike(residuals, **settings):
    _, points, misfits = searched(residuals, **settings)
    return points[misfits <= np.min(misfits) + ONE_UNIT]


@pytest.mark.parametrize("seed", range(12))
def test_one_parameter_alone_is_found(seed):
    asking = proposals(Search(candidates=200, drawn=20, runs=2, population=10, seed=seed), 1)
    (_, points), best = next(asking), np.inf
    with suppress(StopIteration):
        while True:
            residual = WIDTHS * (points - 0.4)
            best = min(best, float(np.abs(points - 0.4).min()))
            _, points = asking.send(np.column_stack([misfit(residual), residual]))
    assert best < 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_sets_that_fit_equally_are_found_from_bound_to_bound(seed):
    found = alike(sums, candidates=500, drawn=100, runs=2, population=20, seed=seed)
    # From the truth along FREE, until one parameter reaches a bound.
    ways = np.concatenate([-TRUTH / FREE, (1.0 - TRUTH) / FREE])
    ends = TRUTH + np.outer([np.max(ways[ways < 0]), np.min(ways[ways > 0])], FREE)
    # A walk ends before the bound when its smallest step would be too far.
    assert np.all(np.ptp(found, axis=0) > 0.8 * np.ptp(ends, axis=0))


@pytest.mark.parametrize("seed", range(4))
def test_what_is_determined_stays_narrow(seed):
    found = alike(each, candidates=500, drawn=100, runs=2, population=20, seed=seed)
    # One unit of misfit is 2 (sqrt(1 + r^2) - 1) = 1; the best candidate is not the truth itself.
    reach = np.sqrt(1.5**2 - 1.0) / WIDTHS
    assert np.all(np.ptp(found, axis=0) < 2.5 * reach)


@pytest.mark.parametrize("candidates", [60, 61, 100, 250, 500, 3000])
@pytest.mark.parametrize("residuals", [sums, each])
def test_a_search_tries_no_more_candidates_than_it_is_granted(candidates, residuals):
    settings = {"candidates": candidates, "drawn": 60, "population": 10}
    run, _, _ = searched(residuals, **settings)
    assert run.size <= candidates
    assert (run == DRAWN).sum() == 60
    part = budget_of(Search(**settings), 3)
    assert part.bred + part.last == candidates - 60
    moved = (run == STEPS_ALONE).sum()
    # The steps are made at least once if the candidates suffice for four per direction.
    assert moved >= 1 + 6 * part.rungs if part.looked else moved == 0
    assert part.looked == (candidates >= 250)
    if residuals is sums and part.looked:
        assert (run == ALONG).any()


def test_directions_of_linear_residuals_are_their_singular_vectors():
    rng = np.random.default_rng(2)
    points, slopes = rng.random((200, 3)), rng.standard_normal((5, 3)) * [[3.0, 20.0, 60.0]]
    residuals = (points - TRUTH) @ slopes.T
    answers = np.column_stack([misfit(residuals), residuals])
    found = directions_at(points[np.argmin(answers[:, 0])], points, answers)
    sizes = np.linalg.svd(slopes, compute_uv=False)
    assert found.ways == pytest.approx(1.0 / sizes[::-1])
    covariance = np.linalg.inv(slopes.T @ slopes)
    assert found.reach == pytest.approx(np.sqrt(np.diag(covariance)))
    for vector, way in zip(found.vectors, found.ways, strict=True):
        assert np.linalg.norm(slopes @ vector) == pytest.approx(1.0 / way)


def test_a_direction_that_no_observation_sees_is_flat_where_they_are_fewer():
    points = np.random.default_rng(3).random((200, 3))
    residuals = sums(points)[:, :1]
    answers = np.column_stack([misfit(residuals), residuals])
    found = directions_at(points[0], points, answers)
    assert np.all(found.ways[:2] > 100.0) and found.ways[2] == pytest.approx(1.0 / WIDTHS)


PAIR = """\
[groups]
mesh_frequency = 0.5
damping_ratio = 0.05
base_helix_angle_deg = 0.0
load = 0.1
half_backlash = 0.2
pitch_error_amplitude = 0.3
stiffness_cosine = [0.1]

[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]

[sweep]
parameter = "mesh_frequency"
values = [0.5, 1.5]

[integration]
steps_per_period = 60
transient_periods = 60
recorded_periods = 64
"""

SCALED = (
    """\
configuration = "pair.toml"

[search]
seed = 2
candidates = 400
drawn = 100
runs = 2
population = 16
"""
    + "".join(
        f'[[parameter]]\nname = "{name}"\nlow = 0.05\nhigh = {high}\nlogarithmic = true\n'
        for name, high in (("load", 0.5), ("half_backlash", 2.0), ("pitch_error_amplitude", 2.0))
    )
    + "".join(
        f'[[stage]]\nmotion = "period {period}"\nfrom = {low}\nto = {high}\nwidth = 0.05\n'
        for period, low, high in ((1, 0.64, 1.18), (3, 1.2, 1.28), (2, 1.33, 1.77), (1, 1.82, 2.0))
    )
)


def test_three_lengths_of_a_piecewise_linear_pair_are_not_determined(tmp_path):
    (tmp_path / "pair.toml").write_text(PAIR)
    (tmp_path / "targets.toml").write_text(SCALED)
    ended = command(tmp_path, "-q")
    assert ended.code == 0, ended.err
    problem = load_targets(tmp_path / "targets.toml")
    tried, _ = read_tried(tmp_path / "targets.csv", problem)
    assert len(tried) <= 400
    assert ended.out.startswith("4 observations, 3 unknowns\n")
    rows = re.findall(r"^(load|half_backlash|pitch_error_amplitude) (.*)$", ended.out, re.M)
    told = {name: text for name, text in rows if "not determined" in text}
    assert [*told] == ["load", "half_backlash", "pitch_error_amplitude"]
    # The three parameters of the best set, all multiplied by one factor, have the same misfit.
    best = tried["values"][np.argmin(tried["misfit"])]
    factors = 2.0 ** np.arange(-3.0, 4.0)
    scaled = {name: factor * factors for name, factor in zip(told, best, strict=True)}
    assert judge(problem, 0, scaled)["misfit"] == pytest.approx(tried["misfit"].min(), abs=1e-9)
    # The row has the range of the parameter that moves alone, and its range over all fitting sets.
    alone_low, alone_high, low, high = map(float, told["load"].split()[:4])
    assert np.log(high / low) > 3.0 * np.log(alone_high / alone_low)
    assert "flat over" in ended.out


def test_too_few_candidates_to_move_the_best_set_are_reported(tmp_path):
    (tmp_path / "pair.toml").write_text(PAIR)
    (tmp_path / "targets.toml").write_text(SCALED)
    few = ("search.candidates=120", "search.drawn=90")
    ended = command(tmp_path, "-q", *(part for one in few for part in ("--set", one)))
    assert ended.code == 0, ended.err
    assert "too few candidates to move the best set" in ended.out
