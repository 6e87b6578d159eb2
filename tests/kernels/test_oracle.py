"""Runs and periodic orbits of Pan 2021 against stored solutions, within the error of the step.

The allowed distance from a stored solution follows from the runs themselves (Richardson). At order
4, halving the step removes 15/16 of the error, so the error is 16/15 of the change. The next term
of the error, of relative size c, makes this estimate wrong by c/30. It also makes the ratio of two
successive changes differ from 16 by the share 0.52 c. This measured difference is used as the
tolerance of the estimate; it is more than sufficient.
"""

import functools
from typing import NamedTuple

import numpy as np
import pytest
from gearchaos_kernels import Effects, Groups, Outcome

from gearchaos.records.lyapunov import largest_exponent

from .reference import (
    CLEARANCE,
    LINEAR,
    PERIOD,
    SOLUTIONS,
    TORSION_ONLY,
    columns,
    pan2021,
    run,
    state,
    stored_state,
)
from .test_order import measured_order

RUNS = SOLUTIONS["runs"]
ORBITS = SOLUTIONS["periodic_orbits"]
DEFAULT = 200
"""Steps per period, unless a test sets others."""

EXACT = 1e-10
"""Assumed accuracy of the stored solutions."""


def scene_of(solution: dict) -> Effects:
    if "effects" not in solution:
        return Effects(axial=solution["scene"] == "full")
    if solution["scene"] in ("constant_stiffness", "no_pitch_error"):
        return Effects()
    return Effects(**{effect: effect in solution["effects"] for effect in Effects._fields})


def pair_of(solution: dict) -> Groups:
    """Return the pair of a solution; absent effects get zero size, to compile fewer scenes."""
    absent = {
        "constant_stiffness": {"stiffness_variation_scale": 0.0},
        "no_pitch_error": {"error_amplitude": 0.0},
    }
    return pan2021(solution["pitch_error"], **absent.get(solution["scene"], {}))


def name_of(solution: dict) -> str:
    form = solution.get("formulation", "orbit")
    return f"{solution['scene']}-{form}-{solution['pitch_error']}"


def stored(solutions: list[dict]) -> pytest.MarkDecorator:
    """Return the parametrization of a test by stored solutions."""
    numbers = [(RUNS + ORBITS).index(solution) for solution in solutions]
    return pytest.mark.parametrize("number", numbers, ids=map(name_of, solutions))


def follow(solution: dict, steps: int, model: Groups | None = None, **how) -> Outcome:
    """Integrate a run from its start to its end, or an orbit over two of its periods."""
    orbit = "section_points" in solution
    how = {"periods": 2 * solution["period"] if orbit else solution["periods"][-1], **how}
    return run(
        pair_of(solution) if model is None else model,
        scene_of(solution),
        stored_state(solution["section_points"][0] if orbit else solution["start"]),
        steps=steps,
        physical=solution.get("formulation") == "rederived",
        **{"resolved": True, **how},
    )


@functools.cache
def followed(number: int, steps: int) -> Outcome:
    """Return a run or an orbit, integrated with resolved steps."""
    return follow((RUNS + ORBITS)[number], steps)


def states(solution: dict, outcome: Outcome) -> np.ndarray:
    """Return the states of an outcome at the periods that the solution has stored."""
    if "section_points" in solution:
        return outcome.section[0]
    return outcome.section[0, np.array(solution["periods"]) - 1]


def wanted(solution: dict) -> np.ndarray:
    """Return the stored states, in the order of the scene's states."""
    if "section_points" in solution:
        # Each period leads an orbit to its next section point, and from the last one to the first.
        points = solution["section_points"]
        values = 2 * [*points[1:], points[0]]
    else:
        values = solution["state"]
    return np.stack([stored_state(value) for value in values])[:, columns(scene_of(solution))]


class Predicted(NamedTuple):
    """Error predicted from a step, its half and its quarter, and their deviation from order 4."""

    error: float
    missed: float


def predicted(whole: np.ndarray, half: np.ndarray, quarter: np.ndarray) -> Predicted:
    """Estimate the error of the first of three results (Richardson)."""
    first, second = np.abs(whole - half).max(), np.abs(half - quarter).max()
    return Predicted(first * 16.0 / 15.0, abs(first / second / 16.0 - 1.0))


def prediction(number: int, steps: int) -> Predicted:
    solution = (RUNS + ORBITS)[number]
    return predicted(*(states(solution, followed(number, steps * by)) for by in (1, 2, 4)))


def error(solution: dict, outcome: Outcome) -> float:
    return float(np.abs(states(solution, outcome) - wanted(solution)).max())


@stored(RUNS + ORBITS)
def test_the_default_is_as_far_from_the_stored_solution_as_its_step_predicts(number):
    solution = (RUNS + ORBITS)[number]
    found, missed = prediction(number, DEFAULT)
    # The rate of convergence is nearer to 16 than to 8 or 32, the rates of orders 3 and 5.
    assert missed < 0.25
    distance = error(solution, followed(number, DEFAULT))
    assert distance == pytest.approx(found, rel=missed, abs=EXACT)


GRIDS = np.array([200, 238, 283, 336, 400, 476, 566, 673, 800])
"""Steps per period, from the default to four times as many, by factors of 2^(1/4)."""


@stored(RUNS + ORBITS)
def test_states_converge_with_order_four_whatever_is_crossed(number):
    solution = (RUNS + ORBITS)[number]
    errors = [error(solution, followed(number, int(steps))) for steps in GRIDS]
    between = np.diff(np.log(errors)) / -np.diff(np.log(GRIDS))
    # An error A h^4 (1 + c h), with h = 1 at the default, bends the line: its slope between
    # neighbouring grids varies from 4 + 0.92 c to 4 + 0.27 c, and the slope over all grids is
    # 4 + 0.53 c. The deviation from 4 is therefore less than the spread of the slopes. The places
    # of crossings within their steps increase the spread.
    assert measured_order(errors, GRIDS) == pytest.approx(4.0, rel=0, abs=np.ptp(between))
    assert np.ptp(between) < 0.5


@stored([solution for solution in RUNS + ORBITS if scene_of(solution).backlash])
def test_the_clearance_is_crossed_as_often_as_in_the_stored_solution(number):
    # The stored runs were restarted at every crossing of both clearances, in all periods.
    solution = (RUNS + ORBITS)[number]
    turns = 2 if "section_points" in solution else 1
    for steps in GRIDS:
        outcome = followed(number, int(steps))
        assert outcome.crossings.tolist() == [turns * solution["crossings"]]
        assert outcome.overflows.tolist() == [0]


@stored([s for s in RUNS + ORBITS if s["crossings"] == 0 and s["scene"] != "no_axial"])
def test_plain_steps_predict_their_error_where_nothing_is_crossed(number):
    solution = (RUNS + ORBITS)[number]
    outcomes = [follow(solution, DEFAULT * by, resolved=False) for by in (1, 2, 4)]
    found, missed = predicted(*(states(solution, outcome) for outcome in outcomes))
    assert missed < 0.25
    assert error(solution, outcomes[0]) == pytest.approx(found, rel=missed, abs=EXACT)


# Relative error of each group that the run below must detect. It is larger for the damping of the
# bearings, which has little effect.
WRONG_BY = {
    name: 0.1 if "axial_damping" in name or "transverse_damping" in name else 1e-3
    for name in Groups._fields
    # The reference solutions have no mean error, no phase and no friction.
    if name not in ("error_mean", "error_phase", "pitch_point_phase") and "friction" not in name
}


def distance_of_wrong(name: str, group: str, share: float, steps: int) -> float:
    """Return the distance of a run with a wrong group, relative to the predicted error."""
    number = [name_of(solution) for solution in RUNS].index(name)
    right = pan2021(RUNS[number]["pitch_error"])
    wrong = right._replace(**{group: getattr(right, group) * (1.0 + share)})
    distance = error(RUNS[number], follow(RUNS[number], steps, wrong))
    return distance / (prediction(number, steps).error + EXACT)


@pytest.mark.parametrize("group", WRONG_BY)
def test_a_group_wrong_by_a_thousandth_is_noticed_in_the_full_scene(group):
    assert distance_of_wrong("full-published-5.86", group, WRONG_BY[group], 2 * DEFAULT) > 5.0


@pytest.mark.parametrize("group", sorted({*WRONG_BY} - {"half_backlash"}))
def test_a_group_wrong_by_a_millionth_is_noticed_where_nothing_is_crossed(group):
    share = 1e-3 * WRONG_BY[group]
    assert distance_of_wrong("no_backlash-published-5.86", group, share, 1600) > 5.0


def test_the_wrong_formulation_is_noticed():
    for solution in RUNS:
        if "pitch_error" not in solution["effects"] or solution["pitch_error"] == 0.0:
            continue
        flipped = {"published": "rederived", "rederived": "published"}[solution["formulation"]]
        other = {**solution, "formulation": flipped}
        assert error(solution, follow(other, DEFAULT)) > 0.01


def test_effects_of_no_size_are_effects_left_out():
    how = {"start": state(delta_5=3.0), "steps": DEFAULT, "periods": 3, "resolved": True}
    absent = run(pan2021(9.0), CLEARANCE, **how)
    present = run(pan2021(0.0, stiffness_variation_scale=0.0), TORSION_ONLY, **how)
    assert absent.crossings[0] > 0
    assert absent.section == pytest.approx(present.section, rel=0, abs=1e-12)


@stored(ORBITS)
def test_exponent_of_a_periodic_orbit_is_that_of_its_floquet_multipliers(number):
    orbit = (RUNS + ORBITS)[number]
    exponents, chance = [], []
    for by in (1, 2, 4):
        outcome = follow(orbit, DEFAULT * by, transient=600, periods=600, points=1)
        exponent, standard_error = largest_exponent(outcome.growth, np.array([PERIOD]))
        assert standard_error[0] < 5e-4
        # The final length of a rotating vector depends on chance; more periods reduce the effect.
        half, _ = largest_exponent(outcome.growth[:, :300], np.array([PERIOD]))
        exponents.append(exponent)
        chance.append(abs(exponent[0] - half[0]))
    found, _ = predicted(*exponents)
    distance = abs(exponents[0][0] - orbit["largest_exponent"])
    # Chance affects the exponent of the default, and the difference that predicts its error.
    assert distance < found + 3.0 * max(chance) + EXACT
    assert max(chance) < 1e-5


def test_exponent_of_the_linear_scene_is_the_largest_stored_real_part():
    def exponent(steps: int) -> np.ndarray:
        outcome = run(pan2021(5.86), LINEAR, steps=steps, transient=1500, periods=500, points=1)
        return largest_exponent(outcome.growth, np.array([PERIOD]))[0]

    exponents = [exponent(DEFAULT * by) for by in (1, 2, 4)]
    found, missed = predicted(*exponents)
    largest = max(real for real, _ in SOLUTIONS["linear_scene_eigenvalues"])
    assert abs(exponents[0][0] - largest) < (1.0 + missed) * found + EXACT
