"""``integration.method = "auto"`` chooses a method."""

import json

import numpy as np
import pytest
from gearchaos_kernels import METHODS

import gearchaos
from gearchaos.configuration.methods import INTEGRATORS
from gearchaos.engine.method_choice import with_method
from gearchaos.engine.run_plan import plan_run
from gearchaos.identification.loading import load_targets

from .commands import run_module
from .short_sweeps import PAN2021, SHORT

AUTO = "integration.method='auto'"
ALONE = "sweep={parameter='mesh_frequency',from=0.8,to=0.9,count=8}"
GRADES = "pitch_error={kind='grade',grade=5,realisations=2}"


def chosen(*overrides):
    config, note = with_method(gearchaos.load_config(PAN2021, (AUTO, *overrides)))
    return config.integration.method, note


def test_lanes_that_share_maps_take_them():
    method, note = chosen("sweep.count=300")
    assert method == "flow_map"
    assert note.startswith('integration.method = "auto": flow_map is taken; rk4 is estimated to')


def test_a_few_lanes_with_maps_of_their_own_take_rk4():
    method, note = chosen(ALONE)
    assert method == "rk4"
    assert "rk4 is taken; flow_map is estimated to take" in note


def test_a_long_record_repays_the_making_of_maps_where_steps_must_be_short():
    coarse = ALONE, "integration.steps_per_period=200"
    fine = ALONE, "integration.steps_per_period=6400", "integration.recorded_periods=100000"
    assert [chosen(*coarse)[0], chosen(*fine)[0]] == ["rk4", "flow_map"]


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("integration.crossings='plain'", "has no meaning with integration.method"),
        ("scene.effects=['pitch_error','friction']", '"friction" cannot be computed with'),
    ],
)
def test_what_flow_maps_cannot_compute_is_named(override, reason):
    friction = "groups.friction_coefficient=0.1", "groups.friction_lever=0.4"
    method, note = chosen(override, *(friction if "friction" in override else ()))
    assert method == "rk4"
    assert note.startswith('integration.method = "auto": rk4 is taken; with flow_map: ')
    assert reason in note


def test_given_steps_are_those_of_rk4():
    steps = [
        plan_run(gearchaos.load_config(PAN2021, (AUTO, *more, "integration.steps_per_period=240")))
        for more in ((), (ALONE,))
    ]
    assert [run.plan.steps_per_period for run in steps] == [12, 240]


def test_a_named_method_is_kept():
    config = gearchaos.load_config(PAN2021)
    assert with_method(config) == (config, "")


def test_the_result_is_that_of_the_chosen_method():
    overrides = [*SHORT, "integration.steps_per_period=200", "integration.transient_periods=500"]
    auto = gearchaos.run(gearchaos.load_config(PAN2021, [*overrides, AUTO]))
    maps = gearchaos.load_config(PAN2021, overrides).integrated_by("flow_map")
    np.testing.assert_array_equal(auto["section_delta_5"], gearchaos.run(maps)["section_delta_5"])
    # The configuration text stays as given; the resolved configuration has the chosen method.
    assert 'method = "auto"' not in auto.metadata["configuration_resolved"]
    assert auto.metadata["method"] == "flow_map"
    assert auto.metadata["method_description"] == (
        "flow maps: maps of whole steps that are exact between crossings and at them; 12 steps per "
        "period, resolved crossings"
    )


def test_kernels_and_configurations_know_the_same_methods():
    assert [*METHODS] == [one.name for one in INTEGRATORS]
    for one in INTEGRATORS:
        compiled = METHODS[one.name]
        assert compiled.always_resolved == one.always_resolved
        # A step without an error is stable at any length.
        assert (compiled.stable_reach is None) == one.exact


def test_a_system_takes_the_method_as_well():
    config = gearchaos.load_config(PAN2021, [AUTO])
    system = gearchaos.System(config, pitch_error=5.0)
    assert system.config.integration.method in ("rk4", "flow_map")
    assert system.stability_limit() >= 1


def test_a_dry_run_compares_both_methods(tmp_path):
    overrides = [f"--set={one}" for one in (*SHORT, AUTO)]
    ended = run_module("gearchaos.sweep", str(PAN2021), "--dry-run", *overrides, cwd=tmp_path)
    (line,) = [one for one in ended.err.splitlines() if one.startswith("compared:")]
    assert "rk4 about" in line and "flow_map about" in line
    overrides.append("--json")
    ended = run_module("gearchaos.sweep", str(PAN2021), "--dry-run", *overrides, cwd=tmp_path)
    facts = json.loads(ended.out)
    assert set(facts["seconds_of_methods"]) == {"rk4", "flow_map"}
    assert facts["seconds_of_methods"][facts["method"]] == facts["seconds"]


def test_an_identification_takes_a_method_as_well():
    targets = PAN2021.with_name("pan2021_targets.toml")
    given = gearchaos.load_config(PAN2021.with_name("pan2021.toml")).integration.method
    problem = load_targets(targets, [f'set=["{AUTO}"]'])
    assert given == "rk4" and problem.config.integration.method in ("rk4", "flow_map")
