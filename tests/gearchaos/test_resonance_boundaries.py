"""Folds between motions of equal period are found; the labels of a map do not show them."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.bounding import find_boundaries
from gearchaos.engine.branching import find_branches
from gearchaos.records.branch import FOLD, GRAZING

from .short_sweeps import PUMP

SWEEP = Path(__file__).parents[2] / "sweeps" / "spur_pair.toml"
LOAD = 0.1

SPEED_AND_ERROR = """
[sweep]
parameter = "operation.speed_rpm"
from = 6000.0
to = 30000.0
count = 24

[second_sweep]
parameter = "pitch_error.amplitude_um"
from = 1.0
to = 40.0
count = 24

[integration]
transient_periods = 300
recorded_periods = 200

[outputs]
contact = true
"""


def configuration(*settings):
    """Return the configuration of the spur pair with flow maps and without exponents."""
    return gearchaos.load_config(
        SWEEP,
        [
            'integration.method="flow_map"',
            "outputs.lyapunov=false",
            "outputs.contact=true",
            'start.carry="none"',
            "sweep.from=0.3",
            "sweep.count=61",
            *settings,
        ],
    )


@cache
def resonances():
    """Return the map of the resonances over speed and load; all its motions have period 1."""
    load = '{ parameter = "load", from = 0.02, to = 0.3, count = 21 }'
    result = gearchaos.run(configuration(f"second_sweep={load}"))
    assert np.all(result["period"] == 1)
    return result


def met(found, kind):
    """Return the sorted frequencies at which curves of a kind cross the load."""
    places = []
    for one in found.boundaries:
        load, frequency = one.values[:, 1] - LOAD, one.values[:, 0]
        for at in np.flatnonzero((load[:-1] * load[1:] < 0.0) & (one.kind == kind)):
            share = load[at] / (load[at] - load[at + 1])
            places.append(frequency[at] + share * (frequency[at + 1] - frequency[at]))
    return sorted(places)


def test_a_jump_of_the_map_leads_to_its_fold():
    found = find_boundaries(resonances(), lines=0)
    assert met(found, FOLD) == pytest.approx([0.83634], abs=2e-3)


def test_every_special_point_of_a_branch_lies_on_a_curve():
    branches = find_branches(gearchaos.run(configuration())).branches
    assert len(branches) == 1
    found = find_boundaries(resonances())
    for kind, count in ((FOLD, 4), (GRAZING, 8)):
        exact = sorted(one.value for one in branches[0].specials if one.kind == kind)
        assert len(exact) == count
        assert met(found, kind) == pytest.approx(exact, abs=2e-3)
    assert all(one.arclength.size > 1 for one in found.boundaries)


def test_every_special_point_is_on_a_curve_where_the_map_of_rk4_jumps():
    # At a grazing, the steps of Newton's method stop shrinking at 1e-9.
    result = gearchaos.run(gearchaos.Configuration.from_toml(PUMP + SPEED_AND_ERROR, "pump.toml"))
    found = find_boundaries(result, lines=2)
    assert len(found.boundaries) >= 12
    assert all(one.arclength.size > 1 for one in found.boundaries)
