"""The lanes of Pan 2021 are labelled as what they are, and nothing else in a result changes."""

import numpy as np
import pytest

from gearchaos.configuration import load_config
from gearchaos.engine.simulation import Simulation
from gearchaos.records.label import (
    CHAOTIC,
    DIVERGED,
    MEANINGS,
    PERIODIC,
    QUASI_PERIODIC,
    UNRESOLVED,
    Record,
    label,
)

from .short_sweeps import (
    RANDOM,
    SOFT_BEARINGS,
    SPEEDS,
    assert_same,
    computed,
    listing,
    simulation,
)

LONG = (
    "integration.steps_per_period=200",
    "integration.transient_periods=500",
    "integration.recorded_periods=500",
)


def lanes_at(*values: float, overrides: tuple[str, ...] = ()) -> Simulation:
    return simulation(f"sweep={{parameter='pitch_error', values={[*values]}}}", *LONG, *overrides)


def test_the_motions_of_figure_7_are_labelled():
    arrays = computed(lanes_at(5.86, 10.75, 12.47, 12.97, 13.4), 5)
    assert arrays["motion"].tolist() == [PERIODIC, PERIODIC, CHAOTIC, PERIODIC, CHAOTIC]
    assert arrays["period"].tolist() == [1, 2, 0, 3, 0]
    assert arrays["bands"].tolist() == [0, 0, 1, 0, 1]
    assert (arrays["return_distance"][[0, 1, 3]] < 1e-9).all()
    assert (arrays["return_distance"][[2, 4]] > 1e-2).all()


def test_a_lane_that_settles_slowly_is_labelled_by_the_stable_orbit_it_comes_close_to():
    # Just before the period doubling and just behind it; after ten times as long it has arrived.
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
    # A linear oscillator: every disturbance shrinks by |mu| = exp(-zeta T) a period.
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
    _, outcome = sweep.integrate(lanes, sweep.recording)
    record = Record(outcome.section, outcome.growth, lanes < 0, lanes < 0)
    assert label(record).motion.tolist() == [UNRESOLVED] * 2
    arrays = computed(sweep, 2)
    assert arrays["motion"].tolist() == [motion] * 2
    assert (arrays["return_distance"] > 1e-3).all()
    assert_same(arrays, computed(sweep, 1))


SLOW_TORI = "sweep={parameter='mesh_frequency', values=[1.121, 1.15, 1.424]}"


def test_a_rotation_slower_than_its_record_is_resolved_by_a_longer_one():
    sweep = Simulation(load_config(SPEEDS, (SLOW_TORI, *SOFT_BEARINGS)))
    lanes = np.arange(3)
    _, outcome = sweep.integrate(lanes, sweep.recording)
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
def test_labels_change_nothing_else_of_a_result(overrides):
    # Without an odd lane out: labels come on top.
    with_labels = computed(simulation(*overrides))
    without = computed(simulation(*overrides, "outputs.motion=false"))
    labels = {"motion", "period", "return_distance", "bands"}
    assert with_labels.keys() - without.keys() == labels
    assert_same({n: a for n, a in with_labels.items() if n not in labels}, without)


def test_a_diverged_lane_is_labelled_as_diverged(tmp_path):
    arrays = computed(listing(tmp_path, "load", [-1e150, 0.2, 0.3]))
    assert arrays["motion"].tolist()[0] == DIVERGED
    assert DIVERGED not in arrays["motion"].tolist()[1:]
    assert np.isnan(arrays["return_distance"][0])


def test_the_meanings_of_the_labels_are_in_the_result():
    (motion,) = [v for v in simulation().variables if v.name == "motion"]
    assert motion.flags == MEANINGS
    assert motion.flags[PERIODIC] == "periodic"


def test_the_memory_of_a_block_counts_what_the_labels_need():
    assert simulation().block_memory(2) > simulation("outputs.motion=false").block_memory(2)
