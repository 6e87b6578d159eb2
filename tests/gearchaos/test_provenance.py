"""A result contains its provenance."""

import platform
import re
import shutil
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest
from gearchaos_kernels import source_hash

import gearchaos
from gearchaos.engine.provenance import commit_of

from .commands import SMALL, sweep


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("provenance")
    assert sweep(folder, "--threads", "1", "--set", "sweep.count=3", "--quiet").code == 0
    return gearchaos.open_result(folder / "gears.h5")


def test_the_configuration_is_there_as_it_was_written_and_with_everything_filled_in(result):
    assert result.metadata["configuration"] == SMALL
    resolved = result.metadata["configuration_resolved"]
    again = gearchaos.Configuration.from_toml(resolved, "resolved.toml")
    assert again.sweep.count == 3  # The override is included.
    assert again.resolved_toml() == resolved
    assert 'formulation = "physical"' in resolved


def test_the_resolved_configuration_computes_the_same_again(result):
    resolved = result.metadata["configuration_resolved"]
    again = gearchaos.run(gearchaos.Configuration.from_toml(resolved, "resolved.toml"))
    for name in result:
        assert np.array_equal(again[name], result[name]), name


@pytest.mark.parametrize(
    ("group", "origin"),
    [
        ("damping_ratio", "given"),
        ("mesh_frequency", "derived"),
        ("half_backlash", "derived"),
        ("stiffness_variation_scale", "default"),
        ("pitch_error", "swept"),
    ],
)
def test_every_group_says_whether_it_was_given_or_derived(result, group, origin):
    assert result.parameters[group].origin == origin


def test_values_of_the_groups_are_those_that_were_integrated(result):
    assert result.parameters["damping_ratio"].values == 0.05  # Not the 0.1 of [mesh].
    assert result.parameters["half_backlash"].values == pytest.approx(0.8)
    assert result.parameters["pitch_error"].values == pytest.approx([0.0, 2.5, 5.0])


def test_the_result_names_software_machine_threads_and_time(result):
    facts = result.metadata
    assert facts["software"] == f"gearchaos {gearchaos.software_version()}"
    assert facts["kernels"] == source_hash()
    assert facts["python_version"] == platform.python_version()
    assert facts["numpy_version"] == np.__version__
    assert facts["h5py_version"] == h5py.__version__
    assert facts["processor"]
    assert facts["threads"] == 1
    assert 0 < facts["wall_time_seconds"] < 600
    age = datetime.now(UTC) - datetime.fromisoformat(facts["created"])
    assert timedelta(0) <= age < timedelta(minutes=10)


def test_the_result_says_what_was_integrated_and_how(result):
    facts = result.metadata
    assert facts["title"] == "a small sweep"
    assert facts["formulation"] == "physical"
    assert facts["effects"] == "pitch_error stiffness_variation backlash transverse axial"
    assert (facts["start"], facts["carry"]) == ("rest", "none")
    assert facts["method"] == "rk4"
    assert facts["steps_per_period"] == 40
    assert (facts["transient_periods"], facts["recorded_periods"]) == (5, 10)


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed here")
def test_the_commit_is_named_with_its_changes_where_there_is_one_and_left_out_elsewhere(tmp_path):
    def git(*arguments):
        command = ["git", "-c", "user.name=n", "-c", "user.email=e", "-C", str(tmp_path)]
        done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    file = tmp_path / "gears.toml"
    file.write_text(SMALL)
    assert commit_of(tmp_path) == ""
    git("init", "--quiet")
    assert commit_of(tmp_path) == ""  # Nothing is committed yet.
    git("add", ".")
    git("commit", "--quiet", "--message", "first")
    commit = git("rev-parse", "HEAD")
    assert re.fullmatch(r"[0-9a-f]{40}", commit)
    assert commit_of(tmp_path) == commit
    file.write_text("changed")
    assert commit_of(tmp_path) == f"{commit}-dirty"


def test_the_result_names_the_commit_of_the_clone_that_made_it(result):
    # A file may have changed since the result was computed.
    commit = commit_of(Path(gearchaos.__file__).parents[1]).removesuffix("-dirty")
    assert result.metadata.get("git_commit", "").removesuffix("-dirty") == commit
