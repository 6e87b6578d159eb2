"""Curves of Neimark-Sacker points over two parameters agree with exact points and other orbits.

The exact points come from event-located matrix exponentials, shooting and arclength continuation.
"""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gearchaos_kernels import Plan

import gearchaos
from gearchaos.dynamics.boundary_equations import Equations
from gearchaos.dynamics.boundary_following import following
from gearchaos.dynamics.boundary_passages import passed_of
from gearchaos.dynamics.side_by_side import run
from gearchaos.engine.bounding import find_boundaries
from gearchaos.engine.running import one_thread
from gearchaos.models.registry import system_of
from gearchaos.records.boundary import RESONANCES, STRONG_RESONANCE_12, WEAKER_RESONANCES
from gearchaos.records.branch import EDGE, NEIMARK_SACKER, PERIOD_DOUBLING

SWEEPS = Path(__file__).parents[2] / "sweeps"
EXACT = json.loads((Path(__file__).parents[1] / "data" / "continuation.json").read_text())
(LOST,) = EXACT["two_masses"]["neimark_sacker"]
STOP = 100.0
"""Stiffness of the stop at the exact points."""

LIMITS = np.array([[0.6, 5.0], [0.635, STOP]])
"""Lowest and highest frequency and stiffness of the stop."""

QUICK = ["integration.method='flow_map'", "integration.recorded_periods=40"]
QUICK += ["outputs.section_points=4", "integration.transient_periods=300"]


def axis(table, parameter, low, high, count):
    """Return the override that sweeps a parameter."""
    keys = f"parameter='{parameter}', from={low}, to={high}, count={count}"
    return f"{table}={{{keys}}}"


@cache
def masses():
    """Return the configuration of the two masses over frequency and stiffness of the stop."""
    config = gearchaos.load_config(
        SWEEPS / "two_masses.toml",
        [
            *QUICK,
            "start={kind='rest'}",
            axis("sweep", "frequency", 0.6, 0.635, 12),
            axis("second_sweep", "clearance.stop.stiffness", 5.0, STOP, 9),
        ],
    )
    assert config.second_sweep is not None
    return config


@cache
def curve_of_masses():
    """Return the only curve of the two masses."""
    (found,) = find_boundaries(gearchaos.run(masses()), lines=0).boundaries
    assert found.kind == NEIMARK_SACKER
    return found


@cache
def pair():
    """Return the boundaries of the gear pair around two 1:2 resonances, and its configuration."""
    config = gearchaos.load_config(
        SWEEPS / "speed_and_error.toml",
        [
            *QUICK,
            axis("sweep", "mesh_frequency", 0.98, 1.04, 7),
            axis("second_sweep", "pitch_error", 7.2, 9.2, 7),
        ],
    )
    return find_boundaries(gearchaos.run(config), lines=0), config


def orbit(config, values, state):
    """Return the orbit at values of both parameters, computed again from a state near it."""
    named = {
        sweep.parameter: float(value)
        for sweep, value in zip(config.sweeps.values(), values, strict=True)
    }
    system = gearchaos.System(config.replace("start", {"kind": "rest"}), **named)
    return system.orbit(guess=state)


def on_circle(config, curve, chosen):
    """Return a multiplier of each orbit computed again at some points of a curve.

    The product of this multiplier and another one is the closest to 1.
    """
    pairs = []
    for values, section in zip(curve.values[chosen], curve.section[chosen], strict=True):
        multipliers = orbit(config, values, section[-1]).multipliers
        product = np.abs(np.multiply.outer(multipliers, multipliers) - 1.0)
        np.fill_diagonal(product, np.inf)
        pairs.append(multipliers[np.argmin(product.min(axis=1))])
    return np.array(pairs)


def test_a_curve_meets_the_exact_point_at_the_edge_of_the_range():
    curve = curve_of_masses()
    at_edge = curve.values[np.argmax(curve.values[:, 1])]
    assert at_edge[1] == STOP
    assert at_edge[0] == pytest.approx(LOST, abs=1e-9)


def test_a_curve_does_not_depend_on_the_map():
    config = masses().replace("sweep.count", 9).replace("second_sweep.count", 6)
    (other,) = find_boundaries(gearchaos.run(config), lines=0).boundaries
    curve = curve_of_masses()
    ends = [one.values[[0, -1]][np.argsort(one.values[[0, -1], 1])] for one in (curve, other)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert {*curve.ends} == {*other.ends}
    resonances = [[point.values for point in one.points] for one in (curve, other)]
    assert np.array(resonances[0]) == pytest.approx(np.array(resonances[1]), abs=1e-8)


def test_orbits_on_a_curve_have_a_pair_on_the_unit_circle():
    curve = curve_of_masses()
    pairs = on_circle(masses(), curve, slice(None, None, 5))
    assert np.abs(pairs) == pytest.approx(1.0, abs=1e-8)
    (weak,) = curve.points
    turning = weak.multipliers[np.argmin(np.abs(np.abs(weak.multipliers) - 1.0))]
    assert turning.real == pytest.approx(WEAKER_RESONANCES[weak.kind], abs=1e-8)


def test_a_curve_begins_and_ends_at_resonances_1_2_of_period_doublings():
    found, _ = pair()
    doublings = [one for one in found.boundaries if one.kind == PERIOD_DOUBLING]
    places = [point.values for one in doublings for point in one.points if point.kind in RESONANCES]
    (curve,) = [one for one in found.boundaries if one.kind == NEIMARK_SACKER]
    assert len(places) == 2
    assert {*curve.ends} == {STRONG_RESONANCE_12}
    for end in curve.values[[0, -1]]:
        assert min(np.abs(end - place).max() for place in places) < 1e-7


def test_a_pair_near_1_2_stays_on_the_unit_circle():
    found, config = pair()
    (curve,) = [one for one in found.boundaries if one.kind == NEIMARK_SACKER]
    near = np.array([1, 2, 3, -4, -3, -2]) % curve.arclength.size
    pairs = on_circle(config, curve, near)
    assert np.abs(pairs) == pytest.approx(1.0, abs=1e-8)
    assert (pairs.real < -0.9).any()
    assert (pairs.imag != 0.0).all()


def test_starts_on_one_curve_become_parts_of_it():
    curve, (low, high) = curve_of_masses(), LIMITS
    plan = Plan(24, 0, 1, 1, tangent=True, method="flow_map")
    scale = np.abs(curve.section[:, -1]).max(axis=0)

    def system_at(shares):
        values = (low + shares * (high - low)).T
        named = dict(zip(("frequency", "clearance.stop.stiffness"), values, strict=True))
        return system_of(masses(), named, masses().needed_effects)

    equations = Equations(system_at, plan, 1, scale, NEIMARK_SACKER)
    starts = []
    for at in (3, 8, curve.arclength.size - 4):
        shares = (curve.values[at] - low) / (high - low)
        guess = np.concatenate([curve.section[at, -1] / scale, shares])
        starts.append(equations.begun(guess, np.eye(guess.size)[-2]))
    with one_thread():
        (path,) = run(following(equations, starts), passed_of)
    places = np.array([one.place for one in path.points])
    steps = np.diff(places, axis=0)
    assert (np.sum(steps[1:] * steps[:-1], axis=1) > 0.0).all()
    for start in starts:
        assert np.abs(places - start.place).max(axis=1).min() < 1e-9
    assert path.ends == (EDGE, EDGE)
