"""Commands given bad input under watch: what a case is, how it ends, and what is a failure."""

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
"""Added to the time limit of the first case of a process, which imports and compiles."""

COMPILING_SECONDS = 20.0
"""Added to the time without an answer after which a case hangs: it may compile its kernels."""

BUSY = 30.0
"""Seconds in which a process is given one second of the processor, at least."""


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
"""Commands that need most of what a result file holds."""


WORDINGS = ("units", "long_name", "symbol", "origin", "ancillary_variables")
"""Attributes of a dataset that say what it is to people."""


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
    """How a case ended.

    Attributes
    ----------
    code : int or None
    fault : str
        "" where there is none.
    said : str
    seconds : float
        Of the processor, where it answered.
    megabytes : int
        The most that its process has had so far.
    """

    code: int | None
    fault: str
    said: str
    seconds: float
    megabytes: int = 0


class Watch:
    """A worker process with limits for each case; it is replaced where it hangs, dies or grows.

    Seconds are those of the processor; an answer may take longer on a machine that is busy.
    """

    def __init__(self, folder: Path, seconds: float = 5.0, megabytes: int = 500) -> None:
        self._folder, self._seconds, self._megabytes = folder, seconds, megabytes
        self._worker: subprocess.Popen[str] | None = None

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
        allowed = self._seconds + STARTING_SECONDS * (self._worker is None)
        answer = self._ask([case.command, *case.arguments], BUSY * (allowed + COMPILING_SECONDS))
        if isinstance(answer, str):
            return Ending(None, answer, "", time.monotonic() - began)
        seconds, megabytes = answer["seconds"], answer["megabytes"]
        fault = answer["escaped"] or _fault(case.command, answer)
        if seconds > allowed:
            # It may have compiled a kernel, which it need not do twice.
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
    goods = _good_results(folder)
    # Whatever opens it waits for ever.
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
    """Remove each dataset and attribute of a sound result in turn, and give it to its readers.

    Datasets, attributes of the file and meanings of flags go to every command, and other attributes
    of a dataset to the commands in turn. Wordings of one kind are removed from all datasets at
    once, and go to the command that draws figures.
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
    """Give every forgery to every command that reads result files, or to some of them."""
    (good, *_), path = _good_results(folder), folder / "forged.h5"
    for number, name in enumerate(FORGERIES):
        forged_result(name, good, path)
        for command, *options in map(str.split, readers):
            yield Case(name, number, command, [str(path), *options], path)
    path.unlink()


def _good_results(folder: Path) -> list[bytes]:
    # What is damaged may point to this one.
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
