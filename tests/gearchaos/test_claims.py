"""Claimed errors bound the true ones: transients, modes damped by the step, and rounding."""

import numpy as np
import pytest
from gearchaos_kernels import Effects, Plan, integrate, jacobian

from gearchaos.dynamics.hidden_modes import hidden_error
from gearchaos.dynamics.modes import hidden_decay, memory
from gearchaos.dynamics.orbits import polish
from gearchaos.dynamics.remainders import remainders
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.choosing import with_chosen_steps
from gearchaos.engine.dask_executor import _run_plan
from gearchaos.engine.error_check import CHANGED, NOT_CHECKED, SAME, Tally
from gearchaos.engine.run_plan import Chosen
from gearchaos.engine.steps import solution_of
from gearchaos.errors import ConfigurationError
from gearchaos.records.difference import difference

from ..kernels.reference import LINEAR, NO_AXIAL, PERIOD, drawn_teeth, pan2021, system_of
from .short_sweeps import computed, simulation

CHECKED = "integration.error_check=1.0"
MAPS = ("integration.method=flow_map", "integration.steps_per_period=24")
PLANAR = LINEAR._replace(axial=False)

SLOW = (
    "groups.damping_ratio=0.02",
    "groups.transverse_damping_p=0.004",
    "groups.transverse_damping_g=0.004",
    "groups.transverse_stiffness_p=0.9",
    "groups.transverse_stiffness_g=0.5",
    "groups.pitch_error=2.0",
    "sweep={parameter='load', values=[0.3, 0.5, 0.8]}",
    *MAPS,
    "integration.transient_periods=200",
    "integration.recorded_periods=100",
    "outputs.section_points=4",
)
"""Soft, weakly damped bearings: a disturbance falls by a factor e in about 35 mesh periods."""

STIFF = (
    "groups.mass_ratio_p=0.7",
    "groups.transverse_stiffness_p=150.0",
    "groups.transverse_damping_p=0.05",
    "groups.transverse_stiffness_g=40.0",
    "groups.transverse_damping_g=0.02",
    "groups.pitch_error=6.0",
    "sweep={parameter='mesh_frequency', values=[0.2173, 0.3]}",
    "integration.transient_periods=300",
    "integration.recorded_periods=100",
)
"""Stiff bearings at low mesh frequencies; the weakly damped bearings determine the exponent."""


def true_section_error(sweep, arrays, name: str = "delta_5", periods: int = 6000) -> np.ndarray:
    """Return the distance of the last section point from the orbit that flow maps reach later."""
    every = np.arange(len(sweep.lanes))
    system = sweep.lanes.system_of(every)
    much_later = integrate(
        system, arrays["end_state"], Plan(24, periods, 16, 16, True, method="flow_map")
    )
    orbit = much_later.section[:, :, system.states.index(name)]
    last = arrays[f"section_{name}"][:, -1:]
    return np.min(np.abs(orbit - last), axis=1)


@pytest.fixture(scope="module")
def slow():
    sweep = simulation(*SLOW, CHECKED)
    return sweep, computed(sweep)


def test_a_section_on_its_way_is_claimed_to_be_as_far_off_as_it_is(slow):
    true, claimed = true_section_error(*slow), slow[1]["section_error"]
    assert (true > 1e-6).all()
    # The claim is the largest distance in the last period, which has one point.
    assert claimed == pytest.approx(true, rel=0.01)
    assert (slow[1]["motion_changed"] == SAME).all()


def test_points_kept_from_earlier_are_further_off(slow):
    many = simulation(*SLOW, CHECKED, "outputs.section_points=80")
    arrays = computed(many)
    assert arrays["section_error"] == pytest.approx(slow[1]["section_error"], rel=1e-6)
    orbit = arrays["section_delta_5"][:, -1:]
    spread = np.max(np.abs(arrays["section_delta_5"] - orbit))
    assert spread > 3.0 * arrays["section_error"].max()
    tally = Tally()
    tally.add(arrays)
    farthest = float(tally.errors.split(" in the end (up to ")[1].split()[0])
    assert farthest == pytest.approx(spread, rel=0.3)


def test_a_lane_labelled_by_a_longer_record_is_claimed_to_be_off_by_what_its_own_lacks():
    # Just below a period doubling: after 200 periods, only a longer record labels the orbit.
    sweep = simulation(
        *("sweep={parameter='pitch_error', values=[5.0, 10.26610169]}", *MAPS, CHECKED),
        *("integration.transient_periods=100", "integration.recorded_periods=100"),
        "outputs.section_points=2",
    )
    arrays = computed(sweep)
    true = true_section_error(sweep, arrays)
    assert arrays["period"].tolist() == [1, 1]
    assert arrays["return_distance"][1] > 0.01
    assert true[1] > 0.01
    assert arrays["section_error"] == pytest.approx(true, rel=0.5)
    assert (arrays["section_error"] >= true).all()


def test_a_tolerance_is_kept_behind_a_longer_transient():
    sweep = simulation(*SLOW, "integration.tolerance=1e-8")
    sweep = with_chosen_steps(sweep)
    note = next(text for text in sweep.notes if "transient" in text)
    raised = sweep.plan.transient_periods
    assert note.startswith(f"integration.transient_periods raised from 200 to {raised} for ")
    assert 300 < raised < 1500
    true = true_section_error(sweep, computed(sweep))
    assert (true < 1e-8).all()
    claimed = float(sweep.notes[-1].split("section is off by ")[1].split(",")[0])
    # The note has two digits.
    assert 0.9 * true.max() < claimed < 1e-8


def test_workers_of_a_cluster_take_the_transient_that_was_chosen():
    sweep = simulation(*SLOW, "integration.tolerance=1e-8")
    sweep = sweep.with_choice(Chosen(steps_per_period=123, transient_periods=777))
    _run_plan.cache_clear()
    assert _run_plan(sweep.config.resolved_toml(), sweep.chosen).plan == sweep.plan


def test_a_tolerance_raises_the_transient_however_few_points_are_kept():
    kept = "outputs.motion=false", "outputs.section_points=1"
    sweep = simulation(*SLOW, *kept, "integration.tolerance=1e-8")
    sweep = with_chosen_steps(sweep)
    assert sweep.plan.transient_periods > 300


def test_a_tolerance_is_kept_where_both_grids_damp_the_mode_that_decides():
    low = "sweep={parameter='mesh_frequency', values=[0.2173, 0.2183]}"
    stiff = *STIFF, low, "groups.transverse_damping_p=0.002", "integration.tolerance=1e-3"
    limit = fewest_stable_steps(simulation(*stiff, *MAPS).lanes.system_of(np.arange(2))).max()
    sweep = simulation(*stiff, f"integration.steps_per_period={limit}")
    sweep = with_chosen_steps(sweep)
    found = computed(sweep)["lyapunov_exponent"]
    exact = computed(simulation(*stiff, *MAPS))["lyapunov_exponent"]
    assert (np.abs(found - exact) < 1e-3).all()


def test_a_tolerance_that_no_transient_within_reach_keeps_is_refused_with_the_remedy():
    short = "integration.transient_periods=0", "integration.recorded_periods=24"
    sweep = simulation(*SLOW, *short, "integration.tolerance=1e-10", "sweep.values=[0.5]")
    told = r"tolerance = 1e-10: after .* which no number of steps changes; set"
    with pytest.raises(ConfigurationError, match=told) as refused:
        sweep = with_chosen_steps(sweep)
    wanted = int(str(refused.value).split("transient_periods to ")[1].split()[0])
    assert wanted > 16 * 24
    enough = simulation(
        *SLOW, "integration.tolerance=1e-10", f"integration.transient_periods={wanted}"
    )
    enough = with_chosen_steps(enough)
    assert enough.plan.transient_periods < 2 * wanted


def test_a_transient_that_is_long_enough_stays():
    sweep = simulation(*SLOW, "integration.tolerance=1e-1", "integration.transient_periods=500")
    sweep = with_chosen_steps(sweep)
    assert sweep.plan.transient_periods == 500
    assert not any("transient" in note for note in sweep.notes)


def linear_pair(**groups):
    return system_of(pan2021(np.array([1.0, 6.0]), **groups), PLANAR)


def linear_orbit(system) -> np.ndarray:
    """Return the fixed point of the affine map of one period, in closed form."""
    once = Plan(24, 0, 1, 1, tangent=True, method="flow_map")
    states = len(system.states)
    columns = [
        integrate(system, np.tile(unit, (system.lanes, 1)), once).end_state
        for unit in (np.zeros(states), *np.eye(states))
    ]
    offset = columns[0]
    matrix = np.stack(columns[1:], axis=2) - offset[:, :, np.newaxis]
    return np.linalg.solve(np.eye(states) - matrix, offset[..., np.newaxis])[..., 0]


def of_linear(system, section, kept=1):
    plan = Plan(24, 0, 0, 0, method="flow_map")
    every = range(len(system.states))
    period = np.ones(system.lanes, dtype=np.int32)
    return remainders(system, section, (kept, every), period, section[:, -1], plan)


def test_the_distance_from_the_orbit_of_a_linear_pair_is_exact():
    system = linear_pair(transverse_damping_g=0.0005)
    record = Plan(24, 60, 8, 8, tangent=True, method="flow_map")
    section = integrate(system, np.zeros((2, 6)), record).section
    apart = np.max(np.abs(section - linear_orbit(system)[:, np.newaxis]), axis=2)
    found = of_linear(system, section, kept=8)
    assert found.distance == pytest.approx(apart[:, -1], rel=1e-8)
    assert found.of_kept == pytest.approx(apart.max(axis=1), rel=1e-8)
    modes = np.linalg.eigvals(jacobian(system, np.ones((2, system.elements))))
    assert found.decay == pytest.approx(-np.max(modes.real, axis=1) * PERIOD, rel=1e-9)


def test_a_section_ends_in_any_phase_of_its_orbit():
    system = system_of(pan2021(10.75), NO_AXIAL)
    plan = Plan(24, 2000, 8, 8, tangent=True, method="flow_map")
    outcome = integrate(system, np.zeros((1, 6)), plan)
    for points in (8, 7):
        section = outcome.section[:, :points]
        kept, period = (6, range(6)), np.array([2], dtype=np.int32)
        found = remainders(system, section, kept, period, outcome.end_state, plan)
        assert found.of_kept[0] < 1e-10
    # Both points of the last period count.
    shifted = outcome.section.copy()
    shifted[0, -2, 0] += 1e-3
    found = remainders(system, shifted, kept, period, outcome.end_state, plan)
    assert found.distance == pytest.approx(1e-3, rel=1e-6)
    # The orbit has two points that are far from each other.
    assert np.max(np.abs(np.diff(outcome.section[0, -2:], axis=0))) > 0.01


@pytest.mark.parametrize("steps", [1, 3, 24])
def test_no_claim_is_below_the_rounding_of_flow_maps(steps):
    maps = Plan(steps, 4000, 48, 48, tangent=True, method="flow_map")
    system = linear_pair(damping_ratio=0.004, transverse_damping_g=0.002)
    outcome = integrate(system, np.zeros((2, 6)), maps)
    solution = solution_of(system, outcome, maps, ())
    alone = difference(solution, solution)
    assert (alone.section_error > 0.0).all()
    assert (alone.exponent_error > 0.0).all()
    found = of_linear(system, outcome.section)
    truth = np.abs(outcome.section[:, -1] - linear_orbit(system)).max(axis=1)
    assert (truth <= found.section_rounding).all()
    assert (found.section_rounding < 1e-11).all()
    modes = np.linalg.eigvals(jacobian(system, np.ones((2, system.elements))))
    error = np.abs(solution.exponent - np.max(modes.real, axis=1))
    # Factor 2: eigenvalues of a nearly symmetric pair of modes are less well conditioned.
    assert (error <= 2.0 * found.exponent_rounding).all()
    assert (found.exponent_rounding < 1e-12).all()


def test_a_sweep_of_few_flow_maps_claims_no_error_of_nothing():
    few = simulation(*MAPS[:1], "integration.steps_per_period=2", CHECKED, "sweep.to=9.0")
    arrays = computed(few)
    assert not np.any(arrays["section_error"] == 0.0)
    assert not np.any(arrays["exponent_step_error"] == 0.0)


@pytest.fixture(scope="module")
def exact_exponents():
    return computed(simulation(*STIFF, *MAPS))["lyapunov_exponent"]


@pytest.mark.parametrize("margin", [1.0, 1.1, 1.25, 1.5])
def test_the_error_of_an_exponent_is_claimed_also_where_both_grids_damp_its_mode(
    margin, exact_exponents
):
    limit = fewest_stable_steps(simulation(*STIFF, *MAPS).lanes.system_of(np.arange(2))).max()
    steps = f"integration.steps_per_period={int(np.ceil(margin * limit))}"
    arrays = computed(simulation(*STIFF, steps, CHECKED))
    true = np.abs(arrays["lyapunov_exponent"] - exact_exponents)
    assert (true > 1e-4).all()
    assert arrays["exponent_step_error"] == pytest.approx(true, rel=1e-6)


STIFF_MODE = {
    "transverse_stiffness_p": 150.0,
    "transverse_damping_p": 1e-4,
    "transverse_damping_g": 0.1,
    "damping_ratio": 0.1,
}


def test_modes_that_half_the_step_damps_are_hidden_until_steps_are_fine():
    system = linear_pair(**STIFF_MODE)
    modes = np.linalg.eigvals(jacobian(system, np.ones((2, system.elements))))
    stiffest = modes[0, np.argmax(np.abs(modes[0]))]
    limit = int(fewest_stable_steps(system)[0])
    assert hidden_decay(system, limit, "rk4") == pytest.approx(np.full(2, stiffest.real))
    assert np.isneginf(hidden_decay(system, 40 * limit, "rk4")).all()
    # Steps on both sides of the limit of five per cent, which follows from the leading error
    # |h lambda|^6 / 144 per step.
    step = (0.05 * 144.0 * abs(stiffest.real) / abs(stiffest) ** 6) ** 0.2
    steps = 0.5 * PERIOD / step
    assert np.isfinite(hidden_decay(system, int(0.9 * steps), "rk4")).all()
    assert np.isneginf(hidden_decay(system, int(1.1 * steps), "rk4")).all()


@pytest.mark.parametrize("teeth", [False, True])
def test_a_hidden_mode_gives_the_error_with_and_without_flow_maps(teeth):
    system = linear_pair(**STIFF_MODE)
    if teeth:
        system = system.replace(teeth=drawn_teeth(3, 2, lanes=2))
    steps = int(fewest_stable_steps(system)[0])
    plan = Plan(steps, 0, 0, 0)
    period = np.ones(2, dtype=np.int32)
    orbits = polish(system, np.zeros((2, 6)), period, plan)
    if not orbits.converged.all():
        settled = integrate(system, np.zeros((2, 6)), Plan(steps, 600, 6, 0, True)).end_state
        orbits = polish(system, settled, period, plan)
    exponent = np.log(np.abs(orbits.multipliers[:, 0])) / system.excitation_period
    modes = np.linalg.eigvals(jacobian(system, np.ones((2, system.elements))))
    true = np.abs(exponent - np.max(modes.real, axis=1))
    found = hidden_error(system, plan, period, orbits.points, exponent)
    assert (true > 0.01).all()
    assert found == pytest.approx(true, rel=1e-9)
    # A step of a flow map does not damp; a motion that is not periodic has no orbit.
    exact = plan._replace(method="flow_map")
    assert not hidden_error(system, exact, period, orbits.points, exponent).any()
    assert not hidden_error(system, plan, 0 * period, orbits.points, exponent).any()


def test_the_memory_of_a_pair_is_that_of_its_slowest_mode_that_acts_on_others():
    torsion = Effects(False, False, False, False, False)
    alone = system_of(pan2021(1.0, base_helix_angle=0.0, damping_ratio=0.02), torsion)
    assert memory(alone) == pytest.approx([1.0 / (0.02 * PERIOD)])
    undamped = system_of(pan2021(1.0, damping_ratio=0.0), torsion)
    assert np.isposinf(memory(undamped)).all()
    slow_axial = pan2021(1.0, axial_damping_g=1e-6)
    axial = memory(system_of(slow_axial, LINEAR))
    assert axial == pytest.approx(memory(system_of(slow_axial, PLANAR)))


def test_lanes_that_move_in_another_way_are_no_part_of_the_errors():
    tally = Tally()
    tally.add(
        {
            "status": np.zeros(3),
            "section_error": np.full(3, np.nan),
            "exponent_step_error": np.array([1e-3, 3e-3, 0.5]),
            "lyapunov_exponent_standard_error": np.array([2e-3, 2e-3, 0.4]),
            "motion_changed": np.array([SAME, SAME, CHANGED], dtype=np.uint8),
        }
    )
    assert tally.errors == (
        "3 lanes computed again with half the step: exponent of 2 others by 2.0e-03 (median) to "
        "3.0e-03 from the step and 2.0e-03 (median) to 2.0e-03 from the length of the record; "
        "1 settle on a different motion"
    )


def test_the_summary_names_a_section_that_begins_far_from_its_orbit():
    # Two lanes of period 2, the first points a little off the orbit; one lane without a period.
    section = np.array([[0.5, 1.0, 2.0, 1.0, 2.0], [2.0 - 6e-6, 1.0, 2.0, 1.0, 2.0], [0.0] * 5])
    arrays = {
        "status": np.zeros(3),
        "section_error": np.array([1e-6, 3e-6, np.nan]),
        "motion_changed": np.array([NOT_CHECKED, SAME, SAME], dtype=np.uint8),
        "period": np.array([2, 2, 0], dtype=np.int32),
    }
    named = (
        "section of 1 periodic ones off by 3.0e-06 (median) to 3.0e-06 in the end (up to 9.0e-06"
    )
    for repeats, first, found in ((1, 0, True), (1, 1, False), (2, 0, True), (3, 0, False)):
        tally = Tally(repeats)
        tally.add({**arrays, "section_delta_5": section[:, first:]})
        assert (named in tally.errors) == found
