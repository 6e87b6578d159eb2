"""Two points of codimension 2 between the same two points of a boundary are both found."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gearchaos_kernels import Plan

import gearchaos
from gearchaos.dynamics.boundaries import completed
from gearchaos.dynamics.boundary_equations import Equations
from gearchaos.dynamics.boundary_following import Path as Followed
from gearchaos.dynamics.boundary_following import following
from gearchaos.dynamics.boundary_passages import passed_of
from gearchaos.dynamics.side_by_side import run
from gearchaos.engine.bounding import coarse_map, find_boundaries
from gearchaos.engine.running import one_thread
from gearchaos.models.registry import system_of
from gearchaos.records.boundary import STRONG_RESONANCE_11
from gearchaos.records.branch import FOLD

MAP = Path(__file__).parents[2] / "sweeps" / "speed_and_error.toml"
NAMES = "mesh_frequency", "pitch_error"
LIMITS = np.array([[0.8, 1.0], [0.85, 3.0]])
RESONANCES = np.array([[0.83951769, 2.44584793], [0.83129762, 2.63652586]])
"""Points where two multipliers of the fold are 1, from a search with shorter steps."""


@cache
def fold():
    """Return the equations of a fold and the path along the fold."""
    sweeps = [
        f"{table}={{parameter='{name}', from={low}, to={high}, count=9}}"
        for table, name, (low, high) in zip(("sweep", "second_sweep"), NAMES, LIMITS.T, strict=True)
    ]
    config = gearchaos.load_config(
        MAP, [*sweeps, "integration.transient_periods=300", "integration.recorded_periods=40"]
    )
    result = coarse_map(config)
    curves = find_boundaries(result, lines=1).boundaries
    (curve,) = [
        one
        for one in curves
        if one.kind == FOLD and np.ptp(one.values, axis=0)[1] > 0.5 and one.values[:, 1].max() > 2.0
    ]
    scale = np.abs(result.lanes("end_state")).max(axis=0)

    def system_at(shares):
        values = (LIMITS[0] + shares * (LIMITS[1] - LIMITS[0])).T
        return system_of(config, dict(zip(NAMES, values, strict=True)), config.needed_effects)

    plan = Plan(12, 0, 1, 1, tangent=True, method="flow_map")
    equations = Equations(system_at, plan, 1, scale, FOLD)
    middle = curve.arclength.size // 2
    shares = (curve.values[middle] - LIMITS[0]) / (LIMITS[1] - LIMITS[0])
    guess = np.concatenate([curve.section[middle, -1] / scale, shares])
    with one_thread():
        start = equations.begun(guess, np.eye(guess.size)[-1])
        (path,) = run(following(equations, [start]), passed_of)
    return equations, path


def located(path):
    """Return kinds and parameters of the points of codimension 2 along a path."""
    equations, _ = fold()
    with one_thread():
        found = run(completed(equations, path), passed_of).located
    shares = np.array([one.point.shares for one in found])
    return [one.kind for one in found], LIMITS[0] + shares * (LIMITS[1] - LIMITS[0])


@pytest.mark.parametrize("every", (1, 2))
def test_two_resonances_between_the_same_points_are_both_found(every):
    _, path = fold()
    kinds, values = located(path)
    assert kinds == [STRONG_RESONANCE_11] * 2
    values = values[np.argsort(-values[:, 0])]
    assert values == pytest.approx(RESONANCES, abs=1e-7)
    error = np.array([LIMITS[0, 1] + one.shares[1] * np.ptp(LIMITS[:, 1]) for one in path.points])
    between = np.flatnonzero((error > RESONANCES[0, 1]) & (error < RESONANCES[1, 1]))
    before, after = path.points[: between[0]], path.points[between[-1] + 1 :]
    kinds, parted = located(Followed([*before[::-every][::-1], *after[::every]], path.ends))
    assert kinds == [STRONG_RESONANCE_11] * 2
    assert parted[np.argsort(-parted[:, 0])] == pytest.approx(RESONANCES, abs=1e-7)
