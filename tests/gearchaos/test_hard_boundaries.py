"""Boundaries of the pair of Pan 2021 where they are hard to follow."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.dynamics import boundary_following, boundary_tests
from gearchaos.engine.bounding import coarse_map, find_boundaries
from gearchaos.records.boundary import (
    CORNER,
    GRAZING_FLIP,
    GRAZING_FOLD,
    GRAZING_NEIMARK_SACKER,
    STRONG_RESONANCE_11,
)
from gearchaos.records.branch import EDGE, FOLD, GRAZING, LOST, NEIMARK_SACKER, PERIOD_DOUBLING

MAP = Path(__file__).parents[2] / "sweeps" / "speed_and_error.toml"


@cache
def boundaries():
    """Return all boundaries of the map."""
    return find_boundaries(coarse_map(gearchaos.load_config(MAP))).boundaries


def curves(kind):
    """Return the boundaries of a kind over the whole map."""
    return [one for one in boundaries() if one.kind == kind]


def places(curve, kind):
    """Return speed and pitch error of the points of codimension 2 of a kind."""
    return np.array([one.values for one in curve.points if one.kind == kind]).reshape(-1, 2)


def second_compound(matrix):
    """Return the matrix of the 2 x 2 minors; its eigenvalues are products of two eigenvalues."""
    first, second = np.triu_indices(len(matrix), 1)
    rows = matrix[first], matrix[second]
    return rows[0][:, first] * rows[1][:, second] - rows[0][:, second] * rows[1][:, first]


def test_the_test_of_a_pair_is_a_polynomial_of_the_matrix():
    matrices = np.random.default_rng(5).normal(size=(20, 6, 6)) / 3.0
    references = [boundary_tests.Reference()] * len(matrices)
    values = boundary_tests.tests_of(NEIMARK_SACKER, matrices, references)
    exact = [np.linalg.det(second_compound(one) - np.eye(15)) for one in matrices]
    np.testing.assert_allclose(values, exact, rtol=1e-9, atol=1e-13)


def resonances(kind):
    """Return speed and pitch error of the 1:1 resonances on all curves of a kind."""
    return np.concatenate([places(one, STRONG_RESONANCE_11) for one in curves(kind)])


def test_every_curve_ends_for_a_reason():
    assert len(boundaries()) == 17
    assert not any(LOST in one.ends for one in boundaries())


def test_curves_do_not_depend_on_how_far_ahead_points_are_searched(monkeypatch):
    # Two grazing curves come close to each other; longer steps could jump between them.
    monkeypatch.setattr(boundary_following, "MOST_AHEAD", 4)
    found = find_boundaries(coarse_map(gearchaos.load_config(MAP))).boundaries
    assert [(one.kind, one.ends) for one in found] == [(one.kind, one.ends) for one in boundaries()]
    for one, other in zip(found, boundaries(), strict=True):
        ends = [curve.values[[0, -1]] for curve in (one, other)]
        np.testing.assert_allclose(*ends, rtol=0, atol=1e-5)


def test_curves_of_pairs_end_at_the_resonances_of_folds():
    of_folds = resonances(FOLD)
    for place in resonances(NEIMARK_SACKER):
        assert np.min(np.abs(of_folds - place).max(axis=1)) < 2e-8


def test_a_curve_turns_sharply_between_two_resonances():
    # The radius of curvature is 2e-5 there, relative to the ranges and the scales of the states.
    turn, width = np.array([0.6130438, 7.4199]), np.array([1e-5, 1e-3])
    near = [(np.abs(one.values - turn) < width).all(axis=1) for one in curves(NEIMARK_SACKER)]
    (number,) = [at for at, some in enumerate(near) if some.any()]
    assert np.flatnonzero(near[number])[0] > 0
    assert np.flatnonzero(near[number])[-1] < near[number].size - 1
    assert curves(NEIMARK_SACKER)[number].ends == (STRONG_RESONANCE_11, STRONG_RESONANCE_11)


def test_a_resonance_next_to_a_third_multiplier_is_located():
    place = np.array([0.8395176889, 2.4458479347])
    (point,) = [
        point
        for one in curves(NEIMARK_SACKER)
        for point in one.points
        if np.abs(point.values - place).max() < 1e-6
    ]
    np.testing.assert_allclose(point.values, place, rtol=0, atol=1e-8)
    np.testing.assert_allclose(point.multipliers[:2], 1.0, rtol=0, atol=1e-3)
    assert point.multipliers[2] == pytest.approx(0.995735, abs=1e-4)


def test_a_curve_that_reaches_a_grazing_says_so_where_maps_need_shorter_steps():
    (curve,) = [one for one in curves(PERIOD_DOUBLING) if {*one.ends} == {CORNER, EDGE}]
    end = curve.values[0 if curve.ends[0] == CORNER else -1]
    meetings = [places(one, GRAZING_FLIP) for one in curves(GRAZING)]
    away = np.abs(np.concatenate(meetings) - end).max(axis=1)
    # Near a grazing, where maps have a square root, the last 40 points cover less than 0.001.
    assert away.min() < 1e-5


@pytest.mark.parametrize(
    ("kind", "meeting", "place"),
    [
        # From an independent integration, on one side of the grazing only.
        (NEIMARK_SACKER, GRAZING_NEIMARK_SACKER, (0.723330489, 13.695652174)),
        (PERIOD_DOUBLING, GRAZING_FLIP, (0.70654297, 13.43810898)),
    ],
)
def test_a_curve_between_two_points_of_a_grazing_is_found(kind, meeting, place):
    (curve,) = [one for one in curves(kind) if one.ends == (CORNER, CORNER)]
    meetings = np.concatenate([places(one, meeting) for one in curves(GRAZING)])
    for end in curve.values[[0, -1]]:
        assert np.abs(meetings - end).max(axis=1).min() < 1e-4
    # Its points are so close that the lines between them are accurate.
    line = curve.values
    step, away = np.diff(line, axis=0), np.array(place) - line[:-1]
    share = np.clip(np.sum(away * step, axis=1) / np.sum(step**2, axis=1), 0.0, 1.0)
    beside = np.abs(away - share[:, np.newaxis] * step)
    assert (beside / (1.5, 15.0)).max(axis=1).min() < 1e-3


def test_a_fold_goes_on_behind_a_grazing_where_it_is_started_on_both_sides():
    (meeting,) = np.concatenate([places(one, GRAZING_FOLD) for one in curves(GRAZING)])
    (curve,) = [one for one in curves(FOLD) if one.values[:, 0].min() < meeting[0]]
    assert curve.ends == (EDGE, EDGE)
    assert np.abs(curve.values - meeting).max(axis=1).min() < 2e-3
