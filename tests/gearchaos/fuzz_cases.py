"""Commands given bad input under watch: what a case is, how it ends, and what is a failure."""

import json
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple, Self

from gearchaos.command_line import TOO_MANY_DIVERGED

from .fuzz_configurations import COMPUTED, configuration, large_configuration
from .fuzz_results import damaged_result, good_result

WORKER = Path(__file__).with_name("fuzz_worker.py")
STARTING_SECONDS = 60.0
"""Added to the time limit of the first case of a process, which imports and compiles."""


class Case(NamedTuple):
    """One bad input and the command it is given to.

    Attributes
    ----------
    kind : str
        What was done to the input, in a few words.
    number : int
        Makes the case again.
    command : str
        Module of `gearchaos` whose ``main`` runs.
    arguments : list of str
    path : Path
        The input.
    """

    kind: str
    number: int
    command: str
    arguments: list[str]
    path: Path


class Ending(NamedTuple):
    """How a case ended: exit code, fault ("" where there is none), what was said, and the time."""

    code: int | None
    fault: str
    said: str
    seconds: float


class Watch:
    """A worker process with a time limit for each case; it is replaced where it hangs or dies."""

    def __init__(self, folder: Path, seconds: float = 20.0) -> None:
        self._folder, self._seconds = folder, seconds
        self._worker: subprocess.Popen[str] | None = None
        self._fresh = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, cases: Iterable[Case]) -> Iterator[tuple[Case, Ending]]:
        """Run cases one after the other; the input of each exists while its ending is looked at."""
        for case in cases:
            yield case, self._run(case)

    def _run(self, case: Case) -> Ending:
        before = _state(case.path)
        began = time.monotonic()
        answer = self._ask([case.command, *case.arguments])
        seconds = time.monotonic() - began
        if isinstance(answer, str):
            return Ending(None, answer, "", seconds)
        fault = answer["escaped"] or _fault(case.command, answer)
        if _state(case.path) != before:
            fault = "the input has changed"
        return Ending(answer["code"], fault, answer["err"] or answer["out"], seconds)

    def _ask(self, command: list[str]) -> dict[str, str] | str:
        if self._worker is None:
            self._worker = subprocess.Popen(
                [sys.executable, str(WORKER)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=self._folder,
                text=True,
            )
            self._fresh = True
        limit = self._seconds + STARTING_SECONDS * self._fresh
        self._fresh = False
        self._worker.stdin.write(json.dumps(command) + "\n")
        self._worker.stdin.flush()
        with selectors.DefaultSelector() as selector:
            selector.register(self._worker.stdout, selectors.EVENT_READ)
            if not selector.select(limit):
                self._end()
                return f"hangs: no answer within {limit:.0f} s"
        line = self._worker.stdout.readline()
        if not line:
            code = self._worker.wait()
            self._end()
            return f"crashes: the process ended with {code}"
        return json.loads(line)

    def _end(self) -> None:
        if self._worker is not None:
            self._worker.kill()
            self._worker.wait()
            self._worker.stdin.close()
            self._worker.stdout.close()
            self._worker = None


def configuration_cases(
    numbers: Iterable[int], folder: Path, dry_run_every: int = 0
) -> Iterator[Case]:
    """Compute the sweeps that can be, some to a file; give others to `load_config` or a dry run."""
    path = folder / "case.toml"
    computed = ["--output", str(folder / "case.h5"), "--overwrite", "--quiet"]
    for number in numbers:
        kind, content = configuration(number)
        path.write_bytes(content)
        if kind == COMPUTED and number % 8:
            yield Case(kind, number, "run", [str(path)], path)
        elif kind == COMPUTED:
            yield Case(kind, number, "sweep", [str(path), *computed], path)
        elif dry_run_every and number % dry_run_every == 0:
            yield Case(kind, number, "sweep", [str(path), "--dry-run"], path)
        else:
            yield Case(kind, number, "load_config", [str(path)], path)
    large_configuration(path)
    yield Case("100 MB", 0, "load_config", [str(path)], path)
    yield Case("100 MB", 0, "sweep", [str(path), "--dry-run"], path)
    path.unlink()


def result_cases(numbers: Iterable[int], folder: Path) -> Iterator[Case]:
    """Give result files to every command that reads them, in turn."""
    good_path, figure, pipe = folder / "good.h5", folder / "figure.png", folder / "pipe"
    good_result(good_path)
    # Whatever opens it waits for ever.
    os.mkfifo(pipe)
    good = good_path.read_bytes()
    for number in numbers:
        path = folder / f"{number}.h5"
        kind = damaged_result(number, good, path)
        commands = [
            ("info", []),
            ("stages", []),
            ("info", ["--verify", "--json"]),
            ("plot", ["--output", str(figure), "--dpi", "50"]),
        ]
        command, options = commands[number % len(commands)]
        yield Case(kind, number, command, [str(path), *options], path)
        if path.is_dir():
            path.rmdir()
        else:
            path.unlink(missing_ok=True)


def _fault(command: str, answer: dict) -> str:
    if answer["code"] == 0:
        return ""
    lines = answer["err"].splitlines()
    if answer["code"] == TOO_MANY_DIVERGED and command == "sweep":
        return "" if len(lines) == 1 and "lanes diverged" in lines[0] else "no message"
    if answer["code"] not in (2, 4):
        return f"exit code {answer['code']}"
    if not lines or "error: " not in lines[-1]:
        return "no message"
    odd = [line for line in lines if not line.startswith(f"gearchaos {command}: ")]
    if odd:
        return f"a line without the name of the command: {odd[0]!r}"
    if not all(line.isprintable() for line in lines):
        return "control characters in a message"
    return ""


def _state(path: Path) -> tuple[bool, int, int]:
    if not path.is_file():
        return path.exists(), 0, 0
    found = path.stat()
    return True, found.st_size, found.st_mtime_ns
