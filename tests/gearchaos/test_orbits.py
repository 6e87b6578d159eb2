"""Periodic orbits: linear and exact solutions, stored orbits, and motions that are no orbits."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate, jacobian

from gearchaos.dynamics.exponents import sum_of_exponents
from gearchaos.dynamics.orbits import CLOSED, Orbits, polish
from gearchaos.records.period import motion_period

from ..kernels.reference import (
    FULL,
    LINEAR,
    NO_AXIAL,
    PERIOD,
    SOLUTIONS,
    pan2021,
    system_of,
)

SCENES = {"no_axial": NO_AXIAL, "full": FULL}
STORED = {
    name: [orbit for orbit in SOLUTIONS["periodic_orbits"] if orbit["scene"] == name]
    for name in SCENES
}


def of(orbits: list[dict], key: str) -> np.ndarray:
    return np.array([orbit[key] for orbit in orbits])


def first_points(orbits: list[dict]) -> np.ndarray:
    return np.array([orbit["section_points"][0] for orbit in orbits])


def found_orbits(scene, multiples, guess, period, steps=200) -> Orbits:
    period = np.asarray(period, dtype=np.int32)
    return polish(
        system_of(pan2021(multiples), scene), np.asarray(guess), period, Plan(steps, 0, 0, 0)
    )


def polished(name: str, steps: int) -> Orbits:
    """Return the stored orbits, found from points next to them."""
    orbits = STORED[name]
    points = first_points(orbits)
    beside = points * (1.0 + 1e-4 * np.sin(np.arange(points.shape[1])))
    return found_orbits(
        SCENES[name], of(orbits, "pitch_error"), beside, of(orbits, "period"), steps
    )


def settled(scene, multiples, transient=500) -> tuple[np.ndarray, np.ndarray]:
    """Return end states and periods of motions that start at rest."""
    system = system_of(pan2021(multiples), scene)
    plan = Plan(200, transient, 48, 48, tangent=True)
    outcome = integrate(system, np.zeros((system.lanes, len(system.states))), plan)
    return outcome.end_state, motion_period(outcome.section)


def multiplier_errors(name: str, found: Orbits) -> np.ndarray:
    errors = []
    for orbit, multipliers in zip(STORED[name], found.multipliers, strict=True):
        stored = np.array([complex(*pair) for pair in orbit["floquet_multipliers"]])
        between = np.abs(multipliers[:, np.newaxis] - stored)
        errors.append(max(between.min(axis=0).max(), between.min(axis=1).max()))
    return np.array(errors)


def test_multipliers_of_the_linear_scene_are_the_exponentials_of_its_eigenvalues():
    found = found_orbits(LINEAR, 5.86, settled(LINEAR, 5.86, 200)[0], [1], 3200)
    system = system_of(pan2021(5.86), LINEAR)
    in_contact = np.ones((1, system.elements))
    modes = np.linalg.eigvals(jacobian(system, in_contact)[0])
    wanted = np.exp(modes * PERIOD)
    assert found.converged.all()
    assert np.sort_complex(found.multipliers[0]) == pytest.approx(
        np.sort_complex(wanted), rel=0, abs=1e-8
    )


@pytest.mark.parametrize("name", SCENES)
def test_product_of_the_multipliers_is_the_exact_contraction_of_volumes(name):
    found, period = polished(name, 3200), of(STORED[name], "period")
    trace = sum_of_exponents(system_of(pan2021(of(STORED[name], "pitch_error")), SCENES[name]))
    product = np.prod(found.multipliers, axis=1)
    assert product == pytest.approx(np.exp(trace * period * PERIOD), rel=2e-8)


@pytest.mark.parametrize("name", SCENES)
def test_polished_orbits_are_the_stored_ones(name):
    orbits, found = STORED[name], polished(name, 3200)
    period = of(orbits, "period")
    exponent = np.log(np.abs(found.multipliers[:, 0])) / (period * PERIOD)
    assert found.converged.all()
    assert np.all(found.residual <= CLOSED)
    assert found.points == pytest.approx(first_points(orbits), rel=0, abs=1e-9)
    assert np.all(multiplier_errors(name, found) < 1e-8)
    assert exponent == pytest.approx(of(orbits, "largest_exponent"), rel=0, abs=1e-9)
    assert np.all(np.diff(np.abs(found.multipliers), axis=1) <= 0.0)


@pytest.mark.parametrize("name", SCENES)
def test_errors_of_points_and_multipliers_fall_with_the_fourth_power_of_the_step(name):
    steps = np.array([200, 400, 800, 1600])
    found = [polished(name, number) for number in steps]
    points = [np.max(np.abs(one.points - first_points(STORED[name]))) for one in found]
    multipliers = [np.max(multiplier_errors(name, one)) for one in found]
    for errors in (points, multipliers):
        assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(4.0, abs=0.1)


def test_an_orbit_is_closed_to_rounding_wherever_in_the_diagram_a_lane_has_settled():
    multiples = np.linspace(0.5, 11.4, 60)
    guess, period = settled(NO_AXIAL, multiples)
    found = found_orbits(NO_AXIAL, multiples, guess, period)
    assert np.all(period > 0)
    assert found.converged.all()
    assert found.points == pytest.approx(guess, rel=0, abs=1e-4)
    assert np.all(np.abs(found.multipliers) < 1.0)


@pytest.mark.parametrize("wanted", [2, 3, 4])
def test_an_orbit_of_a_divisor_of_the_period_is_not_taken_for_one_of_the_period(wanted):
    orbit = STORED["no_axial"][1]
    assert orbit["period"] == 1
    found = found_orbits(NO_AXIAL, orbit["pitch_error"], first_points([orbit]), [wanted])
    assert found.residual[0] <= CLOSED
    assert_nothing_found(found)


def test_a_slow_transient_that_alternates_is_no_orbit_of_period_two():
    # Just below the period doubling the motion still alternates after 600 periods.
    guess, period = settled(NO_AXIAL, 10.257, 600)
    assert period[0] == 2
    assert_nothing_found(found_orbits(NO_AXIAL, 10.257, guess, [2]))
    single = found_orbits(NO_AXIAL, 10.257, guess, [1])
    assert single.converged[0]
    assert -1.0 < single.multipliers[0, 0].real < -0.99


def test_an_orbit_away_from_the_guess_is_not_taken():
    orbit = STORED["no_axial"][1]
    for factor in (0.5, 0.8, 1.3):
        guess = factor * first_points([orbit])
        assert_nothing_found(found_orbits(NO_AXIAL, orbit["pitch_error"], guess, [1]))


def test_where_no_period_is_given_there_is_no_orbit():
    orbits = STORED["no_axial"]
    period = of(orbits, "period")
    period[1] = 0
    found = found_orbits(NO_AXIAL, of(orbits, "pitch_error"), first_points(orbits), period)
    assert np.array_equal(found.converged, [True, False, True, True])
    assert np.array_equal(np.isnan(found.multipliers[:, 0]), ~found.converged)


def test_a_lane_is_polished_by_itself_whatever_its_neighbours_are():
    orbits = STORED["no_axial"]
    multiples, period = of(orbits, "pitch_error"), of(orbits, "period")
    guess = first_points(orbits) + 1e-5
    guess[0] = np.nan
    together = found_orbits(NO_AXIAL, multiples, guess, period)
    assert np.array_equal(together.converged, [False, True, True, True])
    order = [3, 1, 2]
    system = system_of(pan2021(multiples), NO_AXIAL).of(order)
    others = polish(system, guess[order], period[order], Plan(200, 0, 0, 0))
    for one, other in zip(together, others, strict=True):
        assert np.array_equal(one[order], other)


def assert_nothing_found(found: Orbits) -> None:
    assert not found.converged.any()
    assert np.isnan(found.points).all()
    assert np.isnan(found.multipliers).all()
