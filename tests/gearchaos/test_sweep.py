"""The sweep command: its output on stdout and stderr, its files, and its exit codes."""

import json
import os
import pty
import re
import subprocess
import sys
import termios

import numpy as np
import pytest

import gearchaos
from gearchaos.dry_run import some_places
from gearchaos.engine.computing import block_memory
from gearchaos.engine.run_plan import plan_run
from gearchaos.models import Configuration, load_config

from .commands import (
    DIVERGING,
    LINEAR,
    SMALL,
    names_in,
    run_module,
    same_data,
    small_config,
    sweep,
)
from .short_sweeps import PAN2021


def test_the_path_of_the_result_is_all_that_stdout_holds(tmp_path):
    ended = sweep(tmp_path)
    assert (ended.code, ended.out) == (0, "gears.h5\n")
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]
    lines = [line for line in ended.err.splitlines() if "preparing the kernel" not in line]
    assert len(lines) == 2
    assert re.fullmatch(r"gearchaos sweep: 40 of 40 lanes, *[\d.]+ lanes/s, 00:00 left", lines[0])
    assert re.fullmatch(r"gearchaos sweep: 40 lanes, 0 diverged, \d+\.\d s", lines[1])


def test_the_output_goes_to_the_given_path_and_the_path_is_printed_as_given(tmp_path):
    (tmp_path / "results").mkdir()
    ended = sweep(tmp_path, "--output", "results/grün und gut.hdf5", "--quiet")
    assert ended == (0, "results/grün und gut.hdf5\n", "")
    assert names_in(tmp_path / "results") == ["grün und gut.hdf5"]
    assert gearchaos.open_result(tmp_path / "results/grün und gut.hdf5").axis == "pitch_error"


def test_a_terminal_gets_a_bar_with_lanes_per_second_and_the_time_left(tmp_path):
    small_config(tmp_path)
    here, there = pty.openpty()
    termios.tcsetwinsize(there, (24, 100))
    with subprocess.Popen(
        [sys.executable, "-m", "gearchaos.sweep", "gears.toml"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=there,
    ) as process:
        os.close(there)
        shown = b""
        while chunk := _read_terminal(here):
            shown += chunk
        assert process.stdout.read() == b"gears.h5\n"
    os.close(here)
    assert process.returncode == 0
    assert re.search(rb"\r100%\|\S+\| 40/40 \[\d\d:\d\d<00:00, +[\d.]+ lanes/s\]", shown)
    assert b"40 of 40 lanes" not in shown


def _read_terminal(descriptor):
    try:
        return os.read(descriptor, 4096)
    except OSError:  # The other side is closed.
        return b""


def test_a_new_scene_is_announced_once_and_compiled_once_per_machine(tmp_path):
    plainest = ("--set", "scene.effects=[]", "--set", "sweep.parameter=load", "--overwrite")
    plainest += ("--set", "sweep.from=1.0", "--set", 'outputs.section=["delta_5"]')
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first = sweep(tmp_path, *plainest, env=environment)
    assert first.code == 0
    assert first.err.count("preparing the kernel of this scene") == 1
    compiled = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nb?")}
    assert compiled
    second = sweep(tmp_path, *plainest, env=environment)
    assert second.code == 0
    assert "preparing the kernel" not in second.err
    again = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nb?")}
    assert again == compiled


def test_help_and_version_come_at_once_on_stdout(tmp_path):
    for module in ("gearchaos.sweep", "gearchaos"):
        ended = run_module(module, "--version", cwd=tmp_path)
        assert re.fullmatch(r"gearchaos \S+ \(Python \S+, \w+\)\n", ended.out)
        assert (ended.code, ended.err) == (0, "")
    ended = run_module("gearchaos.sweep", "--help", cwd=tmp_path)
    assert (ended.code, ended.err) == (0, "")
    for word in ("--output", "--overwrite", "--resume", "--threads", "--set", "--dry-run"):
        assert word in ended.out
    assert "Exit codes: 0 done 2 the command line or " in " ".join(ended.out.split())


def test_a_dry_run_reports_lanes_steps_memory_and_time_and_writes_nothing(tmp_path):
    ended = sweep(tmp_path, "--dry-run", "--set", "start.kind=random", "--set", "start.count=3")
    assert (ended.code, ended.out) == (0, "")
    assert names_in(tmp_path) == ["gears.toml"]
    told = dict(re.findall(r"^(\w+): +(.+)$", ended.err, re.MULTILINE))
    assert told.pop("effects").startswith("pitch_error, stiffness_variation, backlash")
    assert re.fullmatch(r"about [\d.]+MB at the peak of the process", told.pop("memory"))
    assert re.fullmatch(r"about \d+\.\d s with \d+ threads?", told.pop("time"))
    # Per lane 35 numbers of 8 bytes: 2 x 5 section points, exponent, its error, crossings, their
    # speed, 10 states at the start and 10 at the end, return distance; 4 of 4 bytes: unsplit steps,
    # period of divergence and of the motion, bands; 3 of 1 byte: status, kind of motion, kind of
    # record.
    assert told.pop("file") == f"about {120 * (8 * 35 + 4 * 4 + 3) / 1000:.1f}kB before compression"
    assert told.pop("modes").startswith("eigenfrequencies 1358, 2364, 3000, 3593, 9122 Hz")
    assert told.pop("orders").startswith("resonances with the mesh: order 1 at 3880, 6755, ")
    assert told.pop("deflection").startswith("11.68 um of the mesh under the static load")
    assert told == {
        "output": "gears.h5",
        "states": "10",
        "lanes": "120 (40 values of pitch_error from 0 to 5, 3 starts each)",
        "method": "RK4: classical Runge-Kutta of order 4; 40 steps per period, resolved crossings",
        "steps": "7.2e+04 (40 per period)",
    }


def test_a_dry_run_reports_to_a_scheduler_as_json_what_one_shard_takes(tmp_path):
    ended = sweep(
        tmp_path, "--dry-run", "--json", "--shard", "2/3", "--set", "sweep.count=700", "-q"
    )
    assert (ended.code, ended.err) == (0, "")
    facts = json.loads(ended.out)
    # The shard is the second of three blocks of 256 lanes.
    assert [facts[name] for name in ("output", "exists", "states")] == ["gears.h5", False, 10]
    assert (facts["lanes"], facts["steps"]) == (256, 256 * 40 * 15)
    assert facts["file_bytes"] == 256 * (8 * 35 + 4 * 4 + 3)
    assert facts["seconds"] > 0.0
    # The memory includes the interpreter and its packages, not only the arrays.
    assert facts["memory_bytes"] > 5e7


def test_a_sweep_reports_its_result_as_json(tmp_path):
    ended = sweep(tmp_path, "--json")
    assert ended.code == 0
    facts = json.loads(ended.out)
    assert facts["output"] == "gears.h5" and facts["lanes"] == 40 and facts["diverged"] == 0
    assert facts["steps_per_period"] == facts["recorded_periods"] * 4 == 40
    assert facts["method"] == "rk4" and "40 lanes, 0 diverged" in facts["remarks"][0]
    again = sweep(tmp_path, "--json", "--resume")
    assert json.loads(again.out)["remarks"] == ["complete already: 40 lanes, 0 diverged"]


def test_a_dry_run_counts_the_memory_of_maps_of_every_lane(tmp_path):
    """Each lane of a block has its own 100 maps, or all lanes share 100 maps."""
    told = {}
    # The first run may compile, which also takes memory.
    for parameter in ("load", "load", "mesh_frequency"):
        flags = ("--set", f'sweep={{parameter="{parameter}", from=0.2, to=0.4, count=256}}')
        for override in ("method=flow_map", "steps_per_period=100"):
            flags += ("--set", f"integration.{override}")
        ended = sweep(tmp_path, *LINEAR, *flags, "--threads", "1", "--dry-run", "--json", "-q")
        assert (ended.code, ended.err) == (0, "")
        facts = json.loads(ended.out)
        assert (facts["lanes"], facts["states"], facts["steps"]) == (256, 2, 256 * 100 * 15)
        assert facts["seconds"] > 0.0
        config = load_config(tmp_path / "gears.toml", [*LINEAR[1::2], *flags[1::2]])
        told[parameter] = facts["memory_bytes"], block_memory(plan_run(config), 1)
    (shared, shared_block), (own, own_block) = told.values()
    assert own - shared > own_block - shared_block > 1e7


def test_what_a_dry_run_computes_are_lanes_from_all_over_the_sweep():
    second = 'second_sweep={parameter="load", from=0.2, to=0.3, count=30}'
    every = plan_run(load_config(PAN2021, ["start.kind=random", "start.count=9", second]))
    some = some_places(every, 256)
    # The lanes are runs of 32 neighbours, as far from the beginning of the sweep as from its end.
    assert some.size == np.unique(some).size == 256
    assert set(np.diff(some.reshape(-1, 32)).ravel()) == {1}
    assert some[0] == pytest.approx(len(every.lanes) - some[-1], rel=0.01)
    # In a carried sweep, the lanes have neighbouring values in the middle.
    some = some_places(plan_run(load_config(PAN2021, ["start.carry=upwards"])), 100)
    assert np.array_equal(some, np.arange(700, 800))


def test_a_configuration_comes_from_standard_input(tmp_path):
    arguments = (*LINEAR, "--set", "sweep.count=3", "--output", "piped.h5", "--quiet")
    ended = run_module("gearchaos.sweep", "-", *arguments, cwd=tmp_path, stdin=SMALL)
    assert ended == (0, "piped.h5\n", "")
    piped = gearchaos.open_result(tmp_path / "piped.h5")
    config = Configuration.from_toml(SMALL, overrides=[*LINEAR[1::2], "sweep.count=3"])
    assert same_data(piped, gearchaos.run(config))
    assert piped.metadata["configuration"] == SMALL


def test_what_standard_input_lacks_is_reported_with_its_name(tmp_path):
    broken = SMALL.replace("count = 40", "count = 0")
    ended = run_module("gearchaos.sweep", "-", cwd=tmp_path, stdin=broken)
    assert ended.code == 2
    assert "error: -: sweep.count = 0: must be at least 1" in ended.err


@pytest.mark.parametrize("arguments", [("gears.toml", "--output", "-"), ("-",)])
def test_a_result_is_not_written_to_standard_output(tmp_path, arguments):
    small_config(tmp_path)
    ended = run_module("gearchaos.sweep", *arguments, cwd=tmp_path, stdin=SMALL)
    said = "-: a result is a file, not a stream, and needs a name; give --output PATH"
    assert ended == (4, "", f"gearchaos sweep: error: {said}\n")


def test_a_dry_run_says_that_the_output_exists_and_leaves_it_alone(tmp_path):
    (tmp_path / "gears.h5").write_bytes(b"precious")
    assert "gears.h5 (exists)\n" in sweep(tmp_path, "--dry-run").err
    assert (tmp_path / "gears.h5").read_bytes() == b"precious"


def test_lanes_too_fast_for_flow_maps_are_distinguished_from_diverged_ones(tmp_path):
    # Twice these steps would exceed the largest number of steps that is tried.
    how = "integration={method='flow_map', steps_per_period=2100, recorded_periods=5}"
    slow = 'sweep={parameter="mesh_frequency", values=[1e-4, 0.8]}'
    ended = sweep(tmp_path, *LINEAR, "--set", how, "--set", slow)
    assert (ended.code, ended.out) == (3, "gears.h5\n")
    assert "1 of the lanes counted as diverged move faster than so few flow maps" in ended.err
    assert "1 of 2 lanes diverged or were too fast, more than outputs.allowed_div" in ended.err
    result = gearchaos.open_result(tmp_path / "gears.h5")
    meanings = result.variables["status"].flags
    assert [meanings[status] for status in result["status"]] == ["too_fast", "ok"]


def test_diverged_lanes_are_written_and_marked_and_make_the_exit_code_3(tmp_path):
    ended = sweep(tmp_path, *DIVERGING, "--quiet")
    assert (ended.code, ended.out) == (3, "gears.h5\n")
    (line,) = ended.err.splitlines()
    assert "40 of 40 lanes diverged, more than outputs.allowed_diverged_share = 0" in line
    assert line.endswith("check the load and the start state")
    result = gearchaos.open_result(tmp_path / "gears.h5")
    assert (result["status"] == 1).all()
    assert (result["diverged_period"] >= 0).all()
    assert np.isnan(result["lyapunov_exponent"]).all()
    assert result.attributes("status")["flag_meanings"].split()[1] == "diverged"


def test_an_unstable_number_of_steps_is_refused_with_the_limit_and_the_way_out(tmp_path):
    stiff = ("--set", "groups.transverse_stiffness_p=1e4")
    ended = sweep(tmp_path, *stiff)
    assert (ended.code, ended.out) == (2, "")
    (line,) = ended.err.splitlines()
    limit = int(re.search(r"RK4 is unstable below (\d+) steps per period for 40 of 40", line)[1])
    assert names_in(tmp_path) == ["gears.toml"]
    raised = sweep(tmp_path, *stiff, "--set", "integration.unstable=raise")
    assert raised.code == 0
    assert f"raised from 40 to {limit}, the stability limit" in raised.err
    result = gearchaos.open_result(tmp_path / "gears.h5")
    assert result.metadata["steps_per_period"] == limit
    assert not result["status"].any()


@pytest.mark.parametrize(("share", "code"), [("1.0", 0), ("0.5", 3)])
def test_as_many_lanes_may_diverge_as_the_configuration_allows(tmp_path, share, code):
    # Two of these loads drive their lanes beyond every length scale.
    values = "sweep={parameter='load', values=[0.3, 1e150, 1e151]}"
    allowed = f"outputs.allowed_diverged_share={share}"
    ended = sweep(tmp_path, "--set", values, "--set", allowed)
    assert ended.code == code
    assert "3 lanes, 2 diverged" in ended.err
    result = gearchaos.open_result(tmp_path / "gears.h5")
    assert result["status"].tolist() == [0, 1, 1]
    assert result["diverged_period"][0] == -1
    assert np.isfinite(result["end_state"][0]).all()
