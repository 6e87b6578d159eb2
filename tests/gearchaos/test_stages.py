"""The stages command: a table from the file alone, and boundaries refined with the engine."""

import json
import subprocess
import sys

import pytest

import gearchaos
from gearchaos.results.result import Result

from .commands import run_module
from .short_sweeps import PAN2021, SOFT_BEARINGS, SPEEDS

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
    assert sum(int(line[39:46]) for line in lines[2:]) == result["motion"].size


def test_narrow_stages_are_counted_in_their_surroundings(folder):
    facts = json.loads(stages(folder, "pan.h5", "--narrowest", "0.35", "--json").out)
    assert [stage["motion"] for stage in facts["stages"]] == ["period 1", "period 2", "chaotic"]
    chaos = facts["stages"][-1]
    assert chaos["narrower_stages"] >= 2
    assert chaos["lowest_exponent"] > 0.0
    assert sum(stage["lanes"] for stage in facts["stages"]) == 33


def test_the_table_needs_no_engine(folder):
    program = (
        "import sys; from gearchaos.stages import main; code = main(['pan.h5']); "
        "sys.exit(code or bool({'numba', 'gearchaos_kernels'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True)
    assert done.returncode == 0


@pytest.mark.slow
def test_boundaries_are_refined_and_the_period_doubling_is_told(folder):
    ended = stages(folder, "pan.h5", "--narrowest", "0.35", "--refine", "0.002", "--json")
    assert ended.code == 0
    facts = json.loads(ended.out)
    doubling = facts["boundaries"][0]
    assert 0.0 < doubling["above"] - doubling["below"] <= 0.002
    # Newton's method and the multipliers alone put it at 10.268.
    assert doubling["below"] <= 10.268 <= doubling["above"]
    assert doubling["motion_below"] == "period 1"
    assert doubling["loss_of_stability"].startswith("period doubling")
    assert doubling["multiplier_real"] == pytest.approx(-1.0, abs=0.02)
    assert facts["stages"][0]["to"] == doubling["below"]
    assert facts["stages"][1]["from"] == doubling["above"]


def test_a_torus_is_born_in_a_neimark_sacker_bifurcation(tmp_path):
    born = ("sweep={parameter='mesh_frequency', values=[1.015, 1.02]}", *SOFT_BEARINGS)
    config = gearchaos.load_config(SPEEDS, born)
    gearchaos.run(config).save(tmp_path / "born.h5")
    ended = stages(tmp_path, "born.h5", "--refine", "0.0005", "--json")
    facts = json.loads(ended.out)
    assert [stage["motion"] for stage in facts["stages"]] == ["period 1", "quasi-periodic"]
    (boundary,) = facts["boundaries"]
    assert boundary["loss_of_stability"].startswith("Neimark-Sacker")
    multiplier = complex(boundary["multiplier_real"], boundary["multiplier_imaginary"])
    assert abs(multiplier) == pytest.approx(1.0, abs=1e-3)
    assert abs(multiplier.imag) > 0.5


def changed(result: Result, **metadata: str) -> Result:
    return Result(
        result.axis,
        list(result.variables.values()),
        {name: result[name] for name in result},
        result.parameters,
        {**result.metadata, **metadata},
    )


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        (("[start]\n", '[start]\ncarry = "upwards"\n'), 'start.carry = "upwards": a lane between'),
        (('kind = "rest"', 'kind = "random"'), 'start.kind = "random": a lane between'),
    ],
)
def test_lanes_that_do_not_stand_for_themselves_are_not_refined(
    result, tmp_path, replaced, message
):
    text = result.metadata["configuration_resolved"].replace('carry = "none"\n', "")
    changed(result, configuration_resolved=text.replace(*replaced)).save(tmp_path / "pan.h5")
    assert stages(tmp_path, "pan.h5").code == 0
    ended = stages(tmp_path, "pan.h5", "--refine", "0.01")
    assert (ended.code, ended.out) == (2, "")
    assert message in ended.err


def test_a_file_without_labels_or_without_its_configuration_is_told(result, tmp_path):
    labels = ("motion", "period", "return_distance")
    without = Result(
        result.axis,
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
        (["pan.h5", "--narrowest", "nan"], 2),
        (["pan.h5", "--start", "3"], 2),
    ):
        ended = stages(folder, *arguments)
        assert (ended.code, ended.out) == (code, "")
