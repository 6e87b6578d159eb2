"""The process that runs commands for the tests: a failed test does not affect other tests."""

import os
import signal
import time

import pytest

from .commands import _server, begin, is_running, run_module

FOREVER = ("-n", "1", "-r", "1", "import time; time.sleep(10_000)")
"""Arguments of timeit that take longer than any test waits."""


def test_a_command_that_nobody_waited_for_is_killed_and_the_next_gets_its_own_code(tmp_path):
    process, _ = begin("timeit", FOREVER, tmp_path)
    assert run_module("gearchaos.sweep", "none.toml", cwd=tmp_path).code == 4
    assert not is_running(process)
    assert run_module("gearchaos.sweep", "--version", cwd=tmp_path).code == 0


def test_commands_beside_each_other_have_their_own_codes_and_end_with_the_next(tmp_path):
    process, _ = begin("timeit", FOREVER, tmp_path)
    one, other = (
        begin("gearchaos.sweep", [word], tmp_path, beside=True)[1]
        for word in ("none.toml", "--version")
    )
    assert is_running(process)
    assert (other().code, one().code) == (0, 4)
    assert run_module("gearchaos.sweep", "--version", cwd=tmp_path).code == 0
    while is_running(process):  # It is killed, but its parent has yet to collect its exit code.
        time.sleep(0.005)


def test_the_answer_of_an_ended_command_is_not_that_of_the_next(tmp_path):
    process, ended = begin("gearchaos.sweep", ["none.toml"], tmp_path)
    while is_running(process):
        time.sleep(0.005)
    assert run_module("gearchaos.sweep", "--version", cwd=tmp_path).code == 0
    with pytest.raises(AssertionError, match="another command was begun"):
        ended()


def test_a_server_that_has_died_says_so_and_is_not_asked_again(tmp_path):
    words = ["timeit", ["-n", "1", "-r", "1"], str(tmp_path), [os.devnull] * 3, {}, None]
    server = _server()
    request, _ = server.begin(words)
    assert server.end(request) == 0
    os.kill(server._process.pid, signal.SIGKILL)
    with pytest.raises(RuntimeError, match="the command server has ended with -9"):
        server.begin(words)
    assert run_module("gearchaos.sweep", "--version", cwd=tmp_path).code == 0
