"""The accuracy command measures the true errors of settings, and recommends measured ones."""

import re

import numpy as np
import pytest

import gearchaos
from gearchaos.accuracy import FLOW_MAP_STEPS, TRUTH_STEPS, measure, recommendation
from gearchaos.engine.run_plan import plan_run
from gearchaos.engine.steps import Candidate, pilot

from ..kernels.reference import SOLUTIONS
from .commands import names_in, run_module
from .short_sweeps import PAN2021
from .test_contact_outputs import AXIAL

PLAIN = tuple(word for one in AXIAL for word in ("--set", one))
"""A scene for which other tests also compile plain steps."""
SHORT = ("--set", "integration.transient_periods=150", "--steps", "50,100,200", "--lanes", "5")
SHORT += PLAIN


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    folder = tmp_path_factory.mktemp("accuracy")
    return run_module("gearchaos.accuracy", str(PAN2021), *SHORT, cwd=folder), folder


def test_the_table_is_all_that_stdout_holds_and_ends_with_recommendations(ended):
    run, folder = ended
    assert run.code == 0
    lines = run.out.splitlines()
    assert len(lines) == 1 + 6 + len(FLOW_MAP_STEPS) + 3
    assert [int(line.split()[0]) for line in lines[1:-3]] == [50, 100, 200] * 2 + [*FLOW_MAP_STEPS]
    for line, error in zip(lines[-3:], ("1e-04", "1e-06", "1e-08"), strict=True):
        assert re.fullmatch(
            rf"For an error of {error}: (\d+ (plain|resolved|flow map) steps per period\."
            r"|none of these; give finer --steps\.)",
            line,
        )
    assert names_in(folder) == [f"pan2021_first_accuracy.{end}" for end in ("pdf", "png")]


def test_other_files_are_kept_and_figures_of_the_command_are_replaced(ended, tmp_path):
    other = tmp_path / "mine_accuracy.png"
    other.write_bytes(b"not a figure of this command")
    few = ("--set", "integration.transient_periods=20", *PLAIN, "--steps", "100", "--lanes", "3")
    few += ("--output", str(tmp_path / "mine_accuracy"))
    again = run_module("gearchaos.accuracy", str(PAN2021), *few, cwd=tmp_path)
    assert again.code == 4 and "--overwrite" in again.err
    assert other.read_bytes() == b"not a figure of this command"
    own = ended[1] / "pan2021_first_accuracy.png"
    other.write_bytes(own.read_bytes())
    assert run_module("gearchaos.accuracy", str(PAN2021), *few, cwd=tmp_path).code == 0
    assert other.read_bytes() != own.read_bytes()


@pytest.mark.parametrize("steps", ["0", "x", "", "100000"])
def test_senseless_steps_are_refused(tmp_path, steps):
    run = run_module("gearchaos.accuracy", str(PAN2021), "--steps", steps, cwd=tmp_path)
    assert run.code == 2
    assert "Traceback" not in run.err
    assert names_in(tmp_path) == []


def test_resolved_errors_fall_with_order_four_and_lie_below_plain_ones():
    overrides = ["integration.transient_periods=150", "sweep.to=10.0", *AXIAL]
    simulation = plan_run(gearchaos.load_config(PAN2021, overrides))
    found = {(s.mode, s.steps): s for s in measure(simulation, [100, 200, 400], 6)}
    errors = [found["resolved", steps].section_error for steps in (100, 200, 400)]
    order = -np.polyfit(np.log([100, 200, 400]), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.3)
    for steps in (200, 400):
        plain, resolved = found["plain", steps], found["resolved", steps]
        assert resolved.section_error < 0.1 * plain.section_error


def test_the_cheapest_setting_that_is_good_enough_is_recommended():
    settings = [
        Candidate(100, 1e-5, 1e-5, 0.0, 1.0, "plain", 1.0),
        Candidate(100, 1e-7, 1e-7, 0.0, 1.0, "resolved", 2.0),
        Candidate(400, 1e-7, 1e-7, 0.0, 1.0, "plain", 3.0),
    ]
    assert "100 plain" in recommendation(settings, 1e-4)
    assert "100 resolved" in recommendation(settings, 1e-6)
    assert "none of these" in recommendation(settings, 1e-8)


@pytest.mark.parametrize(
    ("arguments", "cause"),
    [
        (("--steps", "10,50"), "RK4 is unstable below 16 steps per period"),
        (("--set", "outputs.section=[]"), "needs a section to measure errors on"),
        (
            ("--steps", "50,100", "--set", "sweep.from=13.3", "--set", "sweep.to=13.5"),
            "because none of the tried lanes moves periodically",
        ),
    ],
)
def test_settings_on_which_no_error_can_be_measured_are_named(tmp_path, arguments, cause):
    few = ("--lanes", "5", *PLAIN, *arguments)
    ended = run_module("gearchaos.accuracy", str(PAN2021), *few, cwd=tmp_path)
    assert ended.code == 2
    assert cause in ended.err
    assert "Traceback" not in ended.err
    assert names_in(tmp_path) == []


def test_the_truth_is_that_of_the_stored_orbits():
    stored = {
        orbit["pitch_error"]: orbit
        for orbit in SOLUTIONS["periodic_orbits"]
        if orbit["scene"] == "no_axial" and orbit["pitch_error"] in (5.86, 10.75)
    }
    values = f"sweep={{parameter='pitch_error', values={[*stored]}}}"
    sweep = plan_run(gearchaos.load_config(PAN2021, [values]))
    _, motion = pilot(sweep.lanes, sweep.plan, 2, TRUTH_STEPS)
    truth = motion(TRUTH_STEPS, True, "flow_map")
    for lane, orbit in enumerate(stored.values()):
        # The mean over 150 periods has an error of up to 1e-6.
        assert truth.exponent[lane] == pytest.approx(orbit["largest_exponent"], abs=1e-6)
        expected = np.array([state[0] for state in orbit["section_points"]])
        apart = np.abs(truth.section[lane, :, :1] - expected)
        # The configuration gives its groups with six digits.
        assert apart.min(axis=1).max() < 1e-7
        assert apart.min(axis=0).max() < 1e-7
