"""The console script runs all commands under one name."""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import gearchaos
from gearchaos.__main__ import COMMANDS

from .commands import HANGS, run_module, small_config


def test_the_script_runs_a_sweep_and_draws_it(tmp_path):
    script = shutil.which("gearchaos", path=Path(sys.executable).parent)
    if script is None:
        pytest.skip("gearchaos is not installed here")
    small_config(tmp_path)
    for arguments, out in {
        ("sweep", "gears.toml", "--quiet"): "gears.h5\n",
        ("plot", "gears.h5", "--output", "gears.png", "--dpi", "50", "--quiet"): "gears.png\n",
    }.items():
        done = subprocess.run([script, *arguments], cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stdout, done.stderr) == (0, out, "")


def test_the_package_runs_what_the_script_runs(tmp_path):
    small_config(tmp_path)
    ended = run_module("gearchaos", "sweep", "gears.toml", "--quiet", cwd=tmp_path)
    assert ended == (0, "gears.h5\n", "")
    assert gearchaos.open_result(tmp_path / "gears.h5").axis == "pitch_error"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(tmp_path, command):
    ended = run_module("gearchaos", command, "--help", cwd=tmp_path)
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("usage: ")
    assert command in ended.out.splitlines()[0]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_listed_with_what_it_does(tmp_path, command):
    ended = run_module("gearchaos", "--help", cwd=tmp_path)
    assert (ended.code, ended.err) == (0, "")
    assert f"  {command} " in ended.out
    assert COMMANDS[command] in ended.out


@pytest.mark.parametrize("arguments", [[], ["swep"], ["--verbose"]])
def test_no_command_or_an_unknown_one_is_code_2(tmp_path, arguments):
    ended = run_module("gearchaos", *arguments, cwd=tmp_path)
    assert (ended.code, ended.out) == (2, "")
    assert "usage: gearchaos COMMAND" in ended.err
    for name in arguments:
        assert f"gearchaos: error: no command `{name}`" in ended.err


def test_the_exit_codes_of_a_command_are_those_of_the_script(tmp_path):
    assert run_module("gearchaos", "sweep", "none.toml", cwd=tmp_path).code == 4
    assert run_module("gearchaos", "sweep", "--nonsense", cwd=tmp_path).code == 2


@pytest.mark.parametrize("module", ["gearchaos.sweep", "gearchaos"])
def test_an_interrupt_while_a_command_is_imported_ends_it_without_a_traceback(tmp_path, module):
    small_config(tmp_path)
    arguments = ["sweep"] * (module == "gearchaos") + ["gears.toml"]
    with subprocess.Popen(
        [sys.executable, "-X", "importtime", "-m", module, *arguments],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        # Python prints the name of each module after its import.
        while not process.stderr.readline().endswith(" gearchaos\n"):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=HANGS)
    assert process.returncode in (-signal.SIGINT, 130)
    assert "Traceback" not in err
    assert "KeyboardInterrupt" not in err


def test_whoever_imports_the_package_keeps_his_own_action_on_an_interrupt(tmp_path):
    code = "import signal, gearchaos.sweep as s; print(signal.getsignal(signal.SIGINT).__name__)"
    options = {"capture_output": True, "text": True, "cwd": tmp_path}
    done = subprocess.run(
        [sys.executable, "-c", code],
        **options,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert done.stdout == "default_int_handler\n"
