"""The stages command prints a table from the file alone and refines boundaries with the engine."""

import json
import subprocess
import sys

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.recomputing import refinable
from gearchaos.results.reading.result import Result

from .commands import run_module
from .short_sweeps import METHODS, PAN2021, SOFT_BEARINGS, SPEEDS
from .test_result_axes import AXES, LOADS, result_over

WHERE = (
    "sweep.from=9.8",
    "sweep.to=13.0",
    "sweep.count=33",
    "outputs.section_points=2",
)


@pytest.fixture(scope="module")
def result() -> Result:
    return gearchaos.run(gearchaos.load_config(PAN2021, WHERE))


@pytest.fixture
def folder(result, tmp_path):
    result.save(tmp_path / "pan.h5")
    return tmp_path


def stages(folder, *arguments: str):
    return run_module("gearchaos.stages", *arguments, cwd=folder)


def test_the_table_lists_every_stage_within_80_columns(folder, result):
    ended = stages(folder, "pan.h5")
    assert (ended.code, ended.err) == (0, "")
    lines = ended.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0] == "stages over pitch_error"
    words = [line.split() for line in lines[2:]]
    assert words[0][:5] == ["9.8", "10.2", "period", "1", "5"]
    assert words[1][:4] == ["10.3", "11.3", "period", "2"]
    rows = lines[2 : lines.index("")]
    assert sum(int(row[39:46]) for row in rows) == result["motion"].size


def test_the_table_needs_no_engine(folder):
    program = (
        "import sys; from gearchaos.stages import main; code = main(['pan.h5']); "
        "sys.exit(code or bool({'numba', 'gearchaos_kernels'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True)
    assert done.returncode == 0


@pytest.mark.slow
def test_boundaries_are_refined_and_the_period_doubling_is_reported(folder):
    ended = stages(folder, "pan.h5", "--refine", "0.002", "--json")
    assert ended.code == 0
    facts = json.loads(ended.out)
    doubling = facts["boundaries"][0]
    assert 0.0 < doubling["above"] - doubling["below"] <= 0.002
    # Newton's method and the multipliers alone give 10.268.
    assert doubling["below"] <= 10.268 <= doubling["above"]
    assert doubling["lost_at"] == pytest.approx(10.268, abs=1e-3)
    assert doubling["label_below"] == "period 1"
    assert doubling["loss"].startswith("period doubling")
    assert doubling["multiplier"][0] == pytest.approx(-1.0, abs=0.02)
    assert facts["stages"][0]["end"] == doubling["below"]
    assert facts["stages"][1]["start"] == doubling["above"]
    values = gearchaos.open_result(folder / "pan.h5")["pitch_error"]
    for boundary, stage in zip(facts["boundaries"], facts["stages"][1:], strict=True):
        alike = boundary["label_above"] == stage["label"]
        assert stage["start"] == (boundary["above"] if alike else values[stage["first"]])


def test_a_start_of_a_grid_is_refined_as_it_started():
    """In pan2021_first.toml, a start at rest jumps at 1.044."""
    grid = (
        "sweep={parameter='pitch_error', values=[1.04, 1.05]}",
        "start={kind='grid', count=3, box={delta_5=[-1.0, 1.0]}}",
        "integration.transient_periods=200",
        "integration.recorded_periods=48",
        "outputs.section_points=1",
    )
    found = gearchaos.run(gearchaos.load_config(PAN2021, grid))
    config = refinable(found.sel(start=1), "hop.h5")
    assert (config.start.kind, config.start.size) == ("given", 1)
    assert not any(config.start.state.values())
    again = gearchaos.run(config)
    assert np.array_equal(again["end_state"], found["end_state"][:, 1])


def test_a_torus_is_born_in_a_neimark_sacker_bifurcation(tmp_path):
    born = ("sweep={parameter='mesh_frequency', values=[1.015, 1.02]}", *SOFT_BEARINGS)
    config = gearchaos.load_config(SPEEDS, born)
    gearchaos.run(config).save(tmp_path / "born.h5")
    ended = stages(tmp_path, "born.h5", "--refine", "0.0005", "--json")
    facts = json.loads(ended.out)
    assert [stage["label"] for stage in facts["stages"]] == ["period 1", "quasi-periodic"]
    (boundary,) = facts["boundaries"]
    assert boundary["loss"].startswith("Neimark-Sacker")
    multiplier = complex(*boundary["multiplier"])
    assert abs(multiplier) == pytest.approx(1.0, abs=1e-3)
    assert abs(multiplier.imag) > 0.5


def changed(result: Result, **metadata: str) -> Result:
    return Result(
        result.axes,
        list(result.variables.values()),
        {name: result[name] for name in result},
        result.parameters,
        {**result.metadata, **metadata},
    )


@pytest.mark.parametrize(
    "replaced",
    [('carry = "none"', 'carry = "upwards"'), ('kind = "rest"', 'kind = "random"')],
)
def test_lanes_that_do_not_stand_for_themselves_are_not_refined(result, tmp_path, replaced):
    text = result.metadata["configuration_resolved"].replace(*replaced)
    changed(result, configuration_resolved=text).save(tmp_path / "pan.h5")
    assert stages(tmp_path, "pan.h5").code == 0
    ended = stages(tmp_path, "pan.h5", "--refine", "0.01")
    assert (ended.code, ended.out) == (2, "")
    assert "nothing lies between lanes whose starts are carried on, random or drawn" in ended.err


def test_a_file_without_labels_or_without_its_configuration_is_reported(result, tmp_path):
    labels = ("motion", "period", "return_distance", "bands")
    without = Result(
        result.axes,
        [variable for name, variable in result.variables.items() if name not in labels],
        {name: result[name] for name in result},
        result.parameters,
        result.metadata,
    )
    without.save(tmp_path / "plain.h5")
    ended = stages(tmp_path, "plain.h5")
    assert (ended.code, ended.out) == (4, "")
    assert "plain.h5: holds no labels of the motion" in ended.err
    changed(result, configuration_resolved="").save(tmp_path / "bare.h5")
    ended = stages(tmp_path, "bare.h5", "--refine", "0.01")
    assert ended.code == 4
    assert "bare.h5: holds no configuration" in ended.err


def test_what_is_no_result_or_no_width_is_refused(folder):
    (folder / "broken.h5").write_bytes((folder / "pan.h5").read_bytes()[:-300])
    for arguments, code in (
        (["broken.h5"], 4),
        (["missing.h5"], 4),
        (["pan.h5", "--refine", "0"], 2),
        (["pan.h5", "--at", "start=3"], 2),
    ):
        ended = stages(folder, *arguments)
        assert (ended.code, ended.out) == (code, "")


@pytest.fixture
def several(tmp_path):
    result = result_over(AXES["two parameters, several starts"])
    result.save(tmp_path / "several.h5")
    return result


def listed(folder, *arguments: str):
    ended = stages(folder, "several.h5", "--quiet", *arguments, "--json")
    assert (ended.code, ended.err) == (0, "")
    return json.loads(ended.out)


def test_a_slice_is_named_and_the_first_one_is_not_all(several, tmp_path):
    ended = stages(tmp_path, "several.h5")
    assert ended.code == 0
    assert ended.out.splitlines()[:3] == [
        "stages over pitch_error",
        "all 2 values of start; --at start=VALUE chooses one",
        "slice load = 0.1; others with --at load=VALUE",
    ]
    facts = listed(tmp_path)
    assert facts["slice"] == {"load": 0.1}
    # There are two starts at each value.
    assert sum(stage["lanes"] for stage in facts["stages"]) == 2 * several["pitch_error"].size


def test_where_starts_come_to_different_motions_the_stage_says_so(several, tmp_path):
    labels = np.stack([several["motion"][0], several["period"][0]])
    differ = (labels != labels[:, :, :1]).any(axis=(0, 2))
    assert differ.any()
    told = [stage for stage in listed(tmp_path)["stages"] if stage["label"] == "several motions"]
    assert sum(stage["lanes"] for stage in told) == 2 * differ.sum()
    assert all(stage["highest_exponent"] is None for stage in told)
    one = listed(tmp_path, "--at", "start=1")
    assert one["slice"]["start"] == 1.0
    assert "several motions" not in {stage["label"] for stage in one["stages"]}


def test_another_slice_is_listed_at_the_nearest_values(several, tmp_path):
    facts = listed(tmp_path, "--at", "load=0.33", "--at", "start=1")
    assert facts["parameter"] == "pitch_error"
    assert facts["slice"]["load"] == LOADS.values[1]
    assert facts["slice"]["start"] == 1.0
    changes = (several["period"][1, 1:, 1] != several["period"][1, :-1, 1]) | (
        several["motion"][1, 1:, 1] != several["motion"][1, :-1, 1]
    )
    assert len(facts["stages"]) == 1 + changes.sum()
    over_loads = listed(tmp_path, "--at", "pitch_error=1.5")
    assert over_loads["parameter"] == "load"
    assert sum(stage["lanes"] for stage in over_loads["stages"]) == 2 * 3


def test_a_bare_value_is_enough_where_there_is_one_other_axis(tmp_path):
    result_over(AXES["several starts"]).save(tmp_path / "several.h5")
    facts = listed(tmp_path, "--at", "2")
    assert facts["slice"] == {"start": 2.0}


@pytest.mark.parametrize(
    ("at", "words"),
    [
        (["0.1"], "--at 0.1: must be NAME=VALUE, each of the axes load, pitch_error, start once"),
        (["load=x"], "'x' is not a finite number"),
        (["load=nan"], "'nan' is not a finite number"),
        (["load=0.1", "load=0.3"], "--at load=0.3: must be NAME=VALUE"),
        (["torque=1"], "torque: is no axis of the result; its axes: load, pitch_error, start"),
        (["load=0.1", "pitch_error=0"], "no swept parameter is left"),
    ],
)
@pytest.mark.usefixtures("several")
def test_a_slice_that_there_is_not_is_refused(tmp_path, at, words):
    flags = [part for text in at for part in ("--at", text)]
    ended = stages(tmp_path, "several.h5", *flags)
    assert (ended.code, ended.out) == (2, "")
    assert words in ended.err


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_slice_of_two_parameters_is_refined_where_it_was_taken(tmp_path, method):
    damping = 0.025819888974716113  # The value of the file.
    where = [
        "sweep={parameter='pitch_error', values=[10.2, 10.3]}",
        f"second_sweep={{parameter='damping_ratio', values={[damping, 2.0 * damping]}}}",
        f"integration={{method='{method}'}}",
    ]
    gearchaos.run(gearchaos.load_config(PAN2021, where)).save(tmp_path / "several.h5")
    facts = listed(tmp_path, "--at", f"damping_ratio={damping}", "--refine", "0.002")
    assert facts["slice"]["damping_ratio"] == damping
    (boundary,) = facts["boundaries"]
    assert boundary["below"] <= 10.268 <= boundary["above"]
