"""A sweep of two parameters with several starts: the command, and all readers of its file."""

import json
import signal
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

import gearchaos

from .commands import SMALL, names_in, run_module, same_data, signalled

LOADS = np.linspace(0.1, 0.5, 5)
ERRORS = np.linspace(0.0, 5.0, 40)
STARTS = 3
SETTLED = "transient_periods = 150\nrecorded_periods = 40"
# Three blocks of lanes, cut across both axes, that take a second or two in total.
BOTH = SMALL.replace(
    "[integration]",
    f"""\
[second_sweep]
parameter = "load"
from = 0.1
to = 0.5
count = {LOADS.size}

[start]
kind = "random"
seed = 7
count = {STARTS}

[integration]""",
).replace("transient_periods = 5\nrecorded_periods = 10", SETTLED)
BLOCKS = "both.h5.blocks"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "both.toml").write_text(BOTH, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "both.toml").write_text(BOTH, encoding="utf-8")
    assert sweep(folder) == (0, "both.h5\n", "")
    return folder / "both.h5"


@pytest.fixture(scope="module")
def result(path):
    return gearchaos.open_result(path)


def sweep(folder, *arguments):
    return run_module("gearchaos.sweep", "both.toml", "--quiet", *arguments, cwd=folder)


def of_the_file(module, path, *arguments):
    ended = run_module(f"gearchaos.{module}", path.name, "-q", *arguments, cwd=path.parent)
    assert (ended.code, ended.err) == (0, "")
    return ended.out


def test_each_axis_is_a_dimension_with_a_coordinate_of_its_own(result):
    assert result.axes == ("load", "pitch_error", "start")
    assert result.axis == "pitch_error"
    assert result["status"].shape == (LOADS.size, ERRORS.size, STARTS)
    assert not result["status"].any()
    for name, values in (("load", LOADS), ("pitch_error", ERRORS), ("start", np.arange(STARTS))):
        assert result[name] == pytest.approx(values)
        assert result.dims(name) == (name,)
    assert result.parameters["load"].dims == ("load",)
    assert result.parameters["pitch_error"].dims == ("pitch_error",)


@pytest.mark.parametrize(("row", "column", "start"), [(0, 39, 0), (2, 7, 2), (4, 0, 1)])
def test_a_lane_is_what_its_coordinates_and_its_start_state_give(result, row, column, start):
    place = (row, column, start)
    names = list(result.variables["state"].flags)
    state = dict(zip(names, result["start_state"][place].tolist(), strict=True))
    given = "{" + ", ".join(f"{name}={value!r}" for name, value in state.items()) + "}"
    values = {
        "load": float(result["load"][row]),
        "pitch_error": float(result["pitch_error"][column]),
    }
    both = gearchaos.Configuration.from_toml(BOTH, "both.toml")
    alone = gearchaos.Configuration.from_toml(
        both.at(values).resolved_toml(), "alone.toml", [f"start={{kind='given', state={given}}}"]
    )
    lane = gearchaos.run(alone)
    assert lane.axes == ("pitch_error",)
    for name in ("start_state", "end_state", "section_delta_5", "lyapunov_exponent", "period"):
        assert np.array_equal(lane[name][0], result[name][place]), name


def test_python_gives_the_same_bits(result):
    assert same_data(gearchaos.run(gearchaos.Configuration.from_toml(BOTH, "both.toml")), result)


def test_stopped_half_way_and_resumed_it_is_the_same(folder, result):
    code, out, err = signalled(folder, BLOCKS, signal.SIGINT, "both.toml", "--threads", "1")
    assert (code, out) == (130, ""), err
    assert " of 600 lanes are kept" in err
    kept = len(list((folder / BLOCKS).glob("*.block")))
    assert 0 < kept < 5
    assert sweep(folder, "--resume") == (0, "both.h5\n", "")
    assert names_in(folder) == ["both.h5", "both.toml"]
    assert same_data(gearchaos.open_result(folder / "both.h5"), result)


def test_computed_in_shards_and_merged_it_is_the_same(folder, result):
    for number in (2, 1):
        assert sweep(folder, "--shard", f"{number}/2").code == 0
    assert run_module("gearchaos.merge", "both.h5", "-q", cwd=folder) == (0, "both.h5\n", "")
    assert names_in(folder) == ["both.h5", "both.toml"]
    merged = gearchaos.open_result(folder / "both.h5")
    assert same_data(merged, result)
    differing = {key for key, fact in result.metadata.items() if merged.metadata.get(key) != fact}
    assert differing <= {"created", "threads", "wall_time_seconds"}


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_xarray_finds_the_nearest_lanes(engine, path, result):
    with xr.open_dataset(path, engine=engine) as whole:
        assert dict(whole["end_state"].sizes) == {
            "load": LOADS.size, "pitch_error": ERRORS.size, "start": STARTS, "state": 10,
        }  # fmt: skip
        there = whole.sel(pitch_error=3.0, method="nearest")
        assert there["lyapunov_exponent"].dims == ("load", "start")
        column = int(np.abs(ERRORS - 3.0).argmin())
        assert float(there["pitch_error"]) == result["pitch_error"][column]
        assert np.array_equal(there["end_state"], result["end_state"][:, column])
        lane = whole.sel(pitch_error=3.0, load=0.33, start=2, method="nearest")
        row = int(np.abs(LOADS - 0.33).argmin())
        assert np.array_equal(lane["section_delta_5"], result["section_delta_5"][row, column, 2])
        part = result.sel("nearest", pitch_error=3.0, load=0.33, start=2)
        assert np.array_equal(lane["section_delta_5"], part["section_delta_5"])


def test_info_reports_every_axis_and_which_slice_its_stages_are_of(path, result):
    words = " ".join(of_the_file("info", path).split())
    for text in (
        "axis load (static load), 5 values, 0.1 to 0.5",
        "axis pitch_error (multiple of the pitch error), 40 values, 0 to 5",
        "3 values, 0 to 2 lanes 600",
        "status 600 ok",
        "Stages slice load = 0.1; others with --at load=VALUE "
        "slice start = 0; others with --at start=VALUE",
        "section_delta_5 (load, pitch_error, start, section_point) float64",
    ):
        assert text in words, words
    facts = json.loads(of_the_file("info", path, "--json", "--verify"))
    assert facts["lanes"] == result["status"].size
    motions = result.variables["motion"].flags
    counted = np.bincount(result["motion"].ravel(), minlength=len(motions)).tolist()
    assert facts["counts"]["motion"] == dict(zip(motions, counted, strict=True))
    assert all(facts["variables"][name]["dims"] == [*result.dims(name)] for name in result)


@pytest.mark.parametrize(("load", "row"), [(0.1, 0), (0.33, 2)])
def test_stages_are_those_of_the_slice_that_is_named(path, result, load, row):
    facts = json.loads(
        of_the_file("stages", path, "--at", f"load={load}", "--at", "start=1", "--json")
    )
    assert facts["parameter"] == "pitch_error"
    assert facts["slice"] == {
        "load": result["load"][row],
        "start": 1.0,
    }
    listed = np.repeat(
        [stage["period"] for stage in facts["stages"]],
        [stage["lanes"] for stage in facts["stages"]],
    )
    assert np.array_equal(listed, result["period"][row, :, 1])


def test_lanes_of_random_starts_are_not_refined(path):
    ended = run_module("gearchaos.stages", path.name, "--refine", "0.1", cwd=path.parent)
    assert (ended.code, ended.out) == (2, "")
    assert "nothing lies between lanes whose starts are carried on, random" in ended.err


def test_a_slice_is_refined_like_the_sweep_of_one_parameter_that_it_is(tmp_path):
    # With well damped bearings, the motion at the lighter load doubles its period in this range.
    text = BOTH[: BOTH.index("[start]")] + BOTH[BOTH.index("[integration]") :]
    (tmp_path / "both.toml").write_text(text, encoding="utf-8")
    overrides = [f"groups.{way}_damping_{g}=0.05" for way in ("transverse", "axial") for g in "pg"]
    overrides += ["formulation=published", "sweep.from=9.0", "sweep.to=14.0", "sweep.count=5"]
    overrides += ["second_sweep.count=2"]
    flags = [word for override in overrides for word in ("--set", override)]
    assert sweep(tmp_path, *flags) == (0, "both.h5\n", "")
    both = gearchaos.load_config(tmp_path / "both.toml", overrides)
    assert gearchaos.open_result(tmp_path / "both.h5").axes == ("load", "pitch_error")
    (tmp_path / "alone.toml").write_text(both.at({"load": 0.1}).resolved_toml())
    assert run_module("gearchaos.sweep", "alone.toml", "-q", cwd=tmp_path).code == 0
    refined = [
        json.loads(of_the_file("stages", tmp_path / name, *at, "--refine", "0.01", "--json"))
        for name, at in (
            ("both.h5", ["--at", "0.1"]),
            ("both.h5", ["--at", "0.5"]),
            ("alone.h5", []),
        )
    ]
    assert [facts.pop("slice").get("load") for facts in refined] == [
        0.1,
        0.5,
        None,
    ]
    light, heavy, alone = refined
    assert light == alone
    # The multiplier of period 1 passes -1 at 10.6085. Just above, the motion leaves period 1 too
    # slowly for a label from such a short record.
    assert [edge["label_above"] for edge in light["boundaries"]] == ["unresolved", "period 1"]
    assert light["boundaries"][0]["below"] == pytest.approx(10.6085, abs=0.01)
    assert all(0.0 < edge["above"] - edge["below"] <= 0.01 for edge in light["boundaries"])
    assert heavy["boundaries"] == []


def test_a_row_of_a_map_is_the_sweep_of_that_row_bit_for_bit(tmp_path):
    text = BOTH[: BOTH.index("[start]")] + BOTH[BOTH.index("[integration]") :]
    (tmp_path / "both.toml").write_text(text, encoding="utf-8")
    fewer = ["sweep.count=7", "second_sweep.count=3"]
    assert sweep(tmp_path, *(word for one in fewer for word in ("--set", one))).code == 0
    whole = gearchaos.open_result(tmp_path / "both.h5")
    both = gearchaos.load_config(tmp_path / "both.toml", fewer)
    for load in whole["load"]:
        alone = tmp_path / "alone.toml"
        alone.write_text(both.at({"load": float(load)}).resolved_toml(), encoding="utf-8")
        ended = run_module("gearchaos.sweep", alone.name, "-q", "--overwrite", cwd=tmp_path)
        assert ended.code == 0
        row, sole = whole.sel(load=load), gearchaos.open_result(tmp_path / "alone.h5")
        assert row.axes == sole.axes == ("pitch_error",)
        assert same_data(row, sole)


def test_the_boundaries_of_a_map_are_those_of_its_rows_and_what_rows_beside_show(tmp_path):
    """Bisection also finds boundaries that it meets on its way, and reports the number of lanes."""
    text = BOTH[: BOTH.index("[start]")] + BOTH[BOTH.index("[integration]") :]
    (tmp_path / "both.toml").write_text(text, encoding="utf-8")
    overrides = [f"groups.{way}_damping_{g}=0.05" for way in ("transverse", "axial") for g in "pg"]
    overrides += ["formulation=published", "sweep.from=9.0", "sweep.to=14.0", "sweep.count=5"]
    overrides += ["second_sweep.count=3"]
    flags = [word for override in overrides for word in ("--set", override)]
    assert sweep(tmp_path, *flags).code == 0
    path, width = tmp_path / "both.h5", ("--refine", "0.1")
    whole = json.loads(of_the_file("stages", path, *width, "--json"))
    assert (whole["parameter"], whole["second_parameter"]) == ("pitch_error", "load")
    loads = gearchaos.open_result(path)["load"].tolist()
    edges = ("below", "above", "label_below", "label_above")
    found = {
        row["value"]: [[one[key] for key in edges] for one in row["boundaries"]]
        for row in whole["rows"]
    }
    alone = 0
    for load in loads:
        sliced = json.loads(of_the_file("stages", path, "--at", f"{load}", *width, "--json"))
        ends = [[one[key] for key in edges] for one in sliced["boundaries"]]
        # If bisection meets a third motion, a slice has one boundary; here two boundaries begin.
        rest = [[*one[:3]] for one in found.get(load, [])]
        assert all([*one[:3]] in rest for one in ends)
        for one, other in pairwise(found.get(load, [])):
            assert one[1] <= other[0] and one[3] == other[2]
        alone += len(ends)
    count = sum(map(len, found.values()))
    assert count > alone > 1
    assert all(0.0 < one[1] - one[0] <= 0.1 for row in found.values() for one in row)
    # Four halvings of 1.25 give less than 0.1; each halving takes one lane.
    assert 4 * alone < whole["lanes"] < 3 * 51 == whole["lanes_of_a_map_as_fine"]
    told = of_the_file("stages", path, *width)
    assert len(told.splitlines()) == count + len(found) + 1
    assert told.splitlines()[0] == f"load = {min(found):.6g}"
    across = json.loads(of_the_file("stages", path, "--at", "pitch_error=11.5", *width, "--json"))
    assert across["parameter"] == "load"
    assert [0.1 <= one["below"] < one["above"] <= 0.5 for one in across["boundaries"]] == [True]
    refused = run_module("gearchaos.stages", path.name, *width, "--survival", "3", cwd=tmp_path)
    assert refused.code == 2 and "choose a slice with --at NAME=VALUE" in refused.err
    assert sweep(tmp_path, *flags, "--set", "outputs.motion=false", "--overwrite").code == 0
    refused = run_module("gearchaos.stages", path.name, *width, cwd=tmp_path)
    assert refused.code == 4 and "holds no labels of the motion" in refused.err
