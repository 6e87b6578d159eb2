"""Lanes with their own harmonics of the mesh stiffness, against an independent integration.

The reference is an adaptive method of order 8. It integrates each lane separately and restarts at
every crossing.
"""

import numpy as np
import pytest
from gearchaos_kernels import GearPairs, Plan, integrate
from gearchaos_kernels.batch import scene_of
from gearchaos_kernels.evaluation import WITHOUT_LOOP, jacobian
from gearchaos_kernels.scene import provider_of

from .exact import Exact
from .reference import COSINE, NO_AXIAL, SINE, TORSION_ONLY, columns, drawn_teeth, pan2021
from .test_order import measured_order

PERIODS = 12
GROUPS = pan2021(np.array([5.86, 10.75, 8.0]), stiffness_variation_scale=np.array([1.0, 0.7, 1.3]))
RANDOM = np.random.default_rng(3)
COSINES, SINES = (wave * RANDOM.uniform(0.2, 1.5, (3, COSINE.size)) for wave in (COSINE, SINE))
START = np.zeros(10)
START[0] = 1.2


class OwnStiffness(Exact):
    """One lane with its own harmonics ``cosine`` and ``sine``."""

    def stiffness(self, tau):
        order = np.arange(1, COSINE.size + 1) * self.groups.mesh_frequency * tau
        variation = np.sum(self.cosine * np.cos(order) + self.sine * np.sin(order))
        return 1.0 + self.groups.stiffness_variation_scale * variation


def exact(effects, teeth=None, periods=PERIODS):
    """Return states, shape (lanes, periods, states), and the number of crossings of each lane."""
    found = []
    for lane, (cosine, sine) in enumerate(zip(COSINES, SINES, strict=True)):
        groups = GROUPS._replace(**{name: g[lane] for name, g in GROUPS._asdict().items()})
        if teeth is not None:
            groups = Numbered(groups, lane)
        reference = OwnStiffness(groups, effects, True, teeth, periods)
        reference.cosine, reference.sine = cosine, sine
        found.append(reference.follow(START, periods))
    return np.array([one.states[:, columns(effects)] for one in found]), [
        one.crossings for one in found
    ]


class Numbered:
    """Groups of a lane, and the number of its profile."""

    def __init__(self, groups, profile):
        self.__dict__.update(groups._asdict(), profile=profile)


def followed(system, method, steps, periods=PERIODS):
    """Return the outcome of a run of all periods."""
    start = np.tile(START[columns(system.effects)], (system.lanes, 1))
    plan = Plan(steps, 0, periods, periods, tangent=True, contact=True, method=method)
    return integrate(system, start, plan)


PAIRS = GearPairs(NO_AXIAL, GROUPS, COSINES, SINES)


def test_flow_maps_and_steps_of_lanes_with_own_harmonics_are_those_of_their_equations():
    states, crossings = exact(NO_AXIAL)
    assert min(crossings) > 5
    maps = followed(PAIRS, "flow_map", 48)
    assert np.abs(maps.section - states).max() < 1e-10
    assert maps.crossings.tolist() == crossings
    steps = np.array([200, 400, 800])
    runs = [followed(PAIRS, "rk4", int(count)).section for count in steps]
    errors = [np.abs(run - states).max() for run in runs]
    assert measured_order(errors, steps) > 3.8


@pytest.mark.parametrize("method", ["rk4", "flow_map"])
def test_a_lane_with_own_harmonics_does_not_depend_on_the_other_lanes(method):
    together = followed(PAIRS, method, 200)
    for chosen in ([1], [2, 0], slice(1, 3)):
        some = followed(PAIRS.of(chosen), method, 200)
        assert np.array_equal(some.section, together.section[chosen])
        assert np.array_equal(some.growth, together.growth[chosen])


@pytest.mark.parametrize("method", ["rk4", "flow_map"])
def test_own_harmonics_that_are_equal_are_shared_ones(method):
    shared = GearPairs(NO_AXIAL, GROUPS, COSINE, SINE)
    alike = (np.tile(wave, (3, 1)) for wave in (COSINE, SINE))
    own, expected = (
        followed(system, method, 200) for system in (GearPairs(NO_AXIAL, GROUPS, *alike), shared)
    )
    assert own.section == pytest.approx(expected.section, abs=1e-10)
    assert own.contact == pytest.approx(expected.contact, abs=1e-8)


def test_lanes_with_own_harmonics_have_errors_of_teeth_too():
    teeth, periods = drawn_teeth(5, 7, lanes=3), 6
    teeth = teeth._replace(driving=6.0 * teeth.driving, driven=6.0 * teeth.driven)
    # Lane n has profile n.
    teeth = teeth._replace(profile=np.arange(3))
    system = GearPairs(TORSION_ONLY, GROUPS, COSINES, SINES, teeth=teeth)
    states, crossings = exact(TORSION_ONLY, teeth, periods)
    assert max(crossings) > 0
    steps = np.array([400, 800, 1600])
    errors = [
        np.abs(followed(system, "rk4", int(count), periods).section - states).max()
        for count in steps
    ]
    assert errors[-1] < 1e-7 and measured_order(errors, steps) > 3.5


def test_branches_have_the_extremes_of_each_lane():
    turns = np.exp(-1j * np.outer(np.arange(1, 7), np.linspace(0.0, 2.0 * np.pi, 4001)))
    variation = ((COSINES + 1j * SINES) @ turns).real * GROUPS.stiffness_variation_scale[:, None]
    expected = [1.0 + variation.min(axis=1), 1.0 + variation.max(axis=1), np.zeros(3)]
    assert PAIRS.branch_stiffnesses()[:, :, 0] == pytest.approx(np.array(expected), abs=1e-3)


def test_a_system_without_own_harmonics_has_no_coefficients_of_them():
    for system in (PAIRS, PAIRS.linearised(), PAIRS.of([1]), PAIRS.of_unit_inputs()):
        names = provider_of(scene_of(system, WITHOUT_LOOP).model).lane._fields
        assert system.coefficients(np.ones(system.lanes)).shape == (system.lanes, len(names))
    shared = GearPairs(NO_AXIAL, GROUPS, COSINE, SINE)
    in_contact = np.ones((3, 1))
    assert np.array_equal(jacobian(PAIRS, in_contact), jacobian(shared, in_contact))
