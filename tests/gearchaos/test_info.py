"""The info command describes a result file."""

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from gearchaos.outputs.variable import coordinate
from gearchaos.results.files.atomic_file import append_checksum
from gearchaos.results.reading.overview import overview
from gearchaos.results.reading.result import Result, open_result

from .commands import run_module
from .fuzz_results import CHECKSUM_LINE, LANES, good_result
from .test_result_axes import AXES, result_over


@pytest.fixture
def good(tmp_path):
    path = tmp_path / "good.h5"
    good_result(path)
    return path


def info(path, *arguments):
    return run_module("gearchaos.info", path.name, *arguments, cwd=path.parent)


def without_checksum(path):
    path.write_bytes(path.read_bytes()[:-CHECKSUM_LINE])


def test_the_page_says_what_was_computed_in_80_columns(good):
    ended = info(good)
    assert (ended.code, ended.err) == (0, "")
    assert max(map(len, ended.out.splitlines())) <= 80
    for words in ("a small result", f"load (static load), {LANES} values, 0 to 1", "damping_ratio"):
        assert words in ended.out
    assert re.search(r"section error +\S+ \(median\)", ended.out)
    assert "section_delta_5 (load, section_point) float64" in ended.out


def test_json_holds_the_numbers_of_the_file(good):
    ended = info(good, "--json", "--verify", "-q")
    assert (ended.code, ended.err) == (0, "")
    facts = json.loads(ended.out, parse_constant=pytest.fail)
    result = open_result(good)
    assert facts["lanes"] == LANES
    assert facts["axes"]["load"]["greatest"] == result["load"].max()
    assert facts["parameters"]["stiffness_cosine"]["value"] == [0.1, 0.2]
    assert facts["counts"]["status"]["diverged"] == (result["status"] == 1).sum()
    assert facts["variables"].keys() == set(result)
    assert all(facts["variables"][name]["dims"] == [*result.dims(name)] for name in result)
    assert len(facts["verified"]) == 3


def test_what_is_not_finite_becomes_null(good):
    without_checksum(good)
    with h5py.File(good, "r+") as file:
        file["section_error"][...] = float("nan")
        file["parameters/damping_ratio"][...] = float("inf")
    facts = overview(good)
    assert facts["errors"]["section_error"] == {
        "values": 0,
        "least": None,
        "median": None,
        "greatest": None,
        "units": "1",
    }
    assert facts["parameters"]["damping_ratio"]["value"] is None


def test_what_bears_a_known_name_may_be_something_else(good):
    without_checksum(good)
    with h5py.File(good, "r+") as file:
        del file["lyapunov_exponent"], file["lyapunov_exponent_standard_error"]
        file["lyapunov_exponent_standard_error"] = np.ones(LANES, "u1")
        file["lyapunov_exponent_standard_error"].attrs["dims"] = "load"
        file["motion_code"] = np.full(LANES, -1.0)
        file["motion_code"].attrs.update({"dims": "load", "flag_meanings": "one other"})
    facts = overview(good)
    assert facts["errors"]["lyapunov_exponent_standard_error"]["greatest"] == 1
    assert "motion_code" not in facts["counts"]
    assert info(good).code == 0


def test_arrays_that_are_damaged_are_named(good):
    with h5py.File(good) as file:
        chunk = file["section_delta_5"].id.get_chunk_info(0)
    content = bytearray(good.read_bytes())
    content[chunk.byte_offset + 5] ^= 1
    good.write_bytes(content)
    ended = info(good, "--verify")
    assert (ended.code, ended.out) == (4, "")
    assert "its checksum does not fit" in ended.err
    # The damage is also found without the checksum of the whole file, and with a new one.
    good.write_bytes(content[:-CHECKSUM_LINE])
    assert "damaged in section_delta_5" in info(good, "--verify").err
    append_checksum(good)
    assert info(good, "--verify").code == 4


def test_a_newer_format_is_refused_in_a_sentence(good):
    without_checksum(good)
    with h5py.File(good, "r+") as file:
        file.attrs["schema_version"] = "4.0"
    ended = info(good)
    assert ended.code == 4
    assert "has version '4.0' of the file format; this gearchaos reads 3.x" in ended.err


@pytest.mark.skipif(not Path("/proc/self/mem").is_file(), reason="/proc/self/mem does not exist")
def test_a_file_that_cannot_be_read_is_named_in_our_own_words(tmp_path):
    # Even the superuser cannot read the beginning of this file.
    ended = run_module("gearchaos.info", "--verify", "/proc/self/mem", cwd=tmp_path)
    assert ended.code == 4
    assert "error: /proc/self/mem: cannot be read: " in ended.err.splitlines()[-1]


def test_control_characters_do_not_reach_the_terminal(good):
    without_checksum(good)
    with h5py.File(good, "r+") as file:
        file.attrs["title"] = "\x1b[2Jtitle\x07"
    ended = info(good)
    assert ended.code == 0
    assert "\x1b" not in ended.out
    assert "\N{REPLACEMENT CHARACTER}[2Jtitle" in ended.out


def test_reading_leaves_the_file_as_it_was(good, tmp_path):
    before = good.read_bytes()
    assert info(good, "--verify").code == 0
    assert good.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["good.h5"]


def test_several_axes_are_listed_and_the_stages_are_those_of_a_named_slice(tmp_path):
    result = result_over(AXES["two parameters, several starts"])
    path = tmp_path / "several.h5"
    result.save(path)
    out = info(path).out
    assert max(map(len, out.splitlines())) <= 80
    words = " ".join(out.split())
    for text in (
        "axis load (static load), 3 values, 0.1 to 0.5",
        "axis pitch_error (pitch error), 7 values, 0 to 3",
        "axis start (number of the start among those of one parameter value), 2 values, 0 to 1",
        "lanes 42",
        f"status {(result['status'] == 0).sum()} ok, {(result['status'] == 1).sum()} diverged",
        "Stages slice load = 0.1; others with --at load=VALUE",
        "slice start = 0; others with --at start=VALUE",
        "(load, pitch_error, start, section_point) float64",
    ):
        assert text in words
    facts = json.loads(info(path, "--json").out)
    assert facts["lanes"] == 42
    assert facts["slice"]["start"] == 0.0
    assert sum(stage["lanes"] for stage in facts["stages"]) == 7


@pytest.mark.parametrize("lanes", [20, 31])
def test_of_many_stages_the_first_and_the_last_are_shown(lanes, tmp_path):
    result = result_over((coordinate("load", "1", "static load", "", np.arange(float(lanes))),))
    data = {name: result[name] for name in result}
    data["period"], data["motion"] = np.arange(lanes) + 1, np.zeros(lanes)
    variables = list(result.variables.values())
    Result(result.axes, variables, data, {}, {}).save(tmp_path / "many.h5")
    lines = info(tmp_path / "many.h5").out.split("Stages\n")[1].split("\n\n")[0].splitlines()
    if lanes == 20:
        assert [line.split(":")[0] for line in lines] == [f"  period {n}" for n in range(1, 21)]
    else:
        assert lines[0] == "  31 stages: the first 10 and the last 10"
        shown = [line.split(":")[0] for line in lines[1:]]
        assert shown == [f"  period {n}" for n in (*range(1, 11), *range(22, 32))]
