"""Lanes of Pan 2021 get the correct labels; labels change only the exponents of orbits."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, Status

from gearchaos.dynamics.exponents import period_jacobian
from gearchaos.dynamics.largest_exponents import MIXED
from gearchaos.dynamics.orbits import polish
from gearchaos.engine.computing import block_memory, integrate_places
from gearchaos.engine.error_check import Tally
from gearchaos.engine.kept import variables_of
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.models import load_config
from gearchaos.records.label import (
    CHAOTIC,
    DIVERGED,
    GROWS,
    MOTION_MEANINGS,
    PERIODIC,
    QUASI_PERIODIC,
    UNRESOLVED,
    Record,
    label,
)

from ..kernels.reference import PERIOD
from .short_sweeps import (
    PAN2021,
    RANDOM,
    SOFT_BEARINGS,
    SPEEDS,
    assert_same,
    computed,
    listing,
    simulation,
)
from .test_contact_outputs import AXIAL

LONG = (
    "integration.steps_per_period=200",
    "integration.transient_periods=500",
    "integration.recorded_periods=500",
)


def lanes_at(*values: float, overrides: tuple[str, ...] = ()) -> RunPlan:
    return simulation(f"sweep={{parameter='pitch_error', values={[*values]}}}", *LONG, *overrides)


def test_the_motions_of_figure_7_are_labelled():
    arrays = computed(lanes_at(5.86, 10.75, 12.47, 12.97, 13.4), 5)
    assert arrays["motion"].tolist() == [PERIODIC, PERIODIC, CHAOTIC, PERIODIC, CHAOTIC]
    assert arrays["period"].tolist() == [1, 2, 0, 3, 0]
    assert arrays["bands"].tolist() == [0, 0, 1, 0, 1]
    assert (arrays["return_distance"][[0, 1, 3]] < 1e-9).all()
    assert (arrays["return_distance"][[2, 4]] > 1e-2).all()


def test_a_lane_that_settles_slowly_is_labelled_by_the_stable_orbit_it_comes_close_to():
    # Just below and just above the period doubling; after a ten times longer transient the lanes
    # have settled.
    arrays = computed(lanes_at(10.26, 10.27), 2)
    assert ((arrays["return_distance"] > 1e-5) & (arrays["return_distance"] < 1e-2)).all()
    longer = ("integration.transient_periods=8000",)
    patient = computed(lanes_at(10.26, 10.27, overrides=longer), 2)
    assert (patient["return_distance"] < 1e-9).all()
    for found in (arrays, patient):
        assert found["motion"].tolist() == [PERIODIC, PERIODIC]
        assert found["period"].tolist() == [1, 2]


@pytest.mark.parametrize(("multiplier", "motion"), [(0.995, PERIODIC), (0.99999, UNRESOLVED)])
def test_an_orbit_that_hardly_attracts_is_found_by_a_longer_record(multiplier, motion):
    # In a linear oscillator every disturbance shrinks by |mu| = exp(-zeta T) per period.
    period = 2.0 * np.pi / 1.3717
    sweep = simulation(
        "sweep={parameter='load', values=[0.1, 0.2]}",
        f"groups.damping_ratio={-np.log(multiplier) / period:.17g}",
        "groups.mesh_frequency=1.3717",
        "pair.helix_angle_deg=0.0",
        "scene.effects=['pitch_error']",
        "integration.transient_periods=0",
        "integration.recorded_periods=60",
        "outputs.section_points=60",
    )
    lanes = np.arange(2)
    _, outcome = integrate_places(sweep, lanes, sweep.recording)
    record = Record(outcome.section, outcome.growth, lanes < 0, lanes < 0)
    assert label(record).motion.tolist() == [UNRESOLVED] * 2
    arrays = computed(sweep, 2)
    assert arrays["motion"].tolist() == [motion] * 2
    assert (arrays["return_distance"] > 1e-3).all()
    assert_same(arrays, computed(sweep, 1))


SLOW_TORI = "sweep={parameter='mesh_frequency', values=[1.121, 1.15, 1.424]}"


def test_a_rotation_slower_than_its_record_is_resolved_by_a_longer_one():
    sweep = plan_run(load_config(SPEEDS, (SLOW_TORI, *SOFT_BEARINGS)))
    lanes = np.arange(3)
    _, outcome = integrate_places(sweep, lanes, sweep.recording)
    record = Record(outcome.section, outcome.growth, lanes < 0, lanes >= 0)
    assert label(record).motion.tolist() == [UNRESOLVED, QUASI_PERIODIC, UNRESOLVED]
    arrays = computed(sweep, 3)
    assert arrays["motion"].tolist() == [QUASI_PERIODIC] * 3
    assert_same(arrays, computed(sweep, 1))


def test_the_label_looks_at_states_that_are_not_kept():
    section = "outputs.section=[]"
    arrays = computed(lanes_at(5.86, 12.97, overrides=(section, "outputs.lyapunov=false")), 2)
    assert not [name for name in arrays if name.startswith(("section", "lyapunov"))]
    assert arrays["period"].tolist() == [1, 3]


@pytest.mark.parametrize("overrides", [(), RANDOM, ("start.carry=downwards",)])
def test_labels_change_nothing_else_of_a_result_but_exponents_of_orbits(overrides):
    # Labels are added; all other arrays stay the same in every lane, except exponents of orbits.
    with_labels = computed(simulation(*overrides))
    without = computed(simulation(*overrides, "outputs.motion=false"))
    labels = {"motion", "period", "return_distance", "bands", "record"}
    assert with_labels.keys() - without.keys() == labels
    kept = {n: a for n, a in with_labels.items() if n not in labels}
    others = with_labels["period"] == 0
    assert others.any()
    for name in ("lyapunov_exponent", "lyapunov_exponent_standard_error"):
        assert np.array_equal(kept.pop(name)[others], without.pop(name)[others])
    assert_same(kept, without)


def test_the_exponent_of_a_periodic_lane_is_that_of_its_orbit():
    sweep = lanes_at(5.86, 10.75, 12.97)
    arrays = computed(sweep, 3)
    multipliers = polish(
        sweep.lanes.system_of(np.arange(3)), arrays["end_state"], arrays["period"], sweep.plan
    ).multipliers
    exact = np.log(np.abs(multipliers[:, 0])) / (arrays["period"] * PERIOD)
    assert arrays["lyapunov_exponent"] == pytest.approx(exact, abs=1e-9)
    assert (arrays["lyapunov_exponent_standard_error"] == 0.0).all()
    plain = computed(lanes_at(5.86, overrides=("integration.crossings='plain'", *AXIAL)), 1)
    assert (plain["lyapunov_exponent_standard_error"] > 0.0).all()


def test_a_record_that_holds_chaos_before_its_orbit_is_mixed():
    # Chaos ends within the record. The orbit lies far outside the region of the chaos.
    values = np.arange(14.6, 15.0, 0.01).round(3).tolist()
    arrays = computed(lanes_at(*values), len(values))
    mixed = arrays["record"] == MIXED
    assert mixed.any()
    assert (arrays["motion"][mixed] == PERIODIC).all()
    assert (arrays["lyapunov_exponent"][arrays["period"] > 0] < 0.0).all()


PARAMETRIC = (
    'scene.effects=["pitch_error","stiffness_variation","transverse","axial"]',
    "groups.pitch_error_amplitude=0.0",
    "groups.stiffness_variation_scale=2.0",
    "groups.damping_ratio=0.001",
    "sweep={parameter='mesh_frequency', from=1.0, to=3.0, count=41}",
)


def test_a_linear_scene_grows_or_settles_and_is_never_chaotic():
    sweep = plan_run(load_config(PAN2021.with_name("pan2021_full.toml"), PARAMETRIC))
    arrays = computed(sweep, 41)
    system, once = sweep.lanes.system_of(np.arange(41)), Plan(200, 0, 1, 0, tangent=True)
    multipliers = np.linalg.eigvals(period_jacobian(system, np.zeros((41, 10)), once))
    grows = np.max(np.abs(multipliers), axis=1) > 1.0
    # The tongues of the Mathieu equation lie near Omega = 2 / n.
    assert 3 < grows.sum() < 38
    assert np.array_equal(arrays["motion"] == GROWS, grows)
    assert not np.isin(arrays["motion"], (CHAOTIC, QUASI_PERIODIC)).any()
    assert (arrays["period"][grows] == 0).all()


def test_slow_growth_of_a_linear_scene_is_growth():
    """The lanes lie at the edge of a tongue; their largest multipliers are 0.9987 to 1.0027."""
    near = "sweep={parameter='mesh_frequency', values=[1.708, 1.709, 1.710, 1.711]}"
    file = PAN2021.with_name("pan2021_full.toml")
    sweep = plan_run(load_config(file, [*PARAMETRIC, near]))
    system, once = sweep.lanes.system_of(np.arange(4)), Plan(200, 0, 1, 0, tangent=True)
    multipliers = np.linalg.eigvals(period_jacobian(system, np.zeros((4, 10)), once))
    size = np.max(np.abs(multipliers), axis=1)
    assert np.abs(size - 1.0).max() < 3e-3
    arrays = computed(sweep, 4)
    assert (arrays["motion"] == GROWS).tolist() == (size > 1.0).tolist()
    tally = Tally()
    tally.add(arrays)
    assert "the motion of 2 lanes grows without bound" in "".join(tally.remarks)
    assert (size > 1.0).tolist() == [False, False, True, True]


def test_a_diverged_lane_is_labelled_as_diverged(tmp_path):
    arrays = computed(listing(tmp_path, "load", [-1e150, 0.2, 0.3]))
    assert arrays["motion"].tolist()[0] == DIVERGED
    assert DIVERGED not in arrays["motion"].tolist()[1:]
    assert np.isnan(arrays["return_distance"][0])


def test_a_lane_too_fast_for_its_flow_maps_is_no_diverged_one(tmp_path):
    # Twice these steps would exceed the largest number of steps that is tried.
    how = ("integration.method=flow_map", "integration.steps_per_period=2100")
    arrays = computed(listing(tmp_path, "mesh_frequency", [1e-4, 0.8], *how))
    assert arrays["status"].tolist() == [Status.TOO_FAST, Status.OK]
    assert arrays["motion"][0] == UNRESOLVED
    assert np.isnan(arrays["end_state"][0]).all()
    tally = Tally()
    tally.add(arrays)
    assert "1 of the lanes counted as diverged move faster" in "".join(tally.remarks)


def test_the_meanings_of_the_labels_are_in_the_result():
    (motion,) = [v for v in variables_of(simulation()) if v.name == "motion"]
    assert motion.flags == MOTION_MEANINGS
    assert motion.flags[PERIODIC] == "periodic"


def test_the_memory_of_a_block_counts_what_the_labels_need():
    assert block_memory(simulation(), 2) > block_memory(simulation("outputs.motion=false"), 2)
