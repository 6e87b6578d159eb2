"""A configuration file becomes tables, swept values and groups of the lanes, and TOML again."""

import json
import math
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from gearchaos.configuration.base import configuration_keys
from gearchaos.configuration.schema import json_schema, key_tables
from gearchaos.errors import ConfigurationError
from gearchaos.models import (
    Configuration,
    GearPairConfiguration,
    axis_values,
    load_config,
    swept_values,
)
from gearchaos.models.gear_pair import outputs as gear_pair
from gearchaos.models.gear_pair.group_table import GROUP_TABLE, SWEEPABLE_GROUPS
from gearchaos.models.gear_pair.scene import EFFECTS, STATES
from gearchaos.models.gear_pair.tables import groups_at

KEYS = configuration_keys(GearPairConfiguration)
KEY_TABLES = key_tables(GearPairConfiguration)


def lane_groups(config):
    """Return swept values and groups of a sweep of one parameter."""
    values = swept_values(config.sweep)
    return values, groups_at(config, {config.sweep.parameter: values})


ROOT = Path(__file__).resolve().parents[2]
TARGETS = set((ROOT / "sweeps").glob("*_targets.toml"))
SWEEPS = sorted(set((ROOT / "sweeps").glob("*.toml")) - TARGETS)
PAN2021 = ROOT / "sweeps" / "pan2021.toml"

SMALLEST = """
[groups]
mesh_frequency = 0.9
load = 0.3
damping_ratio = 0.03
base_helix_angle_deg = 0.0
[scene]
effects = []
[sweep]
parameter = "load"
values = [0.3, 0.1]
"""

PHYSICAL = """
[pair]
teeth = [21, 38]
normal_module_mm = 2.166
normal_pressure_angle_deg = 20.0
helix_angle_deg = 20.0
face_width_mm = 15.0
[operation]
speed_rpm = 2000.0
torque_Nm = 50.0
[mesh]
mean_stiffness_N_per_um_mm = 13.3548
half_backlash_um = 40.0
damping_N_s_per_m = 247.331
stiffness = { shape = "trapezoid" }
[pitch_error]
amplitude_um = 11.0
[bearings]
transverse_stiffness_N_per_m = [1e9, 5e8]
transverse_damping_N_s_per_m = [500.0, 400.0]
axial_stiffness_N_per_m = [1e9, 5e8]
axial_damping_N_s_per_m = [500.0, 400.0]
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash", "transverse", "axial"]
[sweep]
parameter = "operation.speed_rpm"
from = 500.0
to = 4000.0
count = 8
"""

HARMONICS = [-1.2, 0.0, 0.1, 0.0, 0.0, 0.02]
FOURIER = f"{{shape='fourier', cosine_N_per_um_mm={HARMONICS}, sine_N_per_um_mm={HARMONICS}}}"


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_every_sweep_of_the_project_loads_and_resolves(path):
    config = load_config(path)
    swept = axis_values(config)
    if config.kind != "gear_pair":
        assert swept.keys() <= config.parameters.keys()
        return
    groups = groups_at(config, dict(zip(swept, np.ix_(*swept.values()), strict=True)))
    assert groups.missing(config.scene.effects) == []
    for parameter in swept.keys() & SWEEPABLE_GROUPS.keys():
        assert np.array_equal(np.ravel(getattr(groups, parameter)), swept[parameter])


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_the_resolved_toml_loads_to_an_equal_configuration(path):
    config = load_config(path)
    again = Configuration.from_toml(config.resolved_toml())
    assert again == config
    assert again.resolved_toml() == config.resolved_toml()


@pytest.mark.parametrize("text", [SMALLEST, PHYSICAL], ids=["smallest", "physical"])
def test_the_resolved_toml_states_every_default(text):
    config = Configuration.from_toml(text)
    tables = tomllib.loads(config.resolved_toml())
    assert tables["integration"] == {
        "method": "rk4",
        "error_check": 0.0,
        "crossings": "resolved",
        "unstable": "refuse",
        "transient_periods": 500,
        "recorded_periods": 500,
    }
    assert tables["start"]["kind"] == "rest"
    assert Configuration.from_tables(tables) == config


def test_any_title_survives_the_round_trip():
    title = 'quote " backslash \\ newline \n tab \t delete \x7f null \x00 \u03b4 \U0001f600'
    config = Configuration.from_toml(SMALLEST).replace("title", title)
    assert Configuration.from_toml(config.resolved_toml()).title == title


def test_the_main_sweep_is_the_one_of_the_paper():
    config = load_config(PAN2021)
    values, groups = lane_groups(config)
    assert values.shape == (1501,)
    assert (values[0], values[586], values[-1]) == (0.0, 5.86, 15.0)
    assert groups.mesh_frequency == pytest.approx(2 * math.pi * 0.1394, rel=1e-15)
    assert groups.base_helix_angle_deg == pytest.approx(18.747237251037504, rel=1e-12)
    assert round(groups.mass_ratio_p, 6) == 0.440487
    assert round(groups.mass_ratio_g, 6) == 0.134525
    assert groups.stiffness_cosine[0] == pytest.approx(-1.202 / 13.3548, rel=1e-15)
    assert groups.origin["mass_ratio_p"] == "derived"
    assert groups.origin["load"] == "given"
    assert groups.origin["pitch_error_mean"] == "default"


def test_the_first_set_differs_from_the_main_one_by_what_is_not_printed_only():
    first, main = (
        load_config(ROOT / "sweeps" / name).tables() for name in ("pan2021_first.toml", PAN2021)
    )
    assert first["groups"]["damping_ratio"] == pytest.approx(0.1 / math.sqrt(15), rel=1e-15)
    assert first["groups"].keys() == main["groups"].keys()
    changed = {name for name, value in main["groups"].items() if first["groups"][name] != value}
    assert "mesh_frequency" not in changed
    for table in main.keys() - {"title", "groups"}:
        assert first[table] == main[table]


def test_the_full_sweep_differs_from_the_main_one_by_the_axial_motion_only():
    main = load_config(PAN2021).tables()
    full = load_config(ROOT / "sweeps" / "pan2021_full.toml").tables()
    added = {name for name in full["groups"] if name not in main["groups"]}
    assert {name.split("_")[0] for name in added} == {"axial"}
    assert set(full["scene"]["effects"]) - set(main["scene"]["effects"]) == {"axial"}
    for table in ("pair", "mesh", "start", "sweep", "integration"):
        assert full[table] == main[table]
    assert main["groups"].items() <= full["groups"].items()


def test_swept_values_come_in_ascending_order():
    config = Configuration.from_toml(SMALLEST)
    values, groups = lane_groups(config)
    assert values.tolist() == [0.1, 0.3]
    assert groups.load is not None
    assert np.asarray(groups.load).tolist() == [0.1, 0.3]
    assert groups.mesh_frequency == 0.9


def test_what_is_listed_twice_counts_once():
    twice = ["sweep.values=[0.3, 0.1, 0.3]", "scene.effects=['backlash', 'backlash']"]
    config = Configuration.from_toml(SMALLEST, overrides=[*twice, "groups.half_backlash=1.0"])
    assert swept_values(config.sweep).tolist() == [0.1, 0.3]
    assert config.sweep.size == 2
    assert config.scene.effects == ("backlash",)


def test_a_span_has_its_ends_and_one_rounding_per_value():
    config = load_config(PAN2021, ["sweep.from=0.1", "sweep.to=0.7", "sweep.count=7"])
    assert swept_values(config.sweep).tolist() == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]


def test_a_span_of_one_value_needs_no_end():
    table = {"parameter": "load", "from": 0.2, "count": 1}
    config = Configuration.from_toml(SMALLEST).replace("sweep", table)
    assert swept_values(config.sweep).tolist() == [0.2]


def test_a_swept_physical_quantity_moves_every_group_derived_from_it():
    values, groups = lane_groups(Configuration.from_toml(PHYSICAL))
    assert groups.mesh_frequency / values == pytest.approx(groups.mesh_frequency[0] / 500.0)
    assert np.ndim(groups.load) == 0


def test_a_group_given_directly_wins_over_the_physical_data():
    text = PHYSICAL + "[groups]\nload = 0.25\n"
    _, groups = lane_groups(Configuration.from_toml(text))
    assert groups.load == 0.25
    assert groups.origin["load"] == "given"


def test_a_swept_group_replaces_the_one_in_the_file():
    config = load_config(PAN2021, ['sweep={parameter="load", values=[0.1, 0.2]}'])
    assert np.asarray(lane_groups(config)[1].load).tolist() == [0.1, 0.2]


def second(parameter, *values):
    return f"second_sweep={{parameter='{parameter}', values={list(values)}}}"


def test_the_axes_are_the_second_sweep_and_the_sweep():
    config = load_config(PAN2021, [second("load", 0.3, 0.1)])
    assert list(config.sweeps) == ["sweep", "second_sweep"]
    values = axis_values(config)
    assert list(values) == ["load", "pitch_error"]
    assert values["load"].tolist() == [0.1, 0.3]
    assert np.array_equal(values["pitch_error"], swept_values(config.sweep))
    assert Configuration.from_toml(config.resolved_toml()) == config
    assert list(load_config(PAN2021).sweeps) == ["sweep"]


def test_groups_have_the_broadcast_shape_of_what_they_depend_on():
    config = Configuration.from_toml(
        PHYSICAL, overrides=[second("pair.face_width_mm", 14.0, 15.0), "mesh.stiffness=" + FOURIER]
    )
    axes = axis_values(config)
    widths, speeds = axes["pair.face_width_mm"], axes["operation.speed_rpm"]
    groups = groups_at(config, dict(zip(axes, np.ix_(widths, speeds), strict=True)))
    assert groups.mesh_frequency.shape == (2, 8)
    assert groups.load.shape == (2, 1)
    assert groups.pitch_error_amplitude == 11.0 / 40.0
    assert groups.stiffness_cosine.shape == (6,)
    flat = {
        "operation.speed_rpm": np.tile(speeds, 2),
        "pair.face_width_mm": np.repeat(widths, 8),
    }
    lanes = groups_at(config, flat)
    assert np.array_equal(lanes.mesh_frequency, groups.mesh_frequency.ravel())
    assert np.array_equal(lanes.load, np.repeat(groups.load.ravel(), 8))
    for row, width in enumerate(widths):
        alone = config.at({"pair.face_width_mm": width})
        along = groups_at(alone, {"operation.speed_rpm": speeds})
        assert np.array_equal(along.mesh_frequency, groups.mesh_frequency[row])
        assert along.load == groups.load[row, 0]


def test_groups_at_no_values_are_those_of_the_file_and_a_misspelt_parameter_is_an_error():
    config = Configuration.from_toml(PHYSICAL)
    assert groups_at(config, {}).load == groups_at(config, {"operation.torque_Nm": 50.0}).load
    for name in ("operation.sped_rpm", "laod", "pair.teeth", "stiffness_cosine"):
        with pytest.raises(KeyError):
            groups_at(config, {name: 1.0})


def test_a_parameter_fixed_at_a_value_leaves_its_sweep():
    config = load_config(PAN2021, [second("load", 0.1, 0.3)])
    point = config.at({"pitch_error": 10.75, "load": np.float64(0.2)})
    assert point.second_sweep is None
    assert axis_values(point)["pitch_error"].tolist() == [10.75]
    assert point.groups.given()["load"] == 0.2
    assert point.groups.given()["pitch_error"] == 10.75
    assert point.source == config.source
    along = config.at({"pitch_error": 10.75})
    assert list(along.sweeps.items()) == [("sweep", config.second_sweep)]
    assert along.groups.given()["pitch_error"] == 10.75
    # A parameter that is not swept can be fixed, too.
    assert config.at({"damping_ratio": 0.02}).sweeps == config.sweeps
    assert groups_at(config.at({"damping_ratio": 0.02}), {}).damping_ratio == 0.02
    physical = Configuration.from_toml(PHYSICAL).at({"operation.speed_rpm": 3000.0})
    assert physical.operation.speed_rpm == 3000.0
    assert axis_values(physical)["operation.speed_rpm"].tolist() == [3000.0]


def test_a_parameter_cannot_be_fixed_where_it_is_unknown_or_out_of_range():
    config = load_config(PAN2021)
    with pytest.raises(ConfigurationError, match="did you mean `pitch_error`"):
        config.at({"pitch_eror": 3.0})
    with pytest.raises(
        ConfigurationError, match=r"groups\.damping_ratio = -1\.0: must be at least"
    ):
        config.at({"damping_ratio": -1.0})


def test_catalogue_defaults_are_a_spur_pair_of_steel():
    bare = PHYSICAL.replace("helix_angle_deg = 20.0\n", "").replace(', "axial"]', "]")
    spur = Configuration.from_toml(bare)
    explicit = spur.replace("pair.helix_angle_deg", 0.0).replace("pair.density_kg_m3", 7850.0)
    assert groups_at(spur, {}).base_helix_angle_deg == 0.0
    assert groups_at(spur, {}).load == groups_at(explicit, {}).load
    assert groups_at(spur, {}).stiffness_cosine.shape == (6,)


def test_an_effect_that_is_off_does_not_forbid_sweeping_what_its_harmonics_depend_on():
    config = Configuration.from_toml(
        PHYSICAL, overrides=['scene.effects=["backlash"]', 'sweep.parameter="pair.face_width_mm"']
    )
    assert np.ndim(lane_groups(config)[1].load) == 1


def test_overrides_are_toml_and_bare_words_are_text():
    config = load_config(
        PAN2021,
        [
            "start.kind=contact",
            "integration.steps_per_period=100",
            "title=two words",
            "title = x=y",
        ],
    )
    assert config.start.kind == "contact"
    assert config.integration.steps_per_period == 100
    assert config.title == "x=y"


def test_the_text_is_verbatim_and_the_source_is_the_path():
    config = load_config(PAN2021, ["integration.steps_per_period=100"])
    assert config.text == PAN2021.read_text(encoding="utf-8")
    assert config.source == str(PAN2021)


def test_a_byte_order_mark_and_dos_line_ends_are_accepted(tmp_path):
    path = tmp_path / "dos.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SMALLEST.replace("\n", "\r\n").encode())
    assert load_config(path) == Configuration.from_toml(SMALLEST)


def test_a_whole_number_serves_as_a_float():
    assert Configuration.from_toml(SMALLEST.replace("0.9", "1")).groups.given()[
        "mesh_frequency"
    ] == pytest.approx(1.0)


def test_a_configuration_cannot_be_changed_but_replaced():
    config = Configuration.from_toml(SMALLEST)
    finer = config.replace("integration.steps_per_period", 500)
    assert finer.integration.steps_per_period == 500
    assert config.integration.steps_per_period is None
    assert finer != config
    with pytest.raises(ValueError, match="frozen"):
        config.integration.steps_per_period = 500
    with pytest.raises(ConfigurationError, match=r"integration\.steps_per_period = 0: "):
        config.replace("integration.steps_per_period", 0)


def test_numbers_of_numpy_are_numbers():
    config = load_config(PAN2021)
    changed = config.replace("outputs.lyapunov", np.bool_(False))
    changed = changed.replace("pair.teeth", np.array([20, 40]))
    changed = changed.replace("sweep", {"parameter": "pitch_error", "values": np.linspace(1, 2, 3)})
    plain = config.replace("outputs.lyapunov", False).replace("pair.teeth", [20, 40])
    assert changed == plain.replace(
        "sweep", {"parameter": "pitch_error", "values": [1.0, 1.5, 2.0]}
    )
    changed = config.replace("sweep.count", np.int64(3))
    assert changed == Configuration.from_toml(changed.resolved_toml())
    assert changed.sweep.size == 3


def test_a_configuration_survives_pickling():
    config = load_config(PAN2021)
    copy = pickle.loads(pickle.dumps(config))
    assert copy == config
    assert (copy.text, copy.source) == (config.text, config.source)


@pytest.mark.parametrize(
    ("effects", "states"),
    [
        ([], STATES[:2]),
        (["transverse"], STATES[:6]),
        (["axial"], STATES[:2] + STATES[6:]),
        (["transverse", "axial"], STATES),
    ],
)
def test_the_effects_decide_the_states(effects, states):
    scene = Configuration.from_toml(PHYSICAL, overrides=[f"scene.effects={effects}"]).scene
    assert scene.states == tuple(states)


def test_states_and_effects_are_those_of_the_files_and_the_groups():
    assert tuple(one.name for one in gear_pair.STATE_SUBJECTS) == STATES
    assert set().union(*(row.effects for row in GROUP_TABLE)) == set(EFFECTS)


def test_every_group_is_a_key_of_the_groups_table():
    keys = KEYS
    assert all(f"groups.{row.name}" in keys for row in GROUP_TABLE)


def test_the_command_prints_the_schema():
    command = [sys.executable, "-m", "gearchaos.schema"]
    output = subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stdout
    assert json.loads(output) == json_schema(GearPairConfiguration)


def test_the_schema_knows_every_key_without_null():
    schema = json_schema(GearPairConfiguration)
    assert "null" not in json.dumps(schema)
    described = set(schema["properties"])
    for table in schema["$defs"].values():
        described |= set(table.get("properties", ()))
    assert {path.rpartition(".")[2] for path in KEYS} <= described


def test_the_tables_of_keys_list_the_choices():
    rows = {line.split("|")[1].strip(): line for line in KEY_TABLES.splitlines() if "|" in line}
    assert '| `"none"`, `"upwards"`, `"downwards"`, `"both"` | `"none"` |' in rows["`carry`"]
    assert '| `"resolved"`, `"plain"` |' in rows["`crossings`"]
    assert "| integer |  | `1995`, `2013` |" in rows["`edition`"]
    assert "| list of integers |  |  | required | `[21, 38]` |" in rows["`teeth`"]
    assert "| list of floats | N/(um mm) |" in rows["`sine_N_per_um_mm`"]
    assert '| `"pitch_error"`, `"stiffness_variation"`, `"backlash"`,' in rows["`effects`"]
