"""Extremes of gaps along orbits, where another element changes its contact just before them."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate
from scipy.integrate import solve_ivp

import gearchaos
from gearchaos.dynamics.gap_extremes import nearest_extremes
from gearchaos.models.registry import system_of

TWO_STOPS = """
[model]
kind = "linear"
coordinates = ["x"]
mass = [1.0]
stiffness = [0.3]
damping = [0.1]
frequency = 1.0

[clearance.soft]
gap = { x = 1.0 }
stiffness = 40.0
half_clearance = 0.95

[clearance.stop]
gap = { x = 1.0 }
stiffness = 50.0
half_clearance = 1.0

[force.one]
on = { x = 1.0 }
amplitude = 0.2

[sweep]
parameter = "frequency"
values = [1.0]
"""
STOP = 2
"""Number of the upper flank of the second element."""


def exact_maximum(start):
    """Return the largest x over a period of a motion that does not meet the hard stop."""

    def rates(time, state):
        x, speed = state
        beyond = np.sign(x) * max(abs(x) - 0.95, 0.0)
        return [speed, 0.2 * np.cos(time) - 0.1 * speed - 0.3 * x - 40.0 * beyond]

    def soft(_, state):
        return abs(state[0]) - 0.95

    def turns(_, state):
        return state[1]

    turns.direction = -1.0
    soft.terminal = True
    found, time, state = [], 0.0, np.array(start)
    while time < 2.0 * np.pi:
        # The step beyond a kink begins a little behind it.
        done = solve_ivp(
            rates,
            (time, 2.0 * np.pi),
            state,
            "DOP853",
            events=(soft, turns),
            rtol=1e-13,
            atol=1e-14,
        )
        found += [one[0] for one in done.y_events[1]]
        time, state = done.t[-1], done.y[:, -1]
        if done.status != 1:
            break
        ahead = solve_ivp(rates, (time, time + 1e-9), state, rtol=1e-13, atol=1e-14)
        time, state = ahead.t[-1], ahead.y[:, -1]
    return max(found)


@pytest.mark.parametrize(("method", "steps"), [("flow_map", 24), ("taylor", 24), ("taylor", 8)])
@pytest.mark.parametrize("start", [(0.2, 0.44), (0.3, 0.44), (0.5, 0.4), (0.8, 0.3)])
def test_an_extreme_behind_a_change_of_another_element_is_exact(start, method, steps):
    """The soft stop is met less than a step before the mass turns next to the hard one."""
    config = gearchaos.Configuration.from_toml(TWO_STOPS, "stops.toml")
    system = system_of(config, {"frequency": np.array([1.0])})
    plan = Plan(steps, 0, 1, 1, method=method, history_periods=1)
    history = integrate(system, np.array([start]), plan).history
    beyond, _ = nearest_extremes(system, plan, history, np.array([STOP]), np.array([np.nan]))
    assert beyond[0] == pytest.approx(exact_maximum(start) - 1.0, abs=1e-11)
    assert -0.05 < beyond[0] < 0.0
