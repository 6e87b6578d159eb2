"""Contact outputs of a lane: names, states in words, and when they can be reported."""

import json

import numpy as np
import pytest
from gearchaos_kernels import Plan
from matplotlib.figure import Figure

import gearchaos
from gearchaos import load_config
from gearchaos.engine.kept import variables_of
from gearchaos.figures import bifurcation
from gearchaos.models import Configuration
from gearchaos.records.contact import CONTACT_STATES, contact_summary
from gearchaos.results.reading.ensembles import motion_shares

from .commands import run_module
from .short_sweeps import PAN2021, SHORT, simulation

WAYS = ("tangential", "axial")
AXIAL = (
    'scene.effects=["pitch_error", "stiffness_variation", "backlash", "transverse", "axial"]',
    *(f"groups.axial_{what}_{gear}=0.1" for what in ("stiffness", "damping") for gear in "pg"),
)
ASKED = (
    *("outputs.contact=true", "outputs.loads=true"),
    *("integration.transient_periods=60", "sweep.count=6", *AXIAL),
)
"""Contact and loads together, as in other tests: all use the same compiled loop."""


def test_the_four_states_of_contact():
    driving, back, on_driving, on_back = np.array(
        [
            [10.0, 0, 0, 0],
            [0, 10.0, 0, 0],
            [6.0, 0, 5, 0],
            [0, 2.0, 0, 1],
            [4.0, 3.0, 2, 2],
            [0, 0, 0, 0],
        ]
    ).T
    speeds = 0.5 * (on_driving + on_back)
    contact = np.stack([driving, on_driving, back, on_back, speeds, 0.7 * speeds], axis=1)
    found = contact_summary(contact, 10)
    assert [CONTACT_STATES[state] for state in found["contact_state"]] == [
        "held",
        "held",
        "single_sided_impact",
        "single_sided_impact",
        "double_sided_impact",
        "free",
    ]
    assert found["time_apart"].tolist() == pytest.approx([0, 0, 0.4, 0.8, 0.3, 1])
    assert found["approach_mean"][2:5].tolist() == [0.5, 0.5, 0.5]
    assert np.isnan(found["approach_mean"][[0, 1, 5]]).all()


def test_a_sweep_reports_the_contact_of_both_directions_and_its_file_keeps_it(tmp_path):
    config = load_config(PAN2021, [*SHORT, *ASKED])
    result = gearchaos.run(config)
    reported = [name for name in result.variables if not name.startswith(("mesh_force", "load_f"))]
    names = [name for name in reported if name.endswith("_tangential")]
    assert len(names) == len([name for name in reported if name.endswith("_axial")]) == 8
    without = [variable.name for variable in variables_of(simulation("outputs.contact=true"))]
    assert {*names} < {*without} and not any(name.endswith("_axial") for name in without)
    shares = sum(result[f"time_{where}_tangential"] for where in ("driving", "back", "apart"))
    assert shares == pytest.approx(1.0)
    crossed = result["crossings_per_period"]
    ways = [f"impacts_{flank}_{way}" for flank in ("driving", "back") for way in WAYS]
    impacts = sum(result[name] for name in ways)
    # A departure follows every impact, except for one impact per direction at the very end.
    most = len(WAYS) / config.integration.recorded_periods
    assert np.abs(crossed - 2.0 * impacts).max() <= most + 1e-12
    settings = [f"--set={one}" for one in (*SHORT, *ASKED)]
    assert run_module("gearchaos.sweep", str(PAN2021), *settings, cwd=tmp_path).code == 0
    kept = gearchaos.open_result(next(tmp_path.glob("*.h5")))
    for name in names:
        assert np.array_equal(kept[name], result[name], equal_nan=True), name
    assert kept.variables["contact_state_tangential"].flags == CONTACT_STATES


def test_the_stages_list_the_values_of_each_kind_of_contact(tmp_path):
    result = gearchaos.run(load_config(PAN2021, [*SHORT, *ASKED]))
    result.save(tmp_path / "contact.h5")
    done = run_module("gearchaos.stages", "contact.h5", "--json", cwd=tmp_path)
    listed = json.loads(done.out)["contact"]
    for way in WAYS:
        of_lanes = []
        for one in (one for one in listed if one["element"] == way):
            # The stretches follow each other, and begin and end at values of the sweep.
            first, last = len(of_lanes), len(of_lanes) + one["lanes"] - 1
            ends = result["pitch_error"][[first, last]].tolist()
            assert [one["start"], one["end"]] == ends
            of_lanes += one["lanes"] * [one["contact"].replace(" ", "_")]
        states = result[f"contact_state_{way}"]
        assert of_lanes == [CONTACT_STATES[state] for state in states]
    table = run_module("gearchaos.stages", "contact.h5", cwd=tmp_path).out
    assert f"contact, tangential: {listed[0]['contact']}" in table
    with pytest.raises(gearchaos.FigureError, match=r"has kinds \(held, .*a diagram draws numbers"):
        bifurcation(Figure().add_subplot(), result, "contact_state_tangential")


def test_what_is_reported_of_each_lane_can_be_drawn_over_the_parameter():
    result = gearchaos.run(load_config(PAN2021, [*SHORT, *ASKED]))
    axes = Figure().add_subplot()
    drawn = bifurcation(axes, result, "time_apart_tangential")
    assert drawn.points.get_ydata() == pytest.approx(result["time_apart_tangential"])
    assert "without contact" in " ".join(axes.get_ylabel().split())
    with pytest.raises(gearchaos.FigureError, match=r"no variable 'nothing'.*approach_largest"):
        bifurcation(axes, result, "nothing")


def test_contact_is_unknown_where_nothing_is_crossed():
    for other in ('scene.effects=["pitch_error"]', "integration.crossings=plain"):
        with pytest.raises(gearchaos.ConfigurationError, match=r"outputs\.contact = true: follows"):
            load_config(PAN2021, ["outputs.contact=true", other])


def test_a_plan_keeps_it_only_where_it_is_asked_for():
    assert not Plan(200, 0, 1, 0).contact
    assert "contact_state_tangential" not in gearchaos.run(load_config(PAN2021, SHORT)).variables


GROWING = """
[groups]
mesh_frequency = 0.8
load = 0.1
damping_ratio = 0.01
base_helix_angle_deg = 0.0
half_backlash = 1.0
stiffness_cosine = [0.9]
pitch_error_amplitude = 0.01
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
[start]
kind = "random"
count = 6
spread = 3.0
[sweep]
parameter = "stiffness_variation_scale"
values = [0.0, 1.2, 3.0]
[outputs]
contact = true
[integration]
steps_per_period = 100
transient_periods = 200
recorded_periods = 200
"""
"""Motions that stay in contact, that grow while they hit both flanks, and that diverge."""


def test_lanes_without_a_whole_record_have_no_kind_of_contact():
    result = gearchaos.run(Configuration.from_toml(GROWING))
    state, status = result["contact_state_tangential"], result["status"]
    assert (status[2] != 0).all() and (status[0] == 0).all()
    flags = result.variables["contact_state_tangential"].flags
    assert ((state == flags.index("diverged")) == (status != 0)).all()


def test_motions_that_grow_lose_contact_though_their_time_apart_rounds_to_nothing():
    result = gearchaos.run(Configuration.from_toml(GROWING))
    grown = np.abs(result["section_delta_5"][1]).max(axis=1) > 1e9
    assert grown.any() and (result["impacts_back_tangential"][1][grown] > 0.0).all()
    counted = motion_shares(result).apart
    assert counted.counts[1] == np.sum(result["status"][1] == 0)
