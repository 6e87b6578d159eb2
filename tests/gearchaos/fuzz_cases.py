"""Cases of bad input for commands, a watch that runs them, and the rules for a failure."""

import json
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

from gearchaos.command_line import TOO_MANY_DIVERGED

from .fuzz_configurations import COMPUTED, configuration, large_configuration
from .fuzz_forgeries import FORGERIES, forged_result, parts_of, without
from .fuzz_results import GOOD_AXES, damaged_result, good_result

WORKER = Path(__file__).with_name("fuzz_worker.py")
STARTING_SECONDS = 60.0
"""Added to the time limit of the first case of a process: it imports and compiles."""

COMPILING_SECONDS = 20.0
"""Added to the longest wait for an answer: a case may have to compile its kernels."""

BUSY = 30.0
"""Longest time, in seconds, in which a process gets one second of processor time."""


READERS = (
    "info",
    "stages",
    "info --verify --json",
    "plot --output figure.png --dpi 50",
    "stages --json --at -1e308",
    "plot --stages --output stages.png --dpi 50 --overwrite",
)
"""Commands that read a result file, and their options."""


USERS = (
    "info",
    "stages",
    "export table.csv --overwrite",
    "plot --output figure.png --dpi 50 --overwrite",
    "response --at=load=1 --periods 1 --output motion.h5 --overwrite",
)
"""Commands that need most parts of a result file, and their options."""


WORDINGS = ("units", "long_name", "symbol", "origin", "ancillary_variables")
"""Attributes of a dataset that describe it to readers."""


class Case(NamedTuple):
    """One bad input and the command that reads it.

    Attributes
    ----------
    kind : str
        Change of the input, in a few words.
    number : int
        Number that reproduces the case.
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
    """How a case ended.

    Attributes
    ----------
    code : int or None
    fault : str
        "" if there is none.
    said : str
        Text on stderr, otherwise on stdout.
    seconds : float
        Processor time if the process answered, otherwise elapsed time.
    megabytes : int
        Largest memory of its process so far.
    """

    code: int | None
    fault: str
    said: str
    seconds: float
    megabytes: int = 0


class Watch:
    """A worker process with limits for each case; it is replaced if it hangs, dies or grows.

    Seconds are processor time; on a busy machine an answer may take longer.
    """

    def __init__(self, folder: Path, seconds: float = 5.0, megabytes: int = 500) -> None:
        self._folder, self._seconds, self._megabytes = folder, seconds, megabytes
        self._worker: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, cases: Iterable[Case]) -> Iterator[tuple[Case, Ending]]:
        """Run cases one after the other; the input of a case exists until the next one is taken."""
        for case in cases:
            yield case, self._run(case)

    def _run(self, case: Case) -> Ending:
        before = _state(case.path)
        began = time.monotonic()
        allowed = self._seconds + STARTING_SECONDS * (self._worker is None)
        answer = self._ask([case.command, *case.arguments], BUSY * (allowed + COMPILING_SECONDS))
        if isinstance(answer, str):
            return Ending(None, answer, "", time.monotonic() - began)
        seconds, megabytes = answer["seconds"], answer["megabytes"]
        fault = answer["escaped"] or _fault(case.command, answer)
        if seconds > allowed:
            # The first run may have compiled a kernel; the second run need not.
            again = self._ask([case.command, *case.arguments], BUSY * allowed)
            seconds = seconds if isinstance(again, str) else again["seconds"]
        if seconds > allowed:
            fault = f"takes {seconds:.1f} s"
        if megabytes > self._megabytes:
            fault = f"takes {megabytes} MB"
            self._end()
        if _state(case.path) != before:
            fault = "the input has changed"
        said = answer["err"] or answer["out"]
        return Ending(answer["code"], fault, said, seconds, megabytes)

    def _ask(self, command: list[str], limit: float) -> dict[str, Any] | str:
        if self._worker is None:
            self._worker = subprocess.Popen(
                [sys.executable, str(WORKER)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=self._folder,
                text=True,
            )
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
    """Run the files of kind `COMPUTED`, some to a file; only load or dry-run the other files."""
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
    """Give damaged result files to the commands that read results, in turn."""
    goods = _good_results(folder)
    # A process that opens this pipe waits forever.
    os.mkfifo(folder / "pipe")
    for number in numbers:
        path = folder / f"{number}.h5"
        kind = damaged_result(number, goods[number // len(READERS) % len(goods)], path)
        command, *options = READERS[number % len(READERS)].split()
        yield Case(kind, number, command, [str(path), *options], path)
        if path.is_dir():
            path.rmdir()
        else:
            path.unlink(missing_ok=True)


def lacking_cases(folder: Path) -> Iterator[Case]:
    """Remove each dataset and attribute of a sound result in turn, and give the rest to commands.

    Files that lack a dataset, an attribute of the file or meanings of flags go to every command.
    Files that lack another attribute of a dataset go to one command each, in turn. Wordings of one
    kind are removed from all datasets at once; these files go to the command that draws figures.
    """
    good, path = _good_results(folder)[0], folder / "lacking.h5"
    parts = parts_of(good)
    worded = {key: [part for part in parts if part[1] == key] for key in WORDINGS}
    removed = [(" ".join(part), [part]) for part in parts if part[1] not in WORDINGS]
    removed += [(f"every {key}", found) for key, found in worded.items()]
    for number, (kind, lacking) in enumerate(removed):
        without(lacking, good, path)
        name, key = lacking[0]
        decisive = name == "/" or key in ("", "flag_meanings")
        one = USERS[3:4] if key in WORDINGS else [USERS[number % len(USERS)]]
        for command, *options in map(str.split, USERS if decisive else one):
            arguments = [str(path), *(str(folder / one) if "." in one else one for one in options)]
            yield Case(kind, number, command, arguments, path)
    path.unlink()


def forged_cases(folder: Path, readers: Sequence[str] = READERS) -> Iterator[Case]:
    """Give every forgery to all commands that read result files, or to the given ones."""
    (good, *_), path = _good_results(folder), folder / "forged.h5"
    for number, name in enumerate(FORGERIES):
        forged_result(name, good, path)
        for command, *options in map(str.split, readers):
            yield Case(name, number, command, [str(path), *options], path)
    path.unlink()


def _good_results(folder: Path) -> list[bytes]:
    # Damaged files may point to this file.
    path = folder / "good.h5"
    contents = []
    for axes in reversed(GOOD_AXES):
        path.unlink(missing_ok=True)
        good_result(path, axes)
        contents.insert(0, path.read_bytes())
    return contents


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
