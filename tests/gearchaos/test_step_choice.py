"""Steps per period are chosen if none are given; given steps that are too coarse are reported."""

import re

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate

import gearchaos
from gearchaos.engine.choosing import with_chosen_steps
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.step_choice import (
    AMPLIFIED,
    PERIODS,
    WANTED,
    WRONG,
    Trial,
    Verdict,
    coarse_note,
)
from gearchaos.models import Configuration

from .commands import run_module, small_config
from .random_pairs import random_configuration
from .short_sweeps import PAN2021

COARSE = [38, 104, 106, 137, 149, 293]
"""Pairs that are stable with 200 steps and have an error of more than 1 %."""

UNSTABLE = [14, 64, 284]  # Pairs for which 200 steps are too few to be stable.
ORDINARY = [0, 1, 2, 30, 31, 32]


def prepared(number: int, steps: int | None = None) -> RunPlan:
    config = Configuration.from_toml(random_configuration(number, steps))
    return with_chosen_steps(plan_run(config))


def error_with(simulation: RunPlan, steps: int) -> float:
    """Return the error after the last period compared with eight times the chosen steps."""
    lane = np.arange(1)
    system, start = simulation.lanes.system_of(lane), simulation.lanes.start_of(lane)
    plan = simulation.plan._replace(
        transient_periods=0, recorded_periods=PERIODS, section_points=PERIODS
    )
    found, truth = (
        integrate(system, start, plan._replace(steps_per_period=count)).section[0]
        for count in (steps, 8 * simulation.plan.steps_per_period)
    )
    return float(np.max(np.abs(found[-1] - truth[-1]) / np.max(np.abs(truth), axis=0)))


def told(simulation: RunPlan, words: str) -> list[str]:
    return [note for note in simulation.notes if words in note]


@pytest.mark.parametrize("number", [*COARSE, *UNSTABLE, *ORDINARY])
def test_no_pair_is_wrong_with_the_steps_that_are_chosen_for_it(number):
    simulation = prepared(number)
    steps = simulation.plan.steps_per_period
    # The steps are 200, doubled as often as necessary.
    assert steps % 200 == 0 and (steps // 200).bit_count() == 1
    assert error_with(simulation, steps) < WRONG
    (note,) = told(simulation, f"integration.steps_per_period = {steps}, chosen for this scene")
    assert not told(simulation, "too coarse")
    if number in (*COARSE, *UNSTABLE):
        assert steps > 200, note


@pytest.mark.parametrize("number", COARSE)
def test_a_given_number_that_is_too_coarse_is_reported_with_one_that_is_not(number):
    simulation = prepared(number, 200)
    assert simulation.plan.steps_per_period == 200
    (note,) = told(simulation, "integration.steps_per_period = 200 is too coarse")
    better = int(re.search(r"set it to (\d+)", note).group(1))
    fine = prepared(number, better)
    assert not told(fine, "too coarse")
    assert error_with(fine, better) < WRONG < error_with(fine, 200)


@pytest.mark.parametrize("number", ORDINARY[:3])
def test_a_given_number_that_is_fine_enough_is_not_spoken_of(number):
    assert prepared(number, 800).notes == ()


@pytest.mark.parametrize("number", [104, 149])
def test_the_error_that_is_reported_is_that_against_much_finer_steps(number):
    simulation = prepared(number)
    trial = Trial(simulation.lanes, simulation.plan)
    # Twice the steps leave a sixteenth of the error, or more if they are still too coarse.
    for steps in (400, 800):
        found = trial.verdict(steps).error[0]
        assert found == pytest.approx(error_with(simulation, steps), rel=0.1)


def test_chaos_is_reported_and_does_not_ask_for_ever_more_steps():
    simulation = prepared(356)
    trial = Trial(simulation.lanes, simulation.plan)
    verdict = trial.verdict(200)
    # The tangent vector grows e^10 times. Any error grows as much, with any number of steps. A norm
    # with other weights differs by a factor, not by an order of magnitude.
    grown = integrate(
        simulation.lanes.system_of(np.arange(1)), np.zeros((1, 10)), Plan(1600, 0, 12, 0, True)
    ).growth.sum()
    assert np.log(verdict.granted[0] * AMPLIFIED) == pytest.approx(grown, abs=np.log(10.0))
    assert WANTED < verdict.error[0] < WANTED * verdict.granted[0]
    assert simulation.plan.steps_per_period == 200
    (note,) = simulation.notes
    assert "in 1 of them any error grows more than 100 times" in note
    # A given number of steps has the same note; its error is large enough to be reported.
    coarse = prepared(356, 100)
    (note,) = told(coarse, "any error grows")
    assert coarse.plan.steps_per_period == 100 and "off by up to" in note


def test_flow_maps_have_their_own_number():
    config = Configuration.from_toml(random_configuration(104))
    simulation = plan_run(config.replace("integration", {"method": "flow_map"}))
    simulation = with_chosen_steps(simulation)
    assert simulation.plan.steps_per_period == 12
    assert not told(simulation, "chosen") and not told(simulation, "coarse")


def test_a_tolerance_leaves_the_number_of_flow_maps():
    config = gearchaos.load_config(PAN2021, ["sweep.count=5", "outputs.lyapunov=false"])
    integration = {"method": "flow_map", "tolerance": 1e-6}
    chosen = with_chosen_steps(plan_run(config.replace("integration", integration)))
    assert chosen.plan.steps_per_period == 12


def test_a_motion_at_rest_has_no_error_to_judge():
    still = {"operation.torque_Nm": 0.0, "pitch_error.amplitude_um": 0.0}
    config = Configuration.from_toml(random_configuration(0))
    for key, value in still.items():
        config = config.replace(key, value)
    simulation = plan_run(config)
    assert Trial(simulation.lanes, simulation.plan).verdict(200).error.tolist() == [0.0]


def test_the_lane_with_the_fastest_mode_is_tried_wherever_it_is():
    # The fastest lane has the lowest mesh frequency and the stiffest bearing. It is neither the
    # first lane nor the last.
    swept = (
        "sweep={parameter='mesh_frequency', from=0.5, to=1.5, count=101}",
        "second_sweep={parameter='transverse_stiffness_p', from=1.0, to=5000.0, count=5}",
        "groups.pitch_error=1.0",
    )
    config = gearchaos.load_config(PAN2021, swept)
    simulation = plan_run(config.replace("integration.steps_per_period", None))
    fastest = 4 * 101
    assert fastest not in simulation.lanes.spread(48)
    trial = Trial(simulation.lanes, simulation.plan)
    assert fastest in trial.numbers and trial.numbers.size == 49
    # An undamped mode is stable up to a phase of sqrt(8) per step.
    limit = 2.0 * np.pi / 0.5 * np.sqrt(5000.0 / 8.0)
    assert trial.limit == pytest.approx(limit, rel=0.02)


def test_a_sweep_records_and_prints_its_choice_and_shards_agree_on_it(tmp_path):
    config = small_config(tmp_path)
    text = config.read_text("utf-8").replace("steps_per_period = 40\n", "")
    # A phase would need another compiled loop.
    text = text.replace("phase_deg = 30.0", "phase_deg = 0.0")
    config.write_text(text.replace("speed_rpm = 8000.0", "speed_rpm = 150.0"), "utf-8")
    few = ("gears.toml", "--set", "sweep.count=4")
    whole = run_module("gearchaos.sweep", *few, "-o", "whole.h5", cwd=tmp_path)
    assert whole.code == 0
    (printed,) = re.findall(r"steps_per_period = (\d+), chosen for this scene", whole.err)
    for number in "12":
        shard = ("-o", "parts.h5", "--shard", f"{number}/2")
        assert run_module("gearchaos.sweep", *few, *shard, cwd=tmp_path).code == 0
    assert run_module("gearchaos.merge", "parts.h5", cwd=tmp_path).code == 0
    one, joined = (gearchaos.open_result(tmp_path / f"{name}.h5") for name in ("whole", "parts"))
    assert int(printed) > 200
    assert one.metadata["steps_per_period"] == joined.metadata["steps_per_period"] == int(printed)
    assert "chosen for this scene" in one.metadata["notes"] == joined.metadata["notes"]
    assert one["end_state"].tobytes() == joined["end_state"].tobytes()
    # A system of the result takes the same steps, a system of a configuration as many as its sweep.
    system = gearchaos.System.of_lane(one, pitch_error=0.0)
    assert system.integrate(1).states.shape[0] == int(printed) + 1
    free = gearchaos.load_config(config, ["sweep={parameter='pitch_error',values=[5.0]}"])
    assert gearchaos.System(free).integrate(1).states.shape[0] == int(printed) + 1


def test_notes_name_a_better_number_only_if_there_is_one():
    one = np.ones(1)
    given = Verdict(13_000, 5.0 * WRONG * one, one)
    note = coarse_note(given, given)
    assert "no number up to 25600 is fine enough" in note and 'method = "flow_map"' in note
    assert "set it to 26000" in coarse_note(given, Verdict(26_000, 0.0 * one, one))
    lost = coarse_note(Verdict(200, np.inf * one, one), Verdict(400, 0.0 * one, one))
    assert "states leave the range of numbers in 1 of 1 lane" in lost
