"""Every fault of a configuration has one clear message; all faults are reported at once."""

import datetime
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.models import Configuration, load_config

ROOT = Path(__file__).resolve().parents[2]
PAN2021 = ROOT / "sweeps" / "pan2021.toml"
TEXT = PAN2021.read_text(encoding="utf-8")

FREE_OF_GROUPS = "groups={mesh_frequency=1.0, damping_ratio=0.1, pitch_error_amplitude=0.1}"


def problems_of(*overrides):
    with pytest.raises(ConfigurationError) as caught:
        Configuration.from_toml(TEXT, "pan.toml", overrides)
    assert caught.value.exit_code == 2
    return caught.value.problems


ONE_FAULT = [
    # misspelt and misplaced keys
    ("sweep.cuont=3", "sweep.cuont = 3", "unknown key", "did you mean `count`?"),
    ("sweeep.count=3", 'sweeep = {"count" = 3}', "unknown key", "did you mean `sweep`?"),
    ("pair.torque_Nm=3.0", "pair.torque_Nm = 3.0", "unknown key", "`operation.torque_Nm`"),
    ("mesh.half_backlash_mm=0.06", "half_backlash_mm = 0.06", "unknown key", "_um = 60.0"),
    ("start.qqq=3", "start.qqq = 3", "unknown key", "the keys of [start] are kind, state"),
    ("mesh.stiffness.sine=[1.0]", "sine = [1.0]", "unknown key", "`sine_N_per_um_mm`"),
    # wrong types
    (
        'pair.face_width_mm="15"',
        'face_width_mm = "15"',
        "must be a number",
        "without the quotes: 15",
    ),
    ("pair.face_width_mm=true", "face_width_mm = true", "must be a number", "face width, in mm"),
    ("pair.teeth=[21, 38.0]", "pair.teeth[1] = 38.0", "must be a whole number", "[21, 38]"),
    ("pair.teeth=[21]", "pair.teeth[1]", "is missing", "[21, 38]"),
    ("pair.teeth=[21, 38, 1]", "pair.teeth", "at most 2", "[21, 38]"),
    ("pair.teeth=21", "pair.teeth = 21", "must be a list", "[21, 38]"),
    ("integration.steps_per_period=100.0", "steps_per_period = 100.0", "a whole number", "steps"),
    ("outputs.lyapunov=yes", 'outputs.lyapunov = "yes"', "must be true or false", "exponent"),
    ("start=rest", 'start = "rest"', "must be a table", "start"),
    ("title=1979-05-27", "title = 1979-05-27", "must be a text", "title"),
    # values out of range
    ("pair.masses_kg=[0.2, -0.7]", "pair.masses_kg[1] = -0.7", "greater than 0", "masses"),
    ("pair.teeth=[21, 0]", "pair.teeth[1] = 0", "must be at least 1", "[21, 38]"),
    ("groups.load=nan", "groups.load = nan", "must be a finite number", "static load"),
    ("groups.load=-inf", "groups.load = -inf", "must be a finite number", "static load"),
    ("groups.damping_ratio=-1.0", "damping_ratio = -1.0", "at least 0", "mesh damping ratio"),
    ("pair.helix_angle_deg=90", "helix_angle_deg = 90", "less than 90", "helix angle"),
    ("sweep.count=0", "sweep.count = 0", "must be at least 1", "number of values"),
    ("outputs.allowed_diverged_share=2.0", "share = 2.0", "must be at most 1", "diverged lanes"),
    (
        "integration={method='flow_map', crossings='plain'}",
        'integration.crossings = "plain"',
        "flow_map",
        "resolves every crossing; it goes with method",
    ),
    # words
    ('scene.effects=["backlsh"]', '[0] = "backlsh"', "must be one of", "did you mean `backlash`?"),
    (
        "start.carry=up",
        'start.carry = "up"',
        "one of 'none', 'upwards', 'downwards' or 'both'",
        "expected: ",
    ),
    ("start.kind=rset", 'start.kind = "rset"', "must be one of", "did you mean `rest`?"),
    ("formulation=printed", 'formulation = "printed"', "'physical'", "Pan 2021"),
    ('mesh.stiffness.shape="fourrier"', '"fourrier"', "must be one of", "`fourier`"),
    ('outputs.section=["delta5"]', '"delta5"', "must be one of", "did you mean `delta_5`?"),
    ("start={kind='given', state={delta5=1.0}}", "start.state.delta5", "one of", "`delta_5`"),
    # rules between keys
    (
        "mesh={damping_ratio=0.1, damping_N_s_per_m=2.0}",
        "mesh.damping_N_s_per_m = 2.0",
        "mesh.damping_ratio = 0.1 is given as well",
        "keep one of the two",
    ),
    (
        "mesh={half_backlash_um=20.0, normal_backlash_um=36.0}",
        "mesh.normal_backlash_um = 36.0",
        "mesh.half_backlash_um = 20.0 is given as well",
        "keep one of them",
    ),
    (
        "mesh.circumferential_backlash_um=0.0",
        "mesh.circumferential_backlash_um = 0.0",
        "cannot be the length scale",
        "give mesh.length_scale_um",
    ),
    (
        "mesh.half_backlash_um=0.0",
        "mesh.half_backlash_um = 0.0",
        "cannot be the length scale",
        "give mesh.length_scale_um",
    ),
    (
        'outputs.section=["delta_3"]',
        'outputs.section = ["delta_3"]',
        "the scene has no state `delta_3`",
        'add "axial" to scene.effects',
    ),
    ("start.kind=given", "start.state", "is missing", "state = {"),
    (
        'start={kind="given", state={delta_4=1.0}}',
        "start.state",
        "the scene has no state `delta_4`",
        'add "axial"',
    ),
    ("start.seed=5", "start.seed = 5", 'no meaning with start.kind = "rest"', '"random"'),
    ("start.kind=grid", "start.box", 'is missing with kind = "grid"', "box = {"),
    (
        "start={kind='grid', box={delta_5=[1.0, 1.0]}}",
        "start.box.delta_5 = [1.0, 1.0]",
        "must be the lowest value and the highest one",
    ),
    (
        "start={kind='grid', box={delta_4=[0.0, 1.0]}}",
        "start.box",
        "the scene has no state `delta_4`",
        'add "axial"',
    ),
    (
        "start={kind='grid', box={delta_5=[0.0, 1.0]}, state={delta_5=1.0}}",
        "start.box.delta_5",
        "start.state has a value of it as well",
    ),
    (
        "start={kind='random', box={delta_5=[0.0, 1.0]}, spread=2.0}",
        "start.spread = 2.0",
        'no meaning with start.kind = "random" and a box',
    ),
    ("start={kind='random', state={delta_5=1.0}}", "start.state", '"given" or a box'),
    ("start={kind='contact', box={delta_5=[0.0, 1.0]}}", "start.box", '"grid" or "random"'),
    ("start={kind='grid', count=20000, box={delta_5=[0, 1], delta_1=[0, 1]}}", "400000000 starts"),
    (
        "outputs.section_points=501",
        "outputs.section_points = 501",
        "at most integration.recorded_periods = 500",
        "record more periods",
    ),
    # the sweep
    ("sweep.parameter=pitch_eror", '"pitch_eror"', "can be swept", "did you mean `pitch_error`?"),
    ("sweep.parameter=speed", '"speed"', "can be swept", "operation.speed_rpm"),
    (
        "sweep.parameter=stiffness_sine",
        "stiffness_sine",
        "can be swept",
        "stiffness_variation_scale",
    ),
    (
        "sweep.parameter=bearings.axial_damping_N_s_per_m",
        "bearings.axial_damping_N_s_per_m",
        "can be swept",
        "axial_damping_p",
    ),
    ("sweep.to=-1.0", "sweep: to = -1.0", "greater than from = 0.0", "start.carry"),
    (
        "sweep={parameter='load', values=[0.1, 1.7e308]}",
        "sweep.values = 1.7e+308",
        "at most 1e+300",
    ),
    ("sweep.to=1e306", "sweep.to = 1e+306", "at most 1e+300 in size", "sweep inside that range"),
    ("sweep.to=1e-320", "sweep: 1501 values", "would coincide", "lower the count"),
    ('sweep={parameter="load"}', "sweep: give either", "`values`, or"),
    ('sweep={parameter="load", values=[]}', "sweep.values = []", "at least 1 value", "values"),
    ('sweep={parameter="load", values=[1, 2], count=2}', "sweep: give either", "`values`, or"),
    (
        'sweep={parameter="damping_ratio", values=[-0.5, 1]}',
        "sweep.values = -0.5",
        "damping_ratio must be finite and >= 0",
        "inside that range",
    ),
    (
        'sweep={parameter="axial_stiffness_p", values=[1, 2]}',
        'sweep.parameter = "axial_stiffness_p"',
        "an effect that is off",
        'add "axial" to scene.effects',
    ),
    (
        'sweep={parameter="operation.speed_rpm", values=[1000, 2000]}',
        'sweep.parameter = "operation.speed_rpm"',
        "changes nothing",
        "leave out mesh_frequency",
    ),
    (
        'sweep={parameter="pair.density_kg_m3", values=[7800, 7900]}',
        'sweep.parameter = "pair.density_kg_m3"',
        "changes nothing",
        "no group follows",
    ),
    # the second sweep: the same rules with its own keys
    ("second_sweep={values=[1]}", "second_sweep.parameter", "is missing", "group by its name"),
    (
        'second_sweep={parameter="laod", values=[1]}',
        'second_sweep.parameter = "laod"',
        "can be swept",
        "did you mean `load`?",
    ),
    ('second_sweep={parameter="load"}', "second_sweep: give either", "`values`, or"),
    (
        'second_sweep={parameter="load", from=1, to=0, count=2}',
        "second_sweep: to = 0",
        "greater than from = 1",
        "exchange",
    ),
    (
        'second_sweep={parameter="damping_ratio", values=[-0.5, 1]}',
        "second_sweep.values = -0.5",
        "damping_ratio must be finite and >= 0",
        "inside that range",
    ),
    (
        'second_sweep={parameter="axial_stiffness_p", values=[1, 2]}',
        'second_sweep.parameter = "axial_stiffness_p"',
        "an effect that is off",
        'add "axial" to scene.effects',
    ),
    (
        'second_sweep={parameter="operation.speed_rpm", values=[1000, 2000]}',
        'second_sweep.parameter = "operation.speed_rpm"',
        "changes nothing",
        "leave out mesh_frequency",
    ),
    (
        'second_sweep={parameter="pitch_error", values=[1, 2]}',
        'second_sweep.parameter = "pitch_error"',
        "already swept by [sweep]",
        "drop [second_sweep]",
    ),
    (
        'second_sweep={parameter="load", from=0.1, to=0.2, count=100_000}',
        "pan.toml: second_sweep: ",
        "1501 values of [sweep] x 100000 values of [second_sweep] make 150100000 lanes",
        "must be at most 100000000; lower a count",
    ),
    (
        'start={kind="random", count=1_000_000}',
        "pan.toml: sweep: ",
        "1501 values of [sweep] x 1000000 starts make 1501000000 lanes",
        "lower a count",
    ),
    # the groups
    (
        'scene.effects=["pitch_error", "backlash", "axial"]',
        "groups.axial_stiffness_p",
        'needed for "axial" and neither given nor derivable',
        "or derive it by giving bearings.axial_stiffness_N_per_m as well",
    ),
    ("pair.normal_module_mm=1e300", "groups.mass_ratio_p", "derived from pair", "magnitudes"),
    # overrides
    ("steps", "override 'steps'", "must have the form key.path=value", "steps_per_period=100"),
    ("title.x=1", "override 'title.x=1'", "title is not a table", "a key inside a table"),
]


@pytest.mark.parametrize("case", ONE_FAULT, ids=[case[0] for case in ONE_FAULT])
def test_a_fault_names_key_value_rule_and_remedy(case):
    override, *fragments = case
    message = problems_of(override)[0]
    for fragment in fragments:
        assert fragment in message
    assert message.startswith(("pan.toml: ", "override "))


def test_all_faults_are_reported_at_once_each_on_its_own():
    problems = problems_of(
        "titel=x",
        "pair.face_width_mm=-1.0",
        "pair.normal_modul_mm=2.0",
        "groups.load=nan",
        'scene.effects=["backlsh"]',
        "sweep.count=0",
        "outputs.section_points=1000",
        'start={kind="rest", count=3}',
    )
    wanted = ["titel", "face_width_mm", "normal_modul_mm", "groups.load", "scene.effects[0]"]
    wanted += ["sweep.count", "outputs.section_points", "start.count"]
    assert len(problems) == len(wanted)
    for key in wanted:
        assert sum(key in problem.split(" = ")[0] for problem in problems) == 1
    assert all("\n" not in problem for problem in problems)


def test_every_missing_group_has_its_own_message():
    problems = problems_of("groups={}")
    keys = [problem.split(": ")[1] for problem in problems]
    assert "groups.load" in keys
    assert "groups.transverse_damping_g" in keys
    assert "groups.mass_ratio_p" not in keys
    assert len(set(keys)) == len(keys)


def test_a_missing_group_names_only_the_physical_keys_that_lack():
    (problem,) = (text for text in problems_of("groups={}") if "groups.mesh_frequency" in text)
    assert "operation.speed_rpm" in problem
    assert "mean_stiffness" not in problem


def test_the_axial_effect_needs_a_helix_angle():
    text = (ROOT / "sweeps" / "pan2021_full.toml").read_text(encoding="utf-8")
    with pytest.raises(ConfigurationError, match="a spur pair nothing drives the axial motion"):
        Configuration.from_toml(text, overrides=["pair.helix_angle_deg=0"])


def test_a_swept_physical_key_without_its_effect_names_the_effect():
    (problem,) = problems_of(
        'sweep={parameter="pitch_error.phase_deg", values=[0, 90]}', 'scene.effects=["backlash"]'
    )
    assert 'add "pitch_error" to scene.effects' in problem


PHYSICAL_MESH = (
    "operation={speed_rpm=2000.0, torque_Nm=50.0}",
    "groups={transverse_stiffness_p=1.0, transverse_damping_p=0.1, transverse_stiffness_g=1.0, "
    "transverse_damping_g=0.1, pitch_error_amplitude=0.1}",
    "mesh={mean_stiffness_N_per_um_mm=13.0, half_backlash_um=20.0, length_scale_um=25.0, "
    "damping_ratio=0.1}",
    "scene.effects=['pitch_error', 'backlash', 'transverse']",
)


@pytest.mark.parametrize(
    ("first", "second"), [("sweep", "second_sweep"), ("second_sweep", "sweep")]
)
def test_of_two_sweeps_each_must_change_something_beside_the_other(first, second):
    (problem,) = problems_of(
        *PHYSICAL_MESH,
        f"{first}={{parameter='mesh_frequency', values=[0.5, 1]}}",
        f"{second}={{parameter='operation.speed_rpm', values=[1000, 2000]}}",
    )
    assert f'{second}.parameter = "operation.speed_rpm": changes nothing in this scene' in problem
    assert "a group that is given or swept wins over a derived one" in problem
    assert "leave out mesh_frequency, or sweep another parameter" in problem


def test_the_two_dampings_are_one_whether_given_or_swept():
    damping = "={parameter='mesh.damping_N_s_per_m', values=[100, 200]}"
    ratio = "={parameter='mesh.damping_ratio', values=[0.1, 0.2]}"
    (given,) = problems_of(*PHYSICAL_MESH, f"sweep{damping}")
    assert "mesh.damping_N_s_per_m: mesh.damping_ratio = 0.1 is given as well; keep one" in given
    (swept,) = problems_of(*PHYSICAL_MESH, f"sweep{damping}", f"second_sweep{ratio}")
    assert "mesh.damping_N_s_per_m: mesh.damping_ratio is swept as well; keep one" in swept


def test_a_half_backlash_can_be_swept_where_the_length_scale_is_swept_as_well():
    backlash = "sweep={parameter='mesh.half_backlash_um', values=[10, 20]}"
    unscaled = (*PHYSICAL_MESH[:2], PHYSICAL_MESH[2].replace("length_scale_um=25.0, ", ""))
    assert "is also the length scale" in problems_of(*unscaled, PHYSICAL_MESH[3], backlash)[0]
    scale = "second_sweep={parameter='mesh.length_scale_um', values=[25, 50]}"
    Configuration.from_toml(TEXT, overrides=[*unscaled, PHYSICAL_MESH[3], backlash, scale])


def test_the_three_backlashes_are_one_whether_given_or_swept():
    for name in ("circumferential_backlash_um", "normal_backlash_um"):
        sweep = f"={{parameter='mesh.{name}', values=[30, 40]}}"
        (given,) = problems_of(*PHYSICAL_MESH, f"sweep{sweep}")
        assert f"mesh.{name}: mesh.half_backlash_um = 20.0 is given as well; keep one" in given
        other = "second_sweep={parameter='mesh.half_backlash_um', values=[10, 20]}"
        (swept,) = problems_of(*PHYSICAL_MESH, f"sweep{sweep}", other)
        assert f"mesh.{name}: mesh.half_backlash_um is swept as well; keep one" in swept


def test_an_angle_that_would_change_the_length_scale_is_not_swept():
    mesh = "mesh={mean_stiffness_N_per_um_mm=13.0, normal_backlash_um=40.0, damping_ratio=0.1}"
    scene, angles = PHYSICAL_MESH[3], "sweep={parameter='pair.helix_angle_deg', values=[10, 20]}"
    (problem,) = problems_of(*PHYSICAL_MESH[:2], mesh, scene, angles)
    assert "changes the half backlash, which is also the length scale" in problem
    assert "give mesh.length_scale_um" in problem
    scaled = mesh.replace("damping_ratio", "length_scale_um=25.0, damping_ratio")
    Configuration.from_toml(TEXT, overrides=[*PHYSICAL_MESH[:2], scaled, scene, angles])


def test_a_backlash_is_converted_by_the_angles_of_a_pair():
    without = re.sub(
        r"(?s)\[pair\].*?(?=\n\[)", "[mesh]\ncircumferential_backlash_um = 40.0\n", TEXT
    )
    angle = "groups.base_helix_angle_deg=18.0"
    with pytest.raises(ConfigurationError) as caught:
        Configuration.from_toml(without.replace("[mesh]\nmean", "mean"), "pan.toml", [angle])
    found = caught.value.problems[0]
    assert "mesh.circumferential_backlash_um = 40.0: is converted by the angles of [pair]" in found
    assert "give [pair], or mesh.half_backlash_um" in found


@pytest.mark.parametrize("table", ["sweep", "second_sweep"])
def test_a_sweep_that_changes_the_harmonics_stands_beside_another_one(table):
    angles = f"{table}={{parameter='pair.helix_angle_deg', values=[10, 20]}}"
    other = {"sweep": "second_sweep", "second_sweep": "sweep"}[table]
    loads = f"{other}={{parameter='load', values=[0.1, 0.2]}}"
    changes = [angles, loads, "mesh.stiffness={shape='trapezoid'}"]
    found = Lanes(Configuration.from_toml(TEXT, overrides=changes)).parameters["stiffness_cosine"]
    assert found.dims == ("pair_helix_angle_deg", "harmonic")
    assert found.values.shape == (2, 6) and np.ptp(found.values[:, 0]) > 1e-3


def test_a_faulty_second_sweep_hides_no_fault_of_the_first():
    problems = problems_of("sweep.to=-1.0", 'second_sweep={parameter="load", count="x"}')
    assert [problem.split(" = ")[0] for problem in problems] == [
        "pan.toml: sweep: to",
        "pan.toml: second_sweep.count",
    ]


def test_a_group_of_the_axial_pair_is_swept_where_something_kept_depends_on_it():
    text = (ROOT / "sweeps" / "pan2021_full.toml").read_text(encoding="utf-8")
    sweep = 'second_sweep={parameter="axial_stiffness_p", values=[10, 20]}'
    Configuration.from_toml(text, overrides=[sweep])
    with pytest.raises(ConfigurationError, match=r"second_sweep.*axial pair only.*delta_3"):
        Configuration.from_toml(
            text, overrides=[sweep, "outputs.lyapunov=false", 'outputs.section=["delta_5"]']
        )


def test_what_is_not_toml_is_located():
    with pytest.raises(ConfigurationError, match=r"x\.toml: not valid TOML: .* line 2, column"):
        Configuration.from_toml("title = 'a'\ntitle 'b'", "x.toml")
    with pytest.raises(ConfigurationError, match=r"overwrite a value \(at line 2.*each key once"):
        Configuration.from_toml("title = 'a'\ntitle = 'b'\n", "x.toml")


@pytest.mark.parametrize("number", ["0,5", "-12,25  # mm"])
def test_a_decimal_comma_is_answered_with_the_number_that_was_meant(number):
    meant = number.split()[0].replace(",", ".")
    for before in "", "title = 'a'\n[sweep]\n":
        with pytest.raises(ConfigurationError, match=f"with a point: {re.escape(meant)} for"):
            Configuration.from_toml(f"{before}from = {number}\nto = 1.0\n", "x.toml")
    with pytest.raises(ConfigurationError, match="each key once"):
        Configuration.from_toml("values = [0,5]\ntitle = '0,5'\ntitle = ''\n", "x.toml")


def test_a_missing_table_is_shown_with_its_first_keys():
    with pytest.raises(ConfigurationError) as raised:
        Configuration.from_toml("", "x.toml")
    scene, sweep = raised.value.problems
    assert 'such as [scene] with effects = ["pitch_error",' in scene
    assert sweep.endswith(
        'such as [sweep] with parameter = "pitch_error", from = 0.0, to = 15.0, count = 1501'
    )


@pytest.mark.parametrize(
    "text",
    [
        "title = " + "[" * 100_000,
        "a" + ".a" * 2000 + " = 1",
        "x = 1" + "0" * 5000,
        "x = 0x" + "f" * 4000,
        "x = \x00",
        "[" + "k" * 100_000 + "]\n[" + "k" * 100_000 + "]",
        "title = '\udcff'",
    ],
    ids=["lists", "dotted keys", "digits", "hexadecimals", "null byte", "long key", "surrogate"],
)
def test_hostile_toml_is_refused_in_words(text):
    with pytest.raises(ConfigurationError) as caught:
        Configuration.from_toml(text)
    assert all(len(problem) < 1400 for problem in caught.value.problems)


def test_an_integer_that_python_does_not_write_is_refused_in_words():
    with pytest.raises(ConfigurationError, match="count = an integer of thousands of digits: must"):
        load_config(PAN2021).replace("sweep.count", 10**5000)


def test_a_thousand_faults_are_cut_to_a_hundred():
    with pytest.raises(ConfigurationError) as caught:
        Configuration.from_toml("".join(f"key{i} = 1\n" for i in range(1000)), "many.toml")
    assert len(caught.value.problems) == 101
    assert caught.value.problems[-1] == "many.toml: and 902 more faults"


def test_a_missing_file_a_directory_and_an_empty_path_cannot_be_read(tmp_path):
    for path, reason in (
        (tmp_path / "none.toml", "No such file or directory; check the path of the configuration"),
        (tmp_path, "Is a directory"),
        ("", "the path is empty"),
        ("a\0b", "null byte"),
        (PAN2021 / "x", "cannot be read"),
    ):
        with pytest.raises(FileError, match=reason) as caught:
            load_config(path)
        assert caught.value.exit_code == 4


def test_what_is_not_utf_8_is_located_by_its_line(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes(b"# first line\ntitle = 'Z\xe4hne'\n")
    with pytest.raises(ConfigurationError, match=r"latin\.toml: line 2 is not UTF-8"):
        load_config(path)


def test_a_result_is_no_configuration(tmp_path):
    path = tmp_path / "pair.h5"
    with h5py.File(path, "w"):
        pass
    shows = r"pair\.h5: is HDF5, and a configuration is TOML; `gearchaos info .*pair\.h5`"
    with pytest.raises(ConfigurationError, match=shows):
        load_config(path)


def test_what_is_no_value_of_toml_is_refused_as_any_other():
    config = load_config(PAN2021)
    for value in (object(), {1}, datetime.date.today()):
        shown = re.escape(f"sweep.count = {value}: must be a whole number")
        with pytest.raises(ConfigurationError, match=shown):
            config.replace("sweep.count", value)


def test_a_choice_is_refused_with_the_choices():
    with pytest.raises(ConfigurationError, match="one of 'none', 'upwards', 'downwards' or 'both'"):
        load_config(PAN2021, ["start.carry=up"])


def test_a_huge_file_is_refused(tmp_path):
    path = tmp_path / "huge.toml"
    path.write_bytes(b"#" * (10 * 1024 * 1024 + 1))
    with pytest.raises(ConfigurationError, match="larger than 4 MB"):
        load_config(path)


def test_tables_made_in_python_obey_the_same_rules():
    with pytest.raises(ConfigurationError, match=r"<python>: scene: is missing"):
        Configuration.from_tables({"sweep": {"parameter": "load", "values": [1.0]}})
