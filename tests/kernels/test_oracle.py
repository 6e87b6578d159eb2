"""Stored solutions of Pan 2021: every run and every periodic orbit, within what the step gives."""

import numpy as np
import pytest
from gearchaos_kernels import Effects, Groups

from gearchaos.records.lyapunov import largest_exponent

from .reference import (
    LINEAR,
    PERIOD,
    SOLUTIONS,
    pan2021,
    run,
    stored_state,
)

RUNS = SOLUTIONS["runs"]
ORBITS = SOLUTIONS["periodic_orbits"]
EXACT = 1e-10
"""What the stored solutions themselves are believed to."""


def scene_of(solution: dict) -> Effects:
    return Effects(**{effect: effect in solution["effects"] for effect in Effects._fields})


def name_of(solution: dict) -> str:
    form = solution.get("formulation", "orbit")
    return f"{solution['scene']}-{form}-{solution['pitch_error']}"


def tolerance(solution: dict, steps: int) -> float:
    """Global error of plain RK4: O(h^4) within a branch, O(h^2) with clearance crossings."""
    h = 2.0 * np.pi / steps
    if "backlash" not in solution["effects"]:
        return 0.5 * h**4 + EXACT
    # From P = 10 on neighbouring motions separate before they settle.
    return (1.5 if solution["pitch_error"] > 10.0 else 0.6) * h**2


def error(solution: dict, model: Groups, steps: int) -> float:
    # 20 periods of the chaotic transient at P = 12.97 amplify every error a thousandfold.
    kept = 2 if solution["pitch_error"] == 12.97 else len(solution["periods"])
    periods = np.array(solution["periods"][:kept])
    outcome = run(
        model,
        scene_of(solution),
        stored_state(solution["start"]),
        steps=steps,
        periods=periods[-1],
        rederived=solution["formulation"] == "rederived",
    )
    wanted = np.stack([stored_state(values) for values in solution["state"][:kept]])
    return float(np.max(np.abs(outcome.section[0, periods - 1] - wanted)))


@pytest.mark.parametrize("steps", [200, 400, 800, 1600])
@pytest.mark.parametrize("solution", RUNS, ids=name_of)
def test_run_ends_where_the_stored_solution_ends(solution, steps):
    found = error(solution, pan2021(solution["pitch_error"]), steps)
    assert found < tolerance(solution, steps)


# Groups that act on a run, with the share of their value by which the run below must notice them:
# the damping of the bearings is hardly felt.
WRONG_BY = {
    name: 0.1 if "axial_damping" in name or "transverse_damping" in name else 1e-3
    for name in Groups._fields
    if name not in ("error_mean", "error_phase")
}


@pytest.mark.parametrize("group", WRONG_BY)
def test_a_group_wrong_by_a_thousandth_is_noticed_in_the_full_scene(group):
    solution = next(s for s in RUNS if name_of(s) == "full-published-5.86")
    right = pan2021(solution["pitch_error"])
    wrong = right._replace(**{group: getattr(right, group) * (1.0 + WRONG_BY[group])})
    assert error(solution, wrong, 3200) > 2.0 * tolerance(solution, 3200)


@pytest.mark.parametrize("group", sorted({*WRONG_BY} - {"half_backlash"}))
def test_a_group_wrong_by_a_millionth_is_noticed_where_nothing_is_crossed(group):
    solution = next(s for s in RUNS if s["scene"] == "no_backlash")
    right = pan2021(solution["pitch_error"])
    wrong = right._replace(**{group: getattr(right, group) * (1.0 + 1e-3 * WRONG_BY[group])})
    assert error(solution, wrong, 1600) > 5.0 * tolerance(solution, 1600)


def test_the_wrong_formulation_is_noticed():
    for solution in RUNS:
        if "pitch_error" not in solution["effects"] or solution["pitch_error"] == 0.0:
            continue
        flipped = {"published": "rederived", "rederived": "published"}[solution["formulation"]]
        other = {**solution, "formulation": flipped}
        assert error(other, pan2021(solution["pitch_error"]), 800) > 0.01


def test_a_full_run_without_pitch_error_is_a_run_of_the_scene_without_it():
    without = next(s for s in RUNS if s["scene"] == "no_pitch_error")
    zero = next(s for s in RUNS if s["scene"] == "full" and s["pitch_error"] == 0.0)
    steps = {"steps": 144, "periods": 3}
    absent = run(pan2021(9.0), scene_of(without), stored_state(without["start"]), **steps)
    present = run(pan2021(0.0), scene_of(zero), stored_state(zero["start"]), **steps)
    assert absent.section == pytest.approx(present.section, rel=0, abs=1e-12)


def orbit_scene(orbit: dict) -> Effects:
    return {"full": Effects(), "no_axial": Effects(axial=False)}[orbit["scene"]]


def orbit_tolerance(orbit: dict, steps: int) -> float:
    h = 2.0 * np.pi / steps
    if orbit["crossings"] == 0:
        return 0.03 * h**4 + EXACT
    return (1.0 if orbit["pitch_error"] > 10.0 else 0.2) * h**2


@pytest.mark.parametrize("steps", [200, 400, 800, 1600])
@pytest.mark.parametrize("orbit", ORBITS, ids=name_of)
def test_periodic_orbit_returns_to_its_section_points(orbit, steps):
    points = np.stack([stored_state(values) for values in orbit["section_points"]])
    outcome = run(
        pan2021(orbit["pitch_error"]),
        orbit_scene(orbit),
        points[0],
        steps=steps,
        periods=2 * orbit["period"],
    )
    once_around = np.concatenate([points[1:], points[:1]])
    distance = np.abs(outcome.section[0] - np.tile(once_around, (2, 1)))
    assert np.max(distance) < orbit_tolerance(orbit, steps)


@pytest.mark.parametrize("orbit", ORBITS, ids=name_of)
def test_exponent_of_a_periodic_orbit_is_that_of_its_floquet_multipliers(orbit):
    start = stored_state(orbit["section_points"][0])
    outcome = run(
        pan2021(orbit["pitch_error"]),
        orbit_scene(orbit),
        start,
        steps=800,
        transient=600,
        periods=600,
        points=1,
    )
    exponent, standard_error = largest_exponent(outcome.growth, np.array([PERIOD]))
    # With the axial pair its bearing is the slowest: no crossing acts on it.
    crossed = orbit["scene"] == "no_axial" and orbit["period"] > 1
    assert exponent[0] == pytest.approx(
        orbit["largest_exponent"], rel=0, abs=8e-5 if crossed else 5e-7
    )
    assert standard_error[0] < 5e-4


def test_exponent_of_the_linear_scene_is_the_largest_stored_real_part():
    outcome = run(pan2021(5.86), LINEAR, steps=200, transient=1500, periods=500, points=1)
    exponent, _ = largest_exponent(outcome.growth, np.array([PERIOD]))
    largest = max(real for real, _ in SOLUTIONS["linear_scene_eigenvalues"])
    assert exponent[0] == pytest.approx(largest, rel=0, abs=2e-7)
