"""Orbits of a curve that come near to grazing, however many orbits are looked at together."""

import numpy as np
import pytest
from gearchaos_kernels import Plan

import gearchaos
from gearchaos.dynamics.arclength import along_the_way
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.dynamics.branches import trace
from gearchaos.dynamics.embedded import record_length
from gearchaos.dynamics.near_grazings import near_grazings
from gearchaos.models.registry import system_of
from gearchaos.records.branch import notes_of

from .test_branches import SPUR_PAIR

DAMPING, LOAD = 0.4, 0.2
PEAK = 1.0 / np.sqrt(1.0 - DAMPING**2 / 2.0)
"""The frequency at which the response without separation is largest."""


AMPLITUDE = DAMPING * np.sqrt(1.0 - DAMPING**2 / 4.0) * LOAD * (1.0 - 1e-5)
PAIR = gearchaos.Configuration.from_toml(
    SPUR_PAIR.format(load=LOAD, amplitude=AMPLITUDE, damping=DAMPING), "spur.toml"
)


def spur_pairs(frequency):
    """Return pairs whose teeth nearly separate at the frequency `PEAK`."""
    return system_of(PAIR, {"frequency": frequency}, PAIR.needed_effects)


def test_orbits_of_more_than_100_mesh_periods_have_no_grazings_and_a_note_says_so():
    over = BranchRange(spur_pairs, PEAK - 0.3, PEAK + 0.5)
    plans = [over.curve(Plan(16, 0, 1, 1), period, np.ones(2)).plan for period in (100, 101)]
    assert [plan.contact for plan in plans] == [True, False]
    facts = {"method": "flow_map", "excitation_period": 25}
    assert notes_of({**facts, "longest_period": 4}) == []
    (note,) = notes_of({**facts, "longest_period": 5})
    assert note.startswith("grazings of orbits of more than 100 mesh periods are not looked for")


@pytest.mark.parametrize(
    ("repeats", "periods"), [(1, 20_000), (10, 20_000), (1081, 185), (10**6, 100)]
)
def test_a_record_has_fewer_excitation_periods_where_they_are_long(repeats, periods):
    assert record_length(repeats) == periods


@pytest.fixture(scope="module")
def traced():
    """The curve of the orbits that never separate, and its points."""
    over = BranchRange(spur_pairs, PEAK - 0.3, PEAK + 0.5)
    curve = over.curve(Plan(16, 0, 1, 1, method="flow_map"), 1, np.ones(2))
    start = curve.corrected(np.array([1.0 + LOAD, 0.0, 0.1]), along_the_way(2))
    return curve, trace(curve, start).points


def test_the_orbit_that_comes_nearest_to_a_flank_is_found(traced):
    curve, points = traced
    (found, *_) = near_grazings(curve, points).tests
    assert points[found[0]].share == pytest.approx(0.375, abs=0.02)


@pytest.mark.parametrize("many", [3, 4, 5])
def test_a_few_orbits_have_the_near_grazings_that_they_have_among_many(traced, many):
    curve, points = traced
    wanted = {at for at, _ in near_grazings(curve, points).tests}
    found = set()
    for first in range(len(points) - many + 1):
        for at, _ in near_grazings(curve, points[first : first + many]).tests:
            assert 0 < at < many - 1
            found.add(first + at)
    assert found == wanted
