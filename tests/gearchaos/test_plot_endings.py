"""Every command turns faults into lines on stderr and exit codes, never into tracebacks."""

import os
import subprocess
import sys
from typing import NamedTuple

import pytest

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.version import version_text


def raising(fault: BaseException):
    def body(_options) -> int:
        raise fault

    return body


class NoOptions(NamedTuple):
    """A command without options of its own."""


def run(body) -> int:
    return Command("schema", "Turn a gear.", NoOptions, body)([])


@pytest.mark.parametrize(
    ("fault", "code", "lines"),
    [
        (
            ConfigurationError(["one", "two"]),
            2,
            "gearchaos schema: error: one\ngearchaos schema: error: two\n",
        ),
        (FileError("a.h5: is not there"), 4, "gearchaos schema: error: a.h5: is not there\n"),
        (PermissionError(13, "Permission denied", "b"), 4, "denied: 'b'\n"),
        (KeyboardInterrupt(), 130, "gearchaos schema: interrupted\n"),
    ],
)
def test_each_fault_has_its_code_and_its_lines(fault, code, lines, capsys):
    assert run(raising(fault)) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.endswith(lines)


def test_a_fault_nobody_foresaw_is_not_hidden():
    with pytest.raises(ZeroDivisionError):
        run(raising(ZeroDivisionError()))


def test_the_codes_of_the_body_and_of_argparse_are_kept():
    assert run(lambda _options: 3) == 3
    assert run(raising(SystemExit(2))) == 2
    assert run(raising(SystemExit())) == 0


def test_a_reader_that_goes_away_ends_the_command_quietly():
    code = """
import sys
from typing import NamedTuple
from gearchaos.command_line import Command
def body(options):
    sys.stdin.read()
    print("a path")
    return 0
class NoOptions(NamedTuple):
    pass
sys.exit(Command("schema", "Turn a gear.", NoOptions, body)())
"""
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    ) as process:
        process.stdout.close()
        process.stdin.close()
        assert process.stderr.read() == b""
        assert process.wait() == 141


def test_closed_streams_do_no_harm():
    command = "import sys; from gearchaos.plot import main; sys.exit(main(['--version']))"
    done = subprocess.run(
        ["sh", "-c", 'exec "$0" -c "$1" >&- 2>&-', sys.executable, command],
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.returncode == 0


def test_the_version_is_one_line_with_software_and_interpreter():
    assert version_text().startswith("gearchaos ")
    assert f"Python {sys.version_info.major}.{sys.version_info.minor}" in version_text()
    assert "\n" not in version_text()
