"""Closed or full standard streams lose messages, not results."""

import io
import subprocess
import sys

import pytest

import gearchaos
from gearchaos import progress

from .commands import LINEAR, same_data, small_config

FEW = (*LINEAR, "--set", "sweep.count=3", "--output", "one.h5")
CLOSED, FULL = (">&-", "2>&-", "<&- >&- 2>&-"), ("2>/dev/full", ">/dev/full")


def shell(folder, redirection: str, *arguments: str) -> subprocess.CompletedProcess:
    """Run a module in a shell that redirects its streams."""
    script = f'exec "$0" -m "$@" {redirection}'
    command = ["sh", "-c", script, sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has /dev/full")
@pytest.mark.parametrize("redirection", [*CLOSED, *FULL])
def test_a_sweep_writes_its_result_whatever_becomes_of_its_messages(tmp_path, redirection):
    small_config(tmp_path)
    ended = shell(tmp_path, redirection, "gearchaos.sweep", "gears.toml", *FEW)
    # The path of the result cannot be printed if stdout is full.
    assert ended.returncode == (4 if redirection == ">/dev/full" else 0)
    assert ended.stdout == ("one.h5\n" if redirection.startswith("2>") else "")
    assert ("3 lanes, 0 diverged" in ended.stderr) == (redirection == ">&-")
    result = gearchaos.open_result(tmp_path / "one.h5")
    config = gearchaos.load_config(tmp_path / "gears.toml", FEW[1:-2:2])
    assert same_data(result, gearchaos.run(config))


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has /dev/full")
@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("gearchaos.sweep", "none.toml"), 4),
        (("gearchaos",), 2),
    ],
)
def test_the_exit_code_is_reported_without_stderr(tmp_path, redirection, arguments, code):
    ended = shell(tmp_path, redirection, *arguments)
    assert (ended.returncode, ended.stderr) == (code, "")
    assert bool(ended.stdout) == (code == 0)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has /dev/full")
@pytest.mark.parametrize("option", ["--help", "--version"])
def test_an_overview_that_cannot_be_printed_is_code_4(tmp_path, option):
    ended = shell(tmp_path, ">/dev/full", "gearchaos", option)
    assert ended.returncode == 4
    assert ended.stderr == "gearchaos: error: [Errno 28] No space left on device\n"


def test_a_library_without_stderr_says_nothing_and_computes(tmp_path, monkeypatch, capsys):
    config = gearchaos.load_config(small_config(tmp_path), FEW[1:-2:2])
    told = gearchaos.run(config)
    monkeypatch.setattr(sys, "stderr", None)
    assert same_data(gearchaos.run(config, progress=True), told)
    monkeypatch.undo()
    assert capsys.readouterr().out == ""


def test_a_message_for_a_closed_file_is_lost(monkeypatch):
    closed = io.StringIO()
    closed.close()
    monkeypatch.setattr(sys, "stderr", closed)
    progress.complain("a tooth is missing")
