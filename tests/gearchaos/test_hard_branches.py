"""Branches of one mass between stops where they are hard to follow."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import gearchaos
from gearchaos.engine.bounding import find_boundaries
from gearchaos.engine.branching import find_branches
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration
from gearchaos.records.branch import EDGE, FOLD, GRAZING, GROWS, HALVING, PERIOD_DOUBLING

SWEEP = """
[sweep]
parameter = "{swept}"
from = {low}
to = {high}
count = {count}

[start]
carry = "both"

[outputs]
section = ["x"]
contact = true

[integration]
method = "taylor"
transient_periods = 300
recorded_periods = 100
"""

MASS = """
[model]
kind = "linear"
coordinates = ["x"]
mass = [1.0]
stiffness = [{stiffness}]
damping = [{damping}]
frequency = {frequency}

[clearance.stop]
gap = {{ x = 1.0 }}
stiffness = {stop}
half_clearance = 1.0
damping = {stop_damping}
damping_acts = "{acts}"

[force.one]
on = {{ x = 1.0 }}
mean = {mean}
amplitude = {first}

[force.two]
on = {{ x = 1.0 }}
amplitude = {second}
order = 2
phase_deg = 30.0
"""
MASS += SWEEP

GRAZES_AT_ITS_BEGINNING = """
[model]
kind = "linear"
frequency = 1.5604
coordinates = ["x"]
mass = [1.0]
stiffness = [[0.3284]]
damping = [0.078]

[clearance.stop]
gap = { x = 1.0 }
stiffness = 39.7939
damping = 0.1087
damping_acts = "in_contact"
half_clearance = 0.9134
one_sided = true

[clearance.play]
gap = { x = 1.0 }
stiffness = { mean = 6.2087, cosine = [0.5106], sine = [0.5483] }
half_clearance = 0.5301
damping = 0.0338

[force.one]
on = { x = 1.0 }
mean = 0.0303
amplitude = 0.6767

[force.two]
on = { x = 1.0 }
amplitude = 0.2568
order = 2
phase_deg = 336.0378
"""
GRAZES_AT_ITS_BEGINNING += SWEEP.format(
    swept="clearance.stop.half_clearance", low=0.2, high=1.4, count=80
)

BASE = {
    "stiffness": 0.1,
    "damping": 0.08,
    "frequency": 1.0,
    "stop": 4.0,
    "stop_damping": 0.0,
    "acts": "always",
    "mean": 0.0,
    "first": 0.6,
    "second": 0.0,
    "count": 7,
}
HUMPS = BASE | {"stiffness": 1.0, "damping": 0.2, "frequency": 0.9, "stop": 0.5}
"""The motion has two maxima in a period, which differ only by the first force."""


@cache
def branches(longest, swept, low, high, **changes):
    """Return the branches over a range, found from a sweep."""
    text = MASS.format(**dict(BASE, **changes), swept=swept, low=low, high=high)
    config = gearchaos.Configuration.from_toml(text, "mass.toml")
    return find_branches(gearchaos.run(config), longest=longest).branches


def asymmetric():
    """Return the branches over the mean force, up to period 4."""
    changes = {"stiffness": 0.05, "damping": 0.05, "frequency": 0.75, "stop": 3.0}
    changes |= {"stop_damping": 0.02, "first": 0.4, "count": 41}
    return branches(4, "force.one.mean", 0.25, 0.65, **changes)


def grazings(found):
    """Return where orbits graze the upper flank, in order."""
    (branch,) = found
    special = [one for one in branch.specials if one.kind == GRAZING]
    return sorted(one.value for one in special if one.flank.endswith("upper side"))


def test_no_orbit_of_a_branch_has_a_shorter_period():
    found = asymmetric()
    assert {one.period for one in found} == {1, 2, 4}
    for one in found:
        section = one.section / np.abs(one.section).max(axis=(0, 1))
        for shorter in range(1, one.period):
            if one.period % shorter == 0:
                away = np.abs(section[:, shorter - 1] - section[:, -1]).max(axis=1)
                assert away.min() > 1e-6


def test_a_branch_begins_at_every_period_doubling():
    found = asymmetric()
    ends = {
        period: np.concatenate([one.value[[0, -1]] for one in found if one.period == period])
        for period in (2, 4)
    }
    for one in found:
        for special in one.specials if one.period < 4 else ():
            if special.kind == PERIOD_DOUBLING:
                assert np.abs(ends[2 * one.period] - special.value).min() < 2e-3


def test_a_branch_that_begins_at_the_edge_of_the_range_ends_there():
    found = branches(1, "frequency", 0.3, 0.36)
    assert len(found) == 2
    assert all(one.ends == (EDGE, EDGE) for one in found)


def response(amplitude):
    """Return the largest displacement of the motion without contact."""
    time = np.linspace(0.0, 2.0 * np.pi, 4001)
    displacement = np.zeros_like(time)
    for order, force, phase in ((1, 0.002, 0.0), (2, amplitude, np.radians(30.0))):
        rate = order * HUMPS["frequency"]
        gain = force / (1.0 - rate**2 + 1j * HUMPS["damping"] * rate)
        displacement += (gain * np.exp(1j * (order * time + phase))).real
    top = np.argmax(displacement)
    bend = displacement[[top - 1, top, (top + 1) % 4000]]
    slope, curvature = (bend[2] - bend[0]) / 2.0, bend[0] - 2.0 * bend[1] + bend[2]
    return bend[1] - slope**2 / (2.0 * curvature)


def test_two_maxima_that_meet_a_flank_one_after_the_other_graze_twice():
    changes = HUMPS | {"first": 0.002, "second": 4.0, "count": 11}
    found = grazings(branches(1, "force.two.amplitude", 1.0, 6.0, **changes))
    assert len(found) == 2
    exact = brentq(lambda amplitude: response(amplitude) - 1.0, 1.0, 4.0, xtol=1e-14)
    assert found[0] == pytest.approx(exact, abs=1e-8)
    assert 0.01 < found[1] - found[0] < 0.04


@pytest.mark.parametrize(("second", "low", "high"), [(2.2702, -0.2, 0.21), (2.28, -0.11, 0.3)])
def test_a_maximum_that_leaves_a_flank_while_another_meets_it_is_seen(second, low, high):
    found = grazings(branches(1, "force.one.amplitude", low, high, **(HUMPS | {"second": second})))
    # The opposite force is the same one half a period later.
    assert len(found) == 2
    assert found[0] == pytest.approx(-found[1], abs=1e-9)
    assert found[1] > 1e-4


PARAMETRIC = """
[groups]
stiffness_variation_scale = 0.8
base_helix_angle_deg = 0.0
half_backlash = 1.0
load = 0.6
damping_ratio = 0.04
pitch_error_amplitude = 0.02
pitch_error_phase_deg = 90.0
stiffness_cosine = [-0.3, -0.1]
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
[start]
kind = "contact"
[sweep]
parameter = "mesh_frequency"
from = 1.85
to = 2.15
count = 13
[integration]
steps_per_period = 200
transient_periods = 300
recorded_periods = 60
[outputs]
contact = true
section_points = 16
"""
"""A pair whose period doubles while its teeth stay in contact, so that its motion is linear."""


def test_orbits_of_every_amplitude_at_one_value_are_no_folds():
    found = find_branches(gearchaos.run(Configuration.from_toml(PARAMETRIC)), longest=2)
    doublings = [
        one.value
        for branch in found.branches
        for one in branch.specials
        if one.kind == PERIOD_DOUBLING and branch.period == 1
    ]
    assert doublings == pytest.approx([1.909459266, 2.084802766], abs=2e-6)
    # A branch rises from each at one value of the frequency, up to the first separation.
    for value in doublings:
        (doubled,) = (
            one
            for one in found.branches
            if one.period == 2 and np.sum(np.abs(one.value - value) < 1e-8) > 3
        )
        assert [one.kind for one in doubled.specials] == [GRAZING]


def test_a_sweep_of_one_value_has_no_branches():
    given = PARAMETRIC.replace("from = 1.85\nto = 2.15\ncount = 13", "values = [1.9]")
    result = gearchaos.run(Configuration.from_toml(given))
    with pytest.raises(ConfigurationError, match="sweep has one value of mesh_frequency"):
        find_branches(result, "one.h5")


def test_branches_do_not_depend_on_the_width_of_the_range():
    """Motions that are small beside others of the sweep have orbits of two and four periods, too.

    Their phases are close together in the scale of the sweep.
    """
    machine = {"stiffness": 0.234, "damping": 0.024, "stop": 1.341, "frequency": 1.187}
    narrow, wide = (
        branches(4, "force.one.amplitude", 0.0, width, **machine, mean=0.235, count=5)
        for width in (2.0, 30.0)
    )
    assert [one.period for one in narrow] == [one.period for one in wide] == [1, 2, 4]
    for one, other in zip(narrow[1:], wide[1:], strict=True):
        assert one.ends == other.ends == (HALVING, HALVING)
        assert other.value[[0, -1]] == pytest.approx(one.value[[0, -1]], abs=1e-3)
    for one, other in zip(narrow, wide, strict=True):
        doublings = [special_values(some, PERIOD_DOUBLING, below=2.0) for some in (one, other)]
        assert len(doublings[0]) == 2
        assert doublings[1] == pytest.approx(doublings[0], abs=1e-9)


def test_every_branch_that_meets_orbits_of_half_its_period_ends_at_a_doubling():
    """The range is wide: between a doubling and the next one, orbits change little."""
    machine = {"stiffness": 0.246, "damping": 0.098, "stop": 7.284, "frequency": 0.953}
    found = branches(4, "force.one.amplitude", 0.0, 30.0, **machine, mean=0.493, count=5)
    met = 0
    for branch in found:
        halves = [one for one in found if 2 * one.period == branch.period]
        doublings = [s.value for one in halves for s in one.specials if s.kind == PERIOD_DOUBLING]
        for reason, end in zip(branch.ends, branch.value[[0, -1]], strict=True):
            if reason == HALVING:
                assert np.min(np.abs(np.array(doublings) - end)) < 1e-3
                met += 1
    assert met > 20


def special_values(branch, kind, below):
    """Return the values at which a branch has special points of a kind, below a limit, in order."""
    return sorted(one.value for one in branch.specials if one.kind == kind and one.value < below)


def test_a_branch_ends_where_its_orbits_grow_without_bound():
    """A mass without damper, driven next to its natural frequency 1, far from its stops.

    Its amplitude is 1 / (1 - frequency^2).
    """
    machine = {"stiffness": 1.0, "damping": 0.0, "first": 1.0}
    text = MASS.format(**dict(BASE, **machine), swept="frequency", low=0.6, high=0.7)
    text = text.replace("half_clearance = 1.0", "half_clearance = 1e6")
    config = gearchaos.Configuration.from_toml(text, "mass.toml")
    system = gearchaos.System(config, at={"frequency": 0.6})
    small = 1.0 / 0.64
    branch = system.branch(system.orbit(guess=np.array([small, 0.0])), "frequency", 0.55, 1.5)
    assert branch.ends == (EDGE, GROWS)
    amplitude = branch.section[-1, 0, 0]
    assert 100.0 < amplitude / small < 110.0
    assert amplitude == pytest.approx(1.0 / (1.0 - branch.value[-1] ** 2), rel=1e-9)


@pytest.mark.parametrize(
    ("swept", "low", "high", "method"),
    [
        ("frequency", 0.9, 1.1, "taylor"),
        ("clearance.stop.half_clearance", 0.9, 1.1, "flow_map"),
    ],
)
def test_maps_are_used_where_the_values_of_a_parameter_share_them(swept, low, high, method):
    text = MASS.format(**BASE, swept=swept, low=low, high=high)
    text = text.replace('method = "taylor"', 'method = "flow_map"')
    config = gearchaos.Configuration.from_toml(text, "mass.toml")
    found = find_branches(gearchaos.run(config), longest=1)
    assert found.metadata["method"] == method
    series = branches(1, swept, low, high)
    assert len(found.branches) == len(series) > 0
    for one, other in zip(found.branches, series, strict=True):
        assert one.ends == other.ends
        kinds = [[special.kind for special in branch.specials] for branch in (one, other)]
        values = [[special.value for special in branch.specials] for branch in (one, other)]
        assert kinds[0] == kinds[1]
        assert values[0] == pytest.approx(values[1], abs=1e-9)


@pytest.mark.parametrize("method", ["flow_map", "taylor"])
def test_boundaries_of_machines_are_followed_by_series(method):
    text = MASS.format(**BASE | {"stiffness": 1.0}, swept="frequency", low=1.2, high=2.0)
    text = text.replace('method = "taylor"', f'method = "{method}"')
    text += """
[second_sweep]
parameter = "force.one.amplitude"
from = 0.2
to = 4.0
count = 9
"""
    config = gearchaos.Configuration.from_toml(text, "mass.toml")
    found = find_boundaries(gearchaos.run(config), lines=1)
    assert found.metadata["method"] == "taylor"
    grazing = [one for one in found.boundaries if one.kind == GRAZING]
    assert len(grazing) == 2
    for one in grazing:
        frequency, amplitude = one.values.T
        response = amplitude / np.hypot(1.0 - frequency**2, BASE["damping"] * frequency)
        assert response == pytest.approx(1.0, abs=1e-10)


def test_a_doubled_branch_may_fold_next_to_its_beginning():
    """It grazes the stop just after the period has doubled."""
    config = gearchaos.Configuration.from_toml(GRAZES_AT_ITS_BEGINNING, "machine.toml")
    found = find_branches(gearchaos.run(config), longest=2).branches
    folds = [one.value for branch in found for one in branch.specials if one.kind == FOLD]
    assert sum(abs(one - 0.3908259829) < 1e-9 for one in folds) == 1
    for branch in found:
        # Stability changes at special points only.
        values = sorted(one.value for one in branch.specials)
        (changes,) = np.nonzero(np.diff(branch.stable))
        for at in changes.tolist():
            low, high = sorted(branch.value[at : at + 2].tolist())
            assert any(low - 1e-9 <= one <= high + 1e-9 for one in values)
