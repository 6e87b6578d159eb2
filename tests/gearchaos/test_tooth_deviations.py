"""Pitch deviations of every tooth: from a file or a grade to both gears in the order of mesh."""

import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from gearchaos.engine.lanes import Lanes
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.engine.run_plan import plan_run
from gearchaos.errors import ConfigurationError
from gearchaos.iso1328 import cumulative_pitch_um, single_pitch_um
from gearchaos.models import Configuration, load_config
from gearchaos.models.gear_pair.tables import groups_at
from gearchaos.models.gear_pair.tooth_deviations import drawn_gears, tooth_deviations
from gearchaos.results.reading.result import open_result
from gearchaos.results.reading.settings import settings_of

from .commands import SMALL, run_module
from .fuzz_results import CHECKSUM_LINE, good_result

SINE = "amplitude_um = 11.0\nmean_um = 2.0\nphase_deg = 30.0\n"
ERROR = '[pitch_error]\nkind = "teeth"\n'
F = [0.0, 4.0, 1.0, -2.0, -1.0]
"""Cumulative deviations of a gear with five teeth."""
SINGLE = [1.0, 4.0, -3.0, -3.0, 1.0]
"""Single deviations of the same gear."""


def text_of(error, teeth="[5, 38]"):
    text = SMALL.replace("teeth = [21, 38]", f"teeth = {teeth}")
    assert f"[pitch_error]\n{SINE}" in text
    return text.replace(f"[pitch_error]\n{SINE}", error)


def driving(*keys):
    return text_of(ERROR + "\n".join(["[pitch_error.driving]", *keys]) + "\n")


def deviations_of(config, **values):
    return tooth_deviations(config.pitch_error, config.pair, values)


def gear_of(text):
    return deviations_of(Configuration.from_toml(text)).driving[0].tolist()


# A gear turns: seen from the mesh, the next tooth lies behind. Counted with the rotation, the next
# tooth has a lower number.
def test_teeth_counted_with_the_rotation_come_into_mesh_with_falling_numbers():
    assert gear_of(driving(f"cumulative_um = {F}")) == [0.0, -1.0, -2.0, 1.0, 4.0]


def test_counted_against_it_they_rise_and_farther_on_is_behind():
    keys = (f"cumulative_um = {F}", 'counted = "against_rotation"')
    assert gear_of(driving(*keys)) == [0.0, -4.0, -1.0, 2.0, 1.0]


def test_one_gear_counted_both_ways_is_one_gear():
    # Tooth 0 keeps its number, every other tooth gets another one; in this count, teeth that were
    # ahead are behind.
    other_way = [0.0, *(-one for one in F[:0:-1])]
    keys = (f"cumulative_um = {other_way}", 'counted = "against_rotation"')
    assert gear_of(driving(*keys)) == gear_of(driving(f"cumulative_um = {F}"))


def test_single_deviations_are_the_steps_of_the_cumulative_ones():
    assert gear_of(driving(f"single_um = {SINGLE}")) == gear_of(driving(f"cumulative_um = {F}"))


def test_cumulative_deviations_count_from_tooth_0():
    shifted = [one + 7.0 for one in F]
    assert gear_of(driving(f"cumulative_um = {shifted}")) == gear_of(
        driving(f"cumulative_um = {F}")
    )


def test_what_rounding_leaves_of_a_sum_is_spread_evenly():
    found = gear_of(driving(f"single_um = {[one + 0.01 for one in SINGLE]}"))
    assert found == pytest.approx(gear_of(driving(f"single_um = {SINGLE}")), abs=1e-12)


def test_a_gear_without_deviations_has_one_column_of_zeros():
    found = deviations_of(Configuration.from_toml(driving(f"cumulative_um = {F}")))
    assert found.driving.shape == (1, 5) and found.driven.tolist() == [[0.0]]


def test_a_sine_has_no_deviations():
    assert Lanes(Configuration.from_toml(SMALL)).system_of(np.arange(1)).teeth is None


@pytest.mark.parametrize("kind", ["teeth", "grade"])
def test_a_micrometre_counts_by_the_transverse_pressure_angle(kind):
    error = {"teeth": f"{ERROR}[pitch_error.driving]\ncumulative_um = {F}\n"}
    error["grade"] = '[pitch_error]\nkind = "grade"\ngrade = 7\nmean_um = 5.0\n'
    groups = groups_at(Configuration.from_toml(text_of(error[kind])), {})
    alpha_t = np.arctan(np.tan(np.radians(20.0)) / np.cos(np.radians(20.0)))
    assert groups.pitch_error_amplitude == pytest.approx(np.cos(alpha_t) / 25.0, rel=1e-14)
    assert groups.origin["pitch_error_amplitude"] == "derived"
    assert groups.pitch_error_mean == (5.0 / 25.0 if kind == "grade" else 0.0)


def test_lanes_have_the_gears_of_their_grade_and_number():
    config = Configuration.from_toml(
        text_of(
            '[pitch_error]\nkind = "grade"\ngrade = 9\nseed = 4\nrealisations = 3\n', "[21, 38]"
        ),
        overrides=["sweep={parameter='pitch_error.grade', values=[5.0, 7.0]}"],
    )
    lanes = Lanes(config)
    some = np.array([4, 1, 4])
    values = lanes.values_of(some)
    assert values["pitch_error.grade"].tolist() == [7.0, 5.0, 7.0]
    found = tooth_deviations(config.pitch_error, config.pair, values)
    assert found.profile.tolist() == [1, 0, 1]  # each profile is made once, and no others
    for gear, (teeth, profiles) in enumerate(((21, found.driving), (38, found.driven))):
        sizes = (2.166, teeth * 2.166 / np.cos(np.radians(20.0)))
        for grade, profile in zip((5, 7), profiles, strict=True):
            limits = single_pitch_um(grade, *sizes), cumulative_pitch_um(grade, *sizes)
            assert np.array_equal(profile, drawn_gears([1], 4, gear, teeth, *limits)[0])


def test_the_first_number_moves_the_row_of_gears():
    error = '[pitch_error]\nkind = "grade"\ngrade = 7\nrealisations = 4\n'
    every = Lanes(Configuration.from_toml(text_of(error)))
    last = Lanes(Configuration.from_toml(text_of(f"{error}first_realisation = 2\n")))
    assert last.axes[1].values.tolist() == [2, 3, 4, 5]
    gears = [
        tooth_deviations(one.config.pitch_error, one.config.pair, one.values_of(np.arange(4)))
        for one in (every, last)
    ]
    assert np.array_equal(gears[0].driven[2:], gears[1].driven[:2])


COLUMNS = {
    "semicolons": "tooth;Fp\n" + "".join(f"{n};{f}\n" for n, f in enumerate(F)),
    "commas, notes and spaces": "# drawn\n\nx , Fp\n" + "".join(f"0 , {f} \n" for f in F),
    "tabs": "Fp\ttooth\n" + "".join(f"{f}\t{n}\n" for n, f in enumerate(F)),
    "one column": "Fp\r\n" + "".join(f"{f}\r\n" for f in F),
    "quotes": '"note","Fp"\n' + "".join(f'"a, b","{f}"\n' for f in F),
    "a tab in quotes": '"note","Fp"\n' + "".join(f'"a\tb","{f}"\n' for f in F),
    "beside a longer one": "g,p,Fp\n" + "".join(f"0,1,{f}\n" for f in F) + "0,2,\n0\n",
    "a byte order mark": "\ufeffFp;x\n" + "".join(f"{f};\n" for f in F),
}


@pytest.mark.parametrize("columns", COLUMNS.values(), ids=COLUMNS)
def test_a_column_of_a_file_is_a_list(columns, tmp_path):
    (tmp_path / "gear.csv").write_bytes(columns.encode())
    path = tmp_path / "pair.toml"
    path.write_text(driving('file = "gear.csv"', 'column = "Fp"'))
    config = load_config(path)
    assert config.pitch_error.driving.cumulative_um == tuple(F)
    assert config.files == {"gear.csv": columns.removeprefix("\ufeff")}


def test_a_column_of_single_deviations_and_one_file_for_both_gears(tmp_path):
    rows = (f"{one},{other}\n" for one, other in zip(SINGLE, F, strict=True))
    (tmp_path / "gears.csv").write_text("p,g\n" + "".join(rows))
    keys = 'file = "gears.csv"\ncolumn = "{}"\nholds = "{}"\n'
    gears = [("driving", "p", "single"), ("driven", "g", "cumulative")]
    tables = (f"[pitch_error.{gear}]\n{keys.format(*rest)}" for gear, *rest in gears)
    path = tmp_path / "pair.toml"
    path.write_text(text_of(ERROR + "".join(tables), "[5, 5]"))
    found = deviations_of(load_config(path))
    assert np.array_equal(found.driving, found.driven)


def test_a_configuration_and_its_result_stand_alone_without_the_file(tmp_path):
    columns, path = COLUMNS["semicolons"], tmp_path / "gears.toml"
    (tmp_path / "gear.csv").write_text(columns)
    path.write_text(driving('file = "gear.csv"', 'column = "Fp"', 'flank = "right"'))
    config = load_config(path)
    steps = ("--set", "integration.steps_per_period=120")
    arguments = ("gears.toml", "--set", "sweep.count=2", *steps)
    assert run_module("gearchaos.sweep", *arguments, cwd=tmp_path).code == 0
    (tmp_path / "gear.csv").unlink()
    for again in (
        Configuration.from_toml(config.resolved_toml()),
        Configuration.from_toml(config.text),
        config.replace("pitch_error.driving.flank", "right"),
        config.at({"load": 0.5}).replace("groups.load", None),
    ):
        assert again == config
    shown = run_module("gearchaos.info", "gears.h5", cwd=tmp_path)
    assert 'pitch_error.driving.file = "gear.csv"\n' in shown.out
    assert "sweep.count = 2 (set for this run)" in shown.out
    listed = " ".join(shown.out.split())
    assert (
        "pitch_error.driving.cumulative_um = [0.0, 4.0, 1.0, -2.0, -1.0] (from gear.csv)" in listed
    )
    facts = open_result(tmp_path / "gears.h5").metadata
    raised = {one.key: one.origin for one in settings_of({**facts, "transient_periods": 190})}
    assert raised["integration.transient_periods"] == "190 were computed"
    onwards = ("gears.h5", "--at", "5.0", "--periods", "2")
    assert run_module("gearchaos.response", *onwards, cwd=tmp_path).code == 0
    # To read the configuration again, the file is necessary.
    ended = run_module("gearchaos.sweep", *arguments, "--overwrite", cwd=tmp_path)
    assert ended.code == 2
    assert 'pitch_error.driving.file = "gear.csv": cannot be read: No such file' in ended.err


ROWS = "Fp\n" + "".join(f"{f}\n" for f in F)
FAULTY_FILES = {
    "no column": ("p\n1\n", 'has no column "Fp"; name one of its headings; capitals count'),
    "nothing": ("# note\n", "is empty; give a line of headings and the rows below it"),
    "text": (ROWS.replace("4.0", "four"), "line 3, column Fp: must be a finite number; give"),
    "nan": (ROWS.replace("4.0", "nan"), "line 3, column Fp: must be a finite number; give"),
    "inf": (
        ROWS.replace("4.0", "1e999"),
        "line 3, column Fp: must be a finite number; give",
    ),
    "decimal comma": (ROWS.replace("Fp", "x,Fp").replace("4.0", '0,"4,0"'), "must be a finite"),
    "decimal comma between commas": (
        "No,Fp\n1,0,0\n2,1,5\n3,2,5\n4,3,0\n5,1,0\n",
        "line 2: has 3 cells below 2 headings; correct it; decimals with a comma need semicolons",
    ),
    "twice": ("Fp;Fp\n1;2\n", 'has several columns "Fp"; rename all but one of them'),
    "missing number": (
        "Zahn;Fp\n1;0,0\n2;1,0\n4;1,0\n5;2,0\n6;2,0\n",
        "column Zahn: must hold 0 to n - 1 or 1 to n, each once, and 3 is missing",
    ),
    "number twice": (
        "No;Fp\n1;0.0\n2;1.0\n2;1.0\n4;2.0\n5;2.0\n",
        "column No: must hold 0 to n - 1 or 1 to n, each once, and 2 is there more than once",
    ),
    "numbers from 2": (
        "No;Fp\n2;0.0\n3;1.0\n4;1.0\n5;2.0\n6;2.0\n",
        "each once, and 1 is missing",
    ),
    "short row": (
        "x;Fp\n1;0.0\n\n2\n3;1.0\n",
        "line 4, column Fp: must be a finite number, and the cell is empty; give one for every "
        "tooth, decimals with a point or a comma",
    ),
    "missing tooth": (ROWS.replace("4.0\n", ""), "gear.csv, column Fp: holds 4 values for 5 teeth"),
    "binary": (
        b"\x89HDF\r\n\x1a\n",
        'file = "gear.csv": line 1 is not UTF-8 text; save the file of',
    ),
    "zeros": (bytes(100), 'has no column "Fp"'),
    "huge": (b"Fp\n" + b"0.0\n" * 2_000_000, "larger than 4 MB, so hardly a file of pitch"),
}


@pytest.mark.parametrize(("content", "message"), FAULTY_FILES.values(), ids=FAULTY_FILES)
def test_a_faulty_file_is_refused_with_its_line(content, message, tmp_path):
    data = content if isinstance(content, bytes) else content.encode()
    (tmp_path / "gear.csv").write_bytes(data)
    (tmp_path / "gears.toml").write_text(driving('file = "gear.csv"', 'column = "Fp"'))
    ended = run_module("gearchaos.sweep", "gears.toml", "--dry-run", cwd=tmp_path)
    assert ended.code == 2
    assert message in ended.err and "gear.csv" in ended.err and "pitch_error.driving" in ended.err


SECRET = "Fp\n" + "".join(f"{1000.0 + f}\n" for f in F)


def test_no_message_quotes_a_file_that_a_configuration_names(tmp_path):
    path = tmp_path / "gears.toml"
    for content in ("password 1234\n", "Fp\n0.0\npassword 1234\n", "Fp\n" + 5 * "0.0 1234\n"):
        (tmp_path / "secret").write_text(content)
        path.write_text(driving('file = "secret"', 'column = "Fp"'))
        with pytest.raises(ConfigurationError, match="secret") as caught:
            load_config(path)
        assert "1234" not in str(caught.value)


def stored_elsewhere(folder, text):
    """Write a result whose stored configuration is this text."""
    good_result(folder / "good.h5")
    (folder / "stored.h5").write_bytes((folder / "good.h5").read_bytes()[:-CHECKSUM_LINE])
    with h5py.File(folder / "stored.h5", "r+") as file:
        for name in ("configuration", "configuration_resolved"):
            file.attrs[name] = text


@pytest.mark.parametrize(
    "arguments",
    [
        ("response", "stored.h5", "--at", "0.5"),
        ("stages", "stored.h5", "--refine", "0.1"),
        ("stages", "stored.h5", "--survival", "2"),
        ("basins", "stored.h5"),
        ("info", "stored.h5"),
    ],
)
def test_a_stored_configuration_opens_no_other_file(arguments, tmp_path):
    # The file is valid: a command that opened it would continue.
    (tmp_path / "secret").write_text(SECRET)
    stored_elsewhere(tmp_path, driving('file = "secret"', 'column = "Fp"'))
    module, *rest = arguments
    ended = run_module(f"gearchaos.{module}", *rest, cwd=tmp_path)
    assert "100" not in ended.out + ended.err and "sweep.count" not in ended.out
    if module != "info":
        assert ended.code == 2
        assert 'driving.file = "secret": is not kept under [files]' in ended.err


def test_blocks_of_a_forged_manifest_open_no_other_file(tmp_path):
    (tmp_path / "secret").write_text(SECRET)
    (tmp_path / "gears.h5.blocks").mkdir()
    text = driving('file = "../secret"', 'column = "Fp"')
    manifest = {"configuration": text, "text": text, **SOFTWARE._asdict()}
    (tmp_path / "gears.h5.blocks" / "manifest.json").write_text(json.dumps(manifest))
    ended = run_module("gearchaos.merge", "gears.h5", cwd=tmp_path)
    assert ended.code == 2 and "is not kept under [files]" in ended.err


def test_a_text_reads_files_of_the_folder_that_it_is_given(tmp_path):
    (tmp_path / "gear.csv").write_text(ROWS)
    text = driving('file = "gear.csv"', 'column = "Fp"')
    config = Configuration.from_toml(text, folder=str(tmp_path))
    assert config.pitch_error.driving.cumulative_um == tuple(F)
    again = config.replace("pitch_error.driving", {"file": "gear.csv", "column": "Fp"})
    assert again.pitch_error.driving.cumulative_um == tuple(F)
    with pytest.raises(ConfigurationError, match="read the configuration with load_config"):
        Configuration.from_toml(text)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.csv", 'driving.file = "none.csv": cannot be read: No such file or directory; check'),
        ("pipe", "cannot be read: it is not a regular file; check the path of the file of pitch"),
        (".", "cannot be read: Is a directory; check the path of the file of pitch deviations"),
        ("a\\u0000b", "cannot be read: embedded null byte"),
        ("\\u001b[31m", r'driving.file = "\u001b[31m": cannot be read: No such file'),
    ],
)
def test_a_missing_file_is_refused_with_its_key(name, message, tmp_path):
    # The pipe has no writer: a command that waited for one would never end.
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "gears.toml").write_text(driving(f'file = "{name}"', 'column = "Fp"'))
    ended = run_module("gearchaos.sweep", "gears.toml", "--dry-run", cwd=tmp_path)
    assert ended.code == 2 and message in ended.err


GRADE = '[pitch_error]\nkind = "grade"\ngrade = 7\n'
LISTED = f"{ERROR}[pitch_error.driving]\ncumulative_um = {F}\n"
FAULTS = {
    "no gear": (ERROR, (), 'pitch_error: kind = "teeth" needs the deviations of a gear; give [pi'),
    "no list": (f"{ERROR}[pitch_error.driven]\n", (), "pitch_error.driven: holds 0 lists of devi"),
    "two lists": (f"{LISTED}single_um = {SINGLE}\n", (), "pitch_error.driving: holds 2 lists"),
    "teeth": (LISTED.replace("0.0, ", ""), (), "cumulative_um: holds 4 values for 5 teeth; give"),
    "sum": (
        f"{ERROR}[pitch_error.driving]\nsingle_um = [1.0, 4.0, -3.0, -3.0, 3.0]\n",
        (),
        "single_um: sum to 2 um, and single deviations around a circle sum to zero; look for",
    ),
    "module": (
        LISTED.replace("4.0", "216.7"),
        (),
        "cumulative_um: place a tooth 216.7 um off tooth 0, more than a tenth of the module; give",
    ),
    "endless": (LISTED.replace("4.0, 1.0", "1e308, -1e308"), (), "place a tooth 1e+308 um off"),
    "endless single ones": (
        f"{ERROR}[pitch_error.driving]\nsingle_um = [-1.5e308, 1e308, 1e308, -1e308, 0.5e308]\n",
        (),
        "um off tooth 0, more than a tenth of the module",
    ),
    "a text": (LISTED.replace("4.0", '"4"'), (), 'cumulative_um[1] = "4": must be a number'),
    "a nan": (LISTED.replace("4.0", "nan"), (), "cumulative_um[1] = nan: must be a finite number"),
    "amplitude": (
        LISTED.replace(ERROR, f"{ERROR}amplitude_um = 3.0\n"),
        (),
        'pitch_error.amplitude_um = 3.0: has no meaning with kind = "teeth"; drop it, or choose an',
    ),
    "phase group": (
        GRADE,
        ["groups.pitch_error_phase_deg=3.0"],
        'groups.pitch_error_phase_deg: has no meaning with pitch_error.kind = "grade"; drop it',
    ),
    "swept amplitude": (
        GRADE,
        ["sweep.parameter=pitch_error_amplitude"],
        'sweep.parameter: has no meaning with pitch_error.kind = "grade"; drop it',
    ),
    "swept key": (
        LISTED,
        ["sweep.parameter=pitch_error.grade", "sweep.from=1.0"],
        'sweep.parameter = "pitch_error.grade": has no meaning with pitch_error.kind = "teeth"',
    ),
    "swept smoothing": (LISTED, ["sweep.parameter=pitch_error.smoothing"], "cannot|that can be sw"),
    "flow map": (
        LISTED,
        ["integration={method='flow_map'}"],
        'pitch_error.kind = "teeth": cannot be computed with integration.method = "flow_map"; set',
    ),
    "no pair": (GRADE, ["pair="], 'pair: is missing, and pitch_error.kind = "grade" takes teeth'),
    "kind": ("[pitch_error]\nkind = 3\n", (), "pitch_error.kind = 3: must be one of 'sine', 'te"),
    "smoothing": (
        GRADE,
        ["pitch_error.smoothing=1e-7"],
        "smoothing = 1e-07: must be at least 0.01",
    ),
    "no kind": ("[pitch_error]\ngrade = 7\n", (), 'grade = 7: has no meaning with kind = "sine"'),
    "grade -1": (GRADE, ["pitch_error.grade=-1"], "pitch_error.grade = -1: must be at least 0"),
    "grade 13": (GRADE, ["pitch_error.grade=13"], "pitch_error.grade = 13: must be at most 12"),
    "half a grade": (GRADE, ["pitch_error.grade=7.5"], "grade = 7.5: must be a whole number"),
    "edition": (GRADE, ["pitch_error.edition=2008"], "edition = 2008: must be one of 1995 or 2013"),
    "grade 12 of 2013": (
        GRADE,
        ["pitch_error.edition=2013", "pitch_error.grade=12"],
        "pitch_error: grade 12: ISO 1328-1:2013 has grades 1 to 11; choose within",
    ),
    "many teeth in 2013": (
        GRADE,
        ["pitch_error.edition=2013", "pair.teeth=[21, 1001]"],
        "pitch_error: number of teeth 1001: ISO 1328-1:2013 goes from 5 to 1000; choose within",
    ),
    "steep teeth in 2013": (
        GRADE,
        ["pitch_error.edition=2013", "pair.helix_angle_deg=46.0"],
        "pitch_error: helix angle 46 degree: ISO 1328-1:2013 goes from 0 to 45 degree; choose",
    ),
    "narrow gear in 2013": (
        GRADE,
        ["pitch_error.edition=2013", "pair.face_width_mm=3.0"],
        "pitch_error: face width 3 mm: ISO 1328-1:2013 goes from 4 to 1200 mm; choose within",
    ),
    "small gear": (GRADE, ["pair.normal_module_mm=0.4"], "normal module 0.4 mm: ISO 1328-1:1995 g"),
    "swept half grades": (
        GRADE,
        ["sweep={parameter='pitch_error.grade', from=5.0, to=7.0, count=4}"],
        "sweep: grades are whole numbers, and it sweeps others; choose from, to and count",
    ),
    "swept grade 13": (
        GRADE,
        ["sweep={parameter='pitch_error.grade', values=[12.0, 13.0]}"],
        "pitch_error.grade must be finite and >= 0 and <= 12",
    ),
    "swept grade, effect off": (
        GRADE,
        ["sweep={parameter='pitch_error.grade', values=[5.0]}", "scene.effects=['backlash']"],
        "changes nothing in this scene",
    ),
    "realisations of a sine": (
        "[pitch_error]\namplitude_um = 1.0\nrealisations = 3\n",
        (),
        'pitch_error.realisations = 3: has no meaning with kind = "sine"; drop it',
    ),
    "too many lanes": (
        GRADE,
        ["pitch_error.realisations=1000000", "sweep.count=101"],
        "drawn gear",
    ),
}


@pytest.mark.parametrize(("error", "overrides", "message"), FAULTS.values(), ids=FAULTS)
def test_every_fault_has_one_clear_message(error, overrides, message, tmp_path):
    text = text_of(error)
    if "pair=" in overrides:
        start, end = text.index("[pair]"), text.index("[operation]")
        text, overrides = text[:start] + text[end:], ()
    (tmp_path / "gears.toml").write_text(text)
    sets = [word for override in overrides for word in ("--set", override)]
    ended = run_module("gearchaos.sweep", "gears.toml", "--dry-run", *sets, cwd=tmp_path)
    assert ended.code == 2 and "gears.toml: " in ended.err
    assert any(one in ended.err for one in message.split("|")), ended.err


def test_files_of_before_are_files_of_a_sine():
    config = Configuration.from_toml(SMALL)
    assert config.pitch_error.kind == "sine" and config.pitch_error.phase_deg == 30.0
    assert Configuration.from_toml(config.resolved_toml()) == config


SHEET = """\ufeffInspection report;gear 4711
Messung;12.03.;
Teilungsabweichungen in µm;;

Zahn-Nr.;Fp rechts;Fp links
;µm;µm
{rows}
Fp;21,5;20,1
"""


def sheet(order, begin: int, mark: str = ";") -> str:
    """Return an inspection sheet with the teeth in this order; their numbers begin at 0 or 1."""
    rows = (f"{k + begin};{F[k]:.1f};{-F[k]:.1f}".replace(".", ",") for k in order)
    return SHEET.format(rows="\n".join(rows)).replace(";", mark)


@pytest.mark.parametrize("mark", [";", "\t"])
@pytest.mark.parametrize("begin", [0, 1])
def test_an_inspection_sheet_is_read_as_it_comes(begin, mark, tmp_path):
    # Rows in another order are sorted by tooth number.
    text = sheet([2, 0, 4, 1, 3], begin, mark)
    (tmp_path / "sheet.csv").write_text(text, encoding="utf-8")
    path = tmp_path / "gears.toml"
    for column, sign in (("Fp rechts", 1.0), ("Fp links", -1.0)):
        path.write_text(driving('file = "sheet.csv"', f'column = "{column}"'))
        found = load_config(path).pitch_error.driving.cumulative_um
        assert found == pytest.approx([sign * round(f, 1) for f in F])
    # A column of tooth numbers may have any heading if the configuration names it.
    (tmp_path / "sheet.csv").write_text(text.replace("Zahn-Nr.", "dent"), encoding="utf-8")
    keys = ('file = "sheet.csv"', 'column = "Fp rechts"', 'tooth_column = "dent"')
    path.write_text(driving(*keys))
    assert load_config(path).pitch_error.driving.cumulative_um == pytest.approx(
        [round(f, 1) for f in F]
    )


@pytest.mark.parametrize("heading", ["Tooth #", "Zahn Nr.", "z", "dent"])
def test_a_column_that_numbers_all_teeth_gives_their_order_whatever_its_heading(heading, tmp_path):
    rows = [f"{number};{F[number - 1]:.1f}" for number in (3, 1, 5, 2, 4)]
    (tmp_path / "sheet.csv").write_text("\n".join([f"{heading};Fp", *rows]), encoding="utf-8")
    path = tmp_path / "gears.toml"
    path.write_text(driving('file = "sheet.csv"', 'column = "Fp"'))
    found = load_config(path).pitch_error.driving.cumulative_um
    assert found == pytest.approx([round(f, 1) for f in F])


@pytest.mark.parametrize("heading", ["Fp [mm]", "Fp (in)", "fp_mm", "Fp (µm)", "Fp [um]", "Fp_um"])
def test_deviations_headed_in_another_unit_than_um_are_refused(heading, tmp_path):
    rows = [f"{number};{one:.1f}" for number, one in enumerate(F)]
    (tmp_path / "sheet.csv").write_text("\n".join([f"Nr;{heading}", *rows]), encoding="utf-8")
    path = tmp_path / "gears.toml"
    path.write_text(driving('file = "sheet.csv"', f'column = "{heading}"'), encoding="utf-8")
    if heading[-3:].strip("[(_])") in ("mm", "in"):
        with pytest.raises(ConfigurationError, match="deviations are read in um; convert"):
            load_config(path)
    else:
        assert len(load_config(path).pitch_error.driving.cumulative_um) == len(F)


@pytest.mark.parametrize(
    "heading", ["fp", "fpt links", "f_p [um]", "Single pitch", "Einzelteilung"]
)
def test_a_column_headed_as_single_deviations_is_not_read_as_cumulative_ones(heading, tmp_path):
    rows = [f"{number};{one:.1f}" for number, one in enumerate(np.subtract(F, np.mean(F)))]
    (tmp_path / "sheet.csv").write_text("\n".join([f"Nr;{heading}", *rows]), encoding="utf-8")
    path = tmp_path / "gears.toml"
    keys = ('file = "sheet.csv"', f'column = "{heading}"')
    path.write_text(driving(*keys))
    with pytest.raises(ConfigurationError, match=r'as single deviations.*set holds = "single"'):
        load_config(path)
    for holds in "single", "cumulative":
        path.write_text(driving(*keys, f'holds = "{holds}"'))
        assert getattr(load_config(path).pitch_error.driving, f"{holds}_um") is not None


def test_columns_that_number_the_teeth_differently_are_refused(tmp_path):
    rows = [f"{row};{6 - row};{F[row - 1]:.1f}" for row in range(1, 6)]
    (tmp_path / "sheet.csv").write_text("\n".join(["Nr;Zahn;Fp", *rows]), encoding="utf-8")
    path = tmp_path / "gears.toml"
    path.write_text(driving('file = "sheet.csv"', 'column = "Fp"'))
    with pytest.raises(ConfigurationError, match=r"Nr, Zahn number the teeth in different orders"):
        load_config(path)
    path.write_text(driving('file = "sheet.csv"', 'column = "Fp"', 'tooth_column = "Zahn"'))
    found = load_config(path).pitch_error.driving.cumulative_um
    assert found == pytest.approx([round(f, 1) for f in reversed(F)])


def test_what_was_understood_is_a_note_before_the_sweep():
    path = Path(__file__).resolve().parents[2] / "sweeps" / "inspection.toml"
    notes = plan_run(load_config(path)).notes
    driving_note, driven_note = (note for note in notes if "gear:" in note)
    # The gears of the file just pass grade 7.
    assert driving_note.startswith("driving gear: 21 teeth of inspection.csv, column driving")
    assert driving_note.endswith("single deviation 10.5 um: grade 7 of ISO 1328-1:1995")
    assert driven_note.endswith("grade 7 of ISO 1328-1:1995") and "38 teeth" in driven_note


def test_deviations_in_millimetres_are_noticed():
    given = ", ".join(f"{f / 1000.0}" for f in F)
    text = driving(f"cumulative_um = [{given}]").replace("steps_per_period = 40\n", "")
    config = Configuration.from_toml(text, "mm.toml")
    assert any("probably given in mm" in note for note in plan_run(config).notes)
