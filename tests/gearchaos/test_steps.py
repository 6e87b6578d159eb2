"""With a tolerance, the number of steps follows from measured errors."""

import re

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.choosing import with_chosen_steps
from gearchaos.engine.steps import choose_steps
from gearchaos.errors import ConfigurationError
from gearchaos.records.difference import Solution
from gearchaos.records.label import PERIODIC, UNRESOLVED
from gearchaos.records.period import motion_period

from .short_sweeps import simulation

SHORT = (
    "integration.transient_periods=200",
    "integration.recorded_periods=20",
    "outputs.section_points=10",
    "integration.steps_per_period=25",
)


def tried_steps(notes: list[str]) -> list[int]:
    """Return the numbers of steps whose errors were measured, as the notes report."""
    return [int(note.split()[0]) for note in notes if "wanted is" in note]


def method_of_order_four(steps: int) -> Solution:
    """Return lanes of period 1 whose section and exponent have the error 100 steps^-4."""
    error = 100.0 * steps**-4.0
    lanes = np.linspace(0.5, 1.5, 20)
    section = np.repeat((lanes + error)[:, np.newaxis, np.newaxis], 48, axis=1)
    return solution(section, -0.01 + error * np.ones(20))


def solution(section: np.ndarray, exponent: float | np.ndarray = np.nan) -> Solution:
    period = motion_period(section)
    motion = np.where(period > 0, PERIODIC, UNRESOLVED)
    diverged = np.zeros(20, dtype=bool)
    return Solution(section, np.broadcast_to(exponent, 20), diverged, motion, period)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_the_steps_are_the_first_doubling_that_reaches_the_tolerance(tolerance):
    candidates = choose_steps(method_of_order_four, 10, tolerance, "x.toml")
    assert [c.steps for c in candidates] == [10 * 2**k for k in range(len(candidates))]
    assert candidates[-1].error <= tolerance
    assert all(candidate.error > tolerance for candidate in candidates[:-1])
    exact = 100.0 * (candidates[-1].steps ** -4.0) * (1 - 4.0**-4)
    assert candidates[-1].section_error == pytest.approx(exact, rel=1e-6)


def test_a_tolerance_out_of_reach_is_refused_with_what_was_reached():
    with pytest.raises(ConfigurationError, match=r"x.toml: integration.tolerance = 1e-20: .* 5120"):
        choose_steps(method_of_order_four, 10, 1e-20, "x.toml")


def test_steps_that_are_exact_are_measured_once():
    with pytest.raises(ConfigurationError, match=r"is not reached, but 1.0e-02 with 10 steps"):
        choose_steps(method_of_order_four, 10, 1e-4, "x.toml", finest=40)
    sweep = simulation(*SHORT, "integration.method=flow_map", "integration.tolerance=1e-11")
    sweep = with_chosen_steps(sweep)
    assert tried_steps(sweep.notes) == [25] == [sweep.plan.steps_per_period]


def test_where_nothing_is_periodic_no_error_is_claimed():
    def noise(steps: int) -> Solution:
        return solution(np.random.default_rng(steps).uniform(size=(20, 48, 1)))

    with pytest.raises(ConfigurationError, match="none of the lanes"):
        choose_steps(noise, 10, 1e-3, "x.toml")


def test_a_sweep_takes_the_steps_that_its_tolerance_needs_and_keeps_the_measurement(tmp_path):
    sweeps = {}
    for tolerance in ("1e-3", "1e-6"):
        config = simulation(*SHORT, f"integration.tolerance={tolerance}").config
        result = gearchaos.run(config)
        result.save(tmp_path / f"{tolerance}.h5")
        sweeps[tolerance] = gearchaos.open_result(tmp_path / f"{tolerance}.h5")
    chosen = {}
    for tolerance, result in sweeps.items():
        told = result.metadata["notes"].splitlines()
        steps = tried_steps(told)
        assert steps[0] == 25
        assert result.metadata["steps_per_period"] == steps[-1]
        errors = [float(error) for error in re.findall(r"by (\S+?),", told[-1])]
        assert len(errors) == 2
        assert max(errors) <= float(tolerance)
        chosen[tolerance] = steps[-1]
    assert chosen["1e-6"] > chosen["1e-3"]


def test_the_choice_follows_from_the_configuration_alone():
    chosen = []
    for _ in range(2):
        sweep = simulation(*SHORT, "integration.tolerance=1e-5")
        sweep = with_chosen_steps(sweep)
        chosen.append((sweep.plan, sweep.notes))
    assert chosen[0] == chosen[1]
    assert chosen[0][1]


def test_without_a_tolerance_nothing_is_tried():
    sweep = simulation(*SHORT)
    sweep = with_chosen_steps(sweep)
    assert sweep.plan.steps_per_period == 25
    assert not tried_steps(sweep.notes)
