"""The 0-1 test for chaos: known maps, and the command that compares it with labels."""

import json

import numpy as np
import pytest

from gearchaos.outputs.variable import coordinate
from gearchaos.records.label import MOTION_MEANINGS
from gearchaos.records.zero_one import FEWEST, zero_one
from gearchaos.results.reading.opinions import Opinions
from gearchaos.results.reading.result import Result
from gearchaos.stages import main

from .listed_variables import sweep_variables

POINTS = 500
RATES = {2.5: 1, 3.2: 2, 3.5: 4, 3.83: 3, 3.97: 0, 4.0: 0}
"""Rates of the logistic map, with the period of the motion, 0 for chaos."""


def logistic(rate: float, points: int = POINTS) -> np.ndarray:
    values = [0.3]
    for _ in range(1000 + points):
        values.append(rate * values[-1] * (1.0 - values[-1]))
    return np.array(values[-points:])


@pytest.mark.parametrize(("rate", "period"), RATES.items())
def test_the_logistic_map_is_regular_or_chaotic(rate, period):
    for scale, shift in ((1.0, 0.0), (-250.0, 1e5)):
        found = zero_one(scale * logistic(rate) + shift)
        assert abs(found) < 0.1 if period else found > 0.95


def test_a_torus_is_regular():
    turns = np.sqrt(2.0) * np.arange(POINTS)
    assert abs(zero_one(np.cos(turns) + 0.3 * np.sin(2.0 * turns))) < 0.1


def test_short_and_incomplete_series_have_no_value():
    assert np.isnan(zero_one(logistic(4.0, FEWEST - 1)))
    assert np.isfinite(zero_one(logistic(4.0, FEWEST)))
    assert np.isnan(zero_one(np.append(logistic(4.0), np.nan)))


def between(points, repeats):
    """Return points with other points between them, (points * repeats,)."""
    shifts = np.arange(1.0 - repeats, 1.0)
    return (points[:, np.newaxis] + shifts).ravel()


def saved(folder, points: int = POINTS, repeats: int = 1):
    """Save a sweep of the logistic map whose lane at rate 3.5 is labelled chaotic.

    ``repeats``: number of different section points in each period of the excitation.
    """
    rates, periods = np.array([*RATES]), np.array([*RATES.values()])
    chaotic = MOTION_MEANINGS.index("chaotic")
    wrong = np.where(rates == 3.5, 0, periods)
    variables = sweep_variables(
        [coordinate("load", "1", "rate", "$r$", rates)],
        states=("delta_5",),
        section=("delta_5",),
        section_points=points,
        lyapunov=False,
        status_meanings=("ok", "diverged"),
        motion_meanings=MOTION_MEANINGS,
    )
    nothing = np.zeros((rates.size, 1))
    data = {
        "section_delta_5": [between(logistic(rate, points // repeats), repeats) for rate in rates],
        "motion": np.where(wrong, 0, chaotic),
        "period": wrong,
        "bands": 0 * wrong,
        "return_distance": 0.0 * rates,
        "status": 0 * wrong,
        "diverged_period": 0 * wrong - 1,
        "start_state": nothing,
        "end_state": nothing,
    }
    metadata = {"title": "logistic", "excitation_period": repeats}
    Result(["load"], variables, data, {}, metadata).save(folder / "map.h5")
    return str(folder / "map.h5")


def test_the_command_lists_lanes_that_contradict_their_label(tmp_path, capsys):
    path = saved(tmp_path)
    assert main([path, "--zero-one"]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = lines.index("0-1 test: of 6 lanes 1 contradict their label")
    assert lines[at + 1].startswith("    3.5: chaotic, K = ")
    assert main([path, "--zero-one", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["zero_one"]
    assert [one["value"] for one in found] == [*RATES]
    assert [one["K"] for one in found] == [zero_one(logistic(rate)) for rate in RATES]
    assert main([path]) == 0
    assert "0-1" not in capsys.readouterr().out


def test_points_within_a_period_of_the_excitation_are_no_chaos(tmp_path, capsys):
    path = saved(tmp_path, 12 * POINTS, 12)
    assert main([path, "--zero-one", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["zero_one"]
    expected = [zero_one(logistic(rate, POINTS)) for rate in RATES]
    assert [one["K"] for one in found] == pytest.approx(expected, abs=1e-9)
    (tmp_path / "short").mkdir()
    assert main([saved(tmp_path / "short", 1188, 12), "--zero-one"]) == 0
    assert "no section has 1200 points, 100 periods of the excit" in capsys.readouterr().out


def test_a_motion_that_grows_has_no_second_opinion():
    found = Opinions(np.zeros(2), np.array(["grows", "period 1"]), np.array([0.9, 0.9]))
    assert found.contradict.tolist() == [False, True]


def test_short_sections_are_reported(tmp_path, capsys):
    assert main([saved(tmp_path, 20), "--zero-one"]) == 0
    assert "no section has 100 points; raise outputs.section_points" in capsys.readouterr().out
