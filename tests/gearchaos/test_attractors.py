"""Attractors are found from the end states of lanes, for any phase of the motion."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate

from gearchaos.dynamics.attractors import find_attractors
from gearchaos.records.label import CHAOTIC, DIVERGED, PERIODIC, UNRESOLVED

from ..kernels.reference import NO_AXIAL, SOLUTIONS, pan2021, system_of

DOUBLED = next(one for one in SOLUTIONS["periodic_orbits"] if one["period"] == 2)


def found_from(multiples, states, motion, period, group=0):
    system = system_of(pan2021(np.resize(multiples, len(states))), NO_AXIAL)
    labels = np.full(len(states), motion, np.uint8), np.full(len(states), period, np.int32)
    groups = np.broadcast_to(group, len(states)).astype(np.intp)
    return find_attractors(
        system, groups, np.array(states, dtype=float), *labels, Plan(200, 0, 0, 0)
    )


def ends(multiple, count, periods):
    """Return the states of lanes from different starts after the given number of mesh periods."""
    start = np.zeros((count, 6))
    start[:, 0] = np.linspace(0.9, 1.1, count)
    system = system_of(pan2021(np.full(count, multiple)), NO_AXIAL)
    return integrate(system, start, Plan(200, periods, 0, 0, tangent=True)).end_state


def test_both_phases_of_an_orbit_of_period_2_are_one_attractor():
    one, other = np.array(DOUBLED["section_points"])
    near = 1.0 + 1e-5 * np.sin(np.arange(6.0))
    states = [one, other, one * near, other * near]
    found, number = found_from(DOUBLED["pitch_error"], states, PERIODIC, 2)
    assert number.tolist() == [0, 0, 0, 0]
    (orbit,) = found
    assert (orbit.lane, orbit.points.shape) == (0, (2, 6))
    assert np.abs(orbit.averages[0] - (one + other) / 2.0).max() < 1e-4
    assert np.abs(orbit.averages[1] - np.abs(one - other) / 2.0).max() < 1e-4
    stored = max(abs(complex(*pair)) for pair in DOUBLED["floquet_multipliers"])
    assert abs(orbit.multipliers[0]) == pytest.approx(stored, rel=1e-3)


def test_lanes_that_are_still_far_are_polished_to_the_same_orbit():
    one, other = np.array(DOUBLED["section_points"])
    states = [one, 1.004 * one, 0.996 * other]
    found, number = found_from(DOUBLED["pitch_error"], states, PERIODIC, 2)
    assert len(found) == 1
    assert number.tolist() == [0, 0, 0]


def test_a_lane_that_a_longer_record_labels_goes_on_until_it_is_there():
    one, _ = np.array(DOUBLED["section_points"])
    found, number = found_from(DOUBLED["pitch_error"], [0.5 * one, one], PERIODIC, 2)
    assert len(found) == 1
    assert number.tolist() == [0, 0]


def test_lanes_of_other_parameters_share_no_attractor():
    one, _ = np.array(DOUBLED["section_points"])
    found, number = found_from(DOUBLED["pitch_error"], [one, one], PERIODIC, 2, group=[0, 1])
    assert len(found) == 2
    assert number.tolist() == [0, 1]


def test_starts_on_one_chaotic_attractor_are_reported_by_where_it_goes():
    states = ends(12.5, 24, 300)
    found, number = found_from(12.5, states, CHAOTIC, 0)
    assert len(found) == 1
    assert not number.any()
    assert np.isnan(found[0].multipliers).all()


def test_averages_that_differ_by_an_extent_are_those_of_two_attractors():
    """Two lanes of different pitch errors form one group; their averages differ by 0.9 extents."""
    multiples = [13.0, 12.5]
    states = np.concatenate([ends(multiple, 1, 300) for multiple in multiples])
    found, number = found_from(multiples, states, CHAOTIC, 0)
    one, other = (attractor.averages for attractor in found)
    assert 0.6 < np.max(np.abs(one - other) / one[1]) < 1.2
    assert number.tolist() == [0, 1]


@pytest.mark.parametrize("motion", [UNRESOLVED, DIVERGED])
def test_what_has_no_motion_has_no_attractor(motion):
    found, number = found_from(DOUBLED["pitch_error"], DOUBLED["section_points"], motion, 0)
    assert not found
    assert number.tolist() == [-1, -1]


def test_where_no_stable_orbit_has_the_period_of_the_label_there_is_none():
    found, number = found_from(12.5, ends(12.5, 2, 50), PERIODIC, 5)
    assert not found
    assert number.tolist() == [-1, -1]
