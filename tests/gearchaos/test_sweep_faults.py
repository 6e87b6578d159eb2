"""Bad input of the sweep command gives one clear message per fault, and no file is lost or left."""

import os
import resource
import sys
from pathlib import Path

import pytest

from .commands import names_in, run_module, small_config, sweep

FAULTS = {
    "misspelt key": ("sweep.cuont=3", "sweep.cuont = 3: unknown key; did you mean `count`?"),
    "wrong type": ('pair.face_width_mm="15"', "write it without the quotes: 15"),
    "negative mass": ("pair.masses_kg=[-0.2, 0.7]", "pair.masses_kg[0] = -0.2: must be greater"),
    "NaN": ("groups.load=nan", "groups.load = nan: must be a finite number"),
    "zero lanes": ("sweep.count=0", "sweep.count = 0: must be at least 1"),
    "unknown effect": ('scene.effects=["backlsh"]', "did you mean `backlash`?"),
    "swept effect off": ("scene.effects=[]", 'add "pitch_error" to scene.effects'),
    "no number": ("sweep.count=many", 'sweep.count = "many": must be a whole number'),
    "no text": ("title=\udcff", "override 'title=\\udcff': is not UTF-8 text"),
    "no text in the key": ("\udcff=3", "is not UTF-8 text"),
    "endless key": ("k" * 100_000 + "=3", "unknown key; the keys of the top level are title"),
    "endless name": ("sweep.parameter=" + "k" * 100_000, "is not a parameter that can be swept"),
    "more periods than memory": (
        "integration.recorded_periods=1_000_000_000",
        "integration.recorded_periods = 1000000000, outputs.section_points = 5: a block of lanes "
        "takes ",
    ),
    "more steps than there are": (
        "bearings.axial_stiffness_N_per_m=[3e7, 4e157]",
        "check the magnitudes behind it: there are at most 1000000 steps",
    ),
    "no key": ("garbage", "override 'garbage': must have the form key.path=value"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_configuration_is_one_line_and_code_2(tmp_path, fault):
    override, message = FAULTS[fault]
    section = ("--set", 'outputs.section=["delta_5"]')  # Valid in every scene.
    ended = sweep(tmp_path, *section, "--set", override)
    assert (ended.code, ended.out) == (2, "")
    line, *causes = ended.err.splitlines()
    assert line.startswith("gearchaos sweep: error: ")
    assert message in line
    assert len(line) < 1300
    # A further line may only name the value that is the probable cause.
    assert causes == [] or (len(causes) == 1 and f"{override.split('=')[0]} = " in causes[0])
    assert names_in(tmp_path) == ["gears.toml"]


def test_all_faults_of_a_configuration_are_reported_at_once(tmp_path):
    text = small_config(tmp_path).read_text()
    for right, wrong in {
        "teeth": "theet",
        "count = 40": "count = 0",
        "m = 50.0": "m = nan",
    }.items():
        text = text.replace(right, wrong)
    (tmp_path / "bad.toml").write_text(text)
    ended = run_module("gearchaos.sweep", "bad.toml", cwd=tmp_path)
    assert ended.code == 2
    lines = ended.err.splitlines()
    assert all(line.startswith("gearchaos sweep: error: bad.toml: ") for line in lines)
    for key in ("pair.theet", "sweep.count", "operation.torque_Nm", "pair.teeth"):
        assert sum(f": {key}" in line for line in lines) == 1, lines
    assert len(lines) == 4


def test_two_faults_in_overrides_are_reported_at_once(tmp_path):
    ended = sweep(tmp_path, "--set", "sweep.count=0", "--set", "start.kind=rset")
    assert ended.code == 2
    first, second = sorted(ended.err.splitlines())
    assert 'start.kind = "rset"' in first
    assert "sweep.count = 0" in second


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--threads", "0"], "threads = 0: must be between 1 and"),
        (["--threads", "9999"], "threads = 9999: must be between 1 and"),
        (["--threads", "x"], "argument --threads: 'x' is not a finite number; see"),
        (
            ["--thread", "1"],
            "unrecognized arguments: --thread 1 (did you mean --threads?); see gearchaos sweep",
        ),
        (["--set"], "argument --set: expected one argument; see gearchaos sweep --help"),
        (["more.toml"], "unrecognized arguments: more.toml; see gearchaos sweep --help"),
    ],
)
def test_a_fault_of_the_command_line_is_code_2(tmp_path, arguments, message):
    ended = sweep(tmp_path, *arguments)
    assert (ended.code, ended.out) == (2, "")
    (line,) = ended.err.splitlines()
    assert line.startswith("gearchaos sweep: error: ")
    assert message in line
    assert names_in(tmp_path) == ["gears.toml"]


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (
            "none.toml",
            "none.toml: cannot be read: No such file or directory; check the path of the con",
        ),
        (".", ".: cannot be read: Is a directory; check the path of the configuration"),
        ("", "the path is empty; name a TOML file"),
    ],
)
def test_a_configuration_that_cannot_be_read_is_code_4(tmp_path, config, message):
    ended = run_module("gearchaos.sweep", config, cwd=tmp_path)
    assert (ended.code, ended.out) == (4, "")
    (line,) = ended.err.splitlines()
    assert message in line
    assert names_in(tmp_path) == []


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("folder", "folder: is a directory; give the name of a file in it"),
        ("none/gears.h5", "none/gears.h5: cannot be written: No such file or directory; create"),
        ("gears.h5/", "'gears.h5/': is not a file name; give the name of a file"),
        ("", "'': is not a file name; give the name of a file"),
        (os.devnull, f"{os.devnull}: is not a regular file; give the name of a file"),
        ("gears.toml", "gears.toml: is the input itself; choose another --output"),
        ("gears.PNG", "gears.PNG: this command writes an HDF5 file, which .png is no ending for;"),
        ("gears.csv", "and then use gearchaos export"),
    ],
)
def test_an_output_that_cannot_be_is_code_4_before_anything_is_computed(tmp_path, output, message):
    (tmp_path / "folder").mkdir()
    ended = sweep(tmp_path, "--output", output, "--overwrite")
    assert (ended.code, ended.out) == (4, "")
    (line,) = ended.err.splitlines()
    assert message in line
    assert names_in(tmp_path) == ["folder", "gears.toml"]
    assert names_in(tmp_path / "folder") == []


@pytest.mark.skipif(not Path("/sys/kernel").is_dir(), reason="needs a folder that is not writable")
def test_a_read_only_place_is_code_4(tmp_path):
    ended = sweep(tmp_path, "--output", "/sys/kernel/gears.h5")
    assert (ended.code, ended.out) == (4, "")
    (line,) = ended.err.splitlines()
    assert "/sys/kernel/gears.h5: cannot be written: " in line
    assert line.endswith("; choose another place")


@pytest.mark.parametrize("arguments", [[], ["--resume"]])
def test_an_existing_output_is_kept_byte_for_byte(tmp_path, arguments):
    (tmp_path / "gears.h5").write_bytes(b"precious")
    ended = sweep(tmp_path, *arguments)
    assert (ended.code, ended.out) == (4, "")
    (line,) = ended.err.splitlines()
    assert "gears.h5: exists already; replace it with --overwrite" in line
    assert (tmp_path / "gears.h5").read_bytes() == b"precious"
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]


def test_an_existing_output_is_replaced_where_that_is_asked_for(tmp_path):
    (tmp_path / "gears.h5").write_bytes(b"not so precious")
    assert sweep(tmp_path, "--overwrite", "--quiet") == (0, "gears.h5\n", "")
    assert (tmp_path / "gears.h5").read_bytes()[1:4] == b"HDF"
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]


@pytest.mark.skipif(sys.platform != "linux", reason="limits of file sizes differ elsewhere")
def test_a_full_disk_costs_neither_the_old_result_nor_the_finished_lanes(tmp_path):
    assert sweep(tmp_path, "--quiet").code == 0  # From now on, the kernel is in the cache.
    old = (tmp_path / "gears.h5").read_bytes()
    arguments = ["--overwrite", "--set", "pitch_error.mean_um=1.0"]
    # There is room for the block of lanes, about 12 kB, but not for the result with its texts.
    room = 14_000
    ended = sweep(tmp_path, *arguments, largest_file=room)
    assert (ended.code, ended.out) == (4, "")
    assert "gears.h5: cannot be written: File too large" in ended.err
    assert "gearchaos sweep: 40 of 40 lanes are kept\n" in ended.err
    assert (tmp_path / "gears.h5").read_bytes() == old
    assert names_in(tmp_path) == ["gears.h5", "gears.h5.blocks", "gears.toml"]
    again = sweep(tmp_path, *arguments, "--resume")
    assert again.code == 0
    assert "lanes/s" not in again.err  # No lanes were left to compute.
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]


@pytest.mark.skipif(sys.platform != "linux", reason="limits of file sizes differ elsewhere")
def test_a_disk_that_fills_up_in_the_middle_costs_the_blocks_that_do_not_fit(tmp_path):
    several = ("--set", "sweep.count=1000", "--threads", "1")
    assert sweep(tmp_path, *several, "--shard", "1/2", "--quiet").code == 0
    ended = sweep(tmp_path, *several, "--resume", largest_file=20_000)
    assert (ended.code, ended.out) == (4, "")
    assert ".block: cannot be written: File too large" in ended.err
    assert "gearchaos sweep: 512 of 1000 lanes are kept\n" in ended.err
    assert names_in(tmp_path) == ["gears.h5.blocks", "gears.toml"]
    assert sweep(tmp_path, *several, "--resume", "--quiet") == (0, "gears.h5\n", "")


@pytest.mark.skipif(sys.platform != "linux", reason="limits of file sizes differ elsewhere")
def test_a_disk_that_was_full_from_the_start_leaves_nothing_behind(tmp_path):
    sweep(tmp_path, "--dry-run")

    # The limit is smaller than the output on stderr: stderr is therefore a pipe.
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    ended = sweep(tmp_path, preexec_fn=limit)
    assert (ended.code, ended.out) == (4, "")
    assert "File too large; raise the limit on the size of files" in ended.err
    assert names_in(tmp_path) == ["gears.toml"]


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory differ elsewhere")
def test_memory_that_does_not_suffice_is_code_4(tmp_path):
    periods = ("--set", "integration.recorded_periods=50_000_000", "--set", "sweep.count=8")
    limit = (3 << 30, 3 << 30)
    ended = sweep(
        tmp_path, *periods, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit)
    )
    assert (ended.code, ended.out) == (4, "")
    assert "error: Unable to allocate" in ended.err
