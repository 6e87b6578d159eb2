"""Where does a user's time go: start-up, compilation, kernel, labels, files?

    python benchmarks/user.py [--rounds 3] [--python OTHER] [--rows carried ...] [--cold]

Every row is a command as a user types it, in a process of its own with one thread, or with two if
its name says so. The times are processor times in seconds except in the column "clock", which is
the time that passes; "memory" is the largest memory of the process in MB. All are medians over
rounds. Rows whose names begin with "first" compile in an empty cache. With --python the commands
also run in another environment, such as one with an earlier version, in turn with this one; the
last column is then the median of the ratios of the other version to this one.
"""

import argparse
import json
import os
import resource
import runpy
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

SWEEPS = Path(__file__).parent.parent / "sweeps"
PAN, SPEEDS, MAP = (
    str(SWEEPS / f"{name}.toml") for name in ("pan2021", "mesh_frequency", "speed_and_error")
)
MAPS = "integration={method='flow_map',steps_per_period=24}"
TIMES = "transient_periods=500,recorded_periods=500"
CARRIED = "start.carry='both'", "sweep.count=300"
SHORT = "sweep.count=100000", "outputs.section_points=10", "outputs.motion=false"
SHORT_TIMES = "transient_periods=10,recorded_periods=10"
EXPONENTS = "outputs.exponents=true", "outputs.motion=false", "sweep.count=151"
TANGENTS = "outputs.motion=false", "sweep.count=906"
FEW = "outputs.motion=false", "integration={steps_per_period=200,recorded_periods=20000}"
MANY = "outputs.motion=false", "outputs.lyapunov=false"
MILLION = *MANY, "sweep.count=1000000", "outputs.section_points=1"
POINTS = *MANY, "sweep.count=100000", "outputs.section_points=100"
FEWEST_TIMES = "integration={method='flow_map',transient_periods=1,recorded_periods=100}"

ROWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "pan2021, rk4": (PAN, ()),
    "pan2021, flow maps": (PAN, (MAPS,)),
    "map, 300 x 30": (MAP, ("second_sweep.count=30", "integration.steps_per_period=24")),
    "carried, rk4": (PAN, CARRIED),
    "carried, flow maps": (PAN, (*CARRIED, MAPS)),
    "own maps, rk4": (SPEEDS, ("integration.steps_per_period=200",)),
    "own maps, flow maps": (SPEEDS, (MAPS,)),
    "loads, rk4": (PAN, ("outputs.loads=true",)),
    "loads, flow maps": (PAN, (MAPS, "outputs.loads=true")),
    "exponents, rk4": (PAN, EXPONENTS),
    "exponents, flow maps": (PAN, (*EXPONENTS, MAPS)),
    "their tangents, rk4": (PAN, TANGENTS),
    "their tangents, flow maps": (PAN, (*TANGENTS, MAPS)),
    "one lane, rk4": (PAN, (*FEW, "sweep.from=10.0", "sweep.count=1")),
    "8 lanes, rk4": (PAN, (*FEW, "sweep.count=8")),
    "short, rk4": (PAN, (*SHORT, f"integration={{steps_per_period=200,{SHORT_TIMES}}}")),
    "short, flow maps": (PAN, (*SHORT, MAPS.replace("}", f",{SHORT_TIMES}}}"))),
    "refine, rk4": (PAN, ()),
    "refine, flow maps": (PAN, (MAPS,)),
    "first flow maps": (PAN, (MAPS, "sweep.count=8")),
    "pan2021, rk4, 2 threads": (PAN, ()),
    "pan2021, flow maps, 2 threads": (PAN, (MAPS,)),
    "million lanes": (PAN, (*MILLION, FEWEST_TIMES.replace("100}", "1}"))),
    "figure, 1e7 points": (PAN, (*POINTS, FEWEST_TIMES)),
}
"""Configuration and settings of every row.

A row "refine" is `stages --refine` of its result, a row "figure" is `plot` of it.
"""

LONGER = "longer records"
PARTS = ("start-up", "compilation", "kernel", LONGER, "labels", "files")
OTHERS = ("clock", "memory")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--python", help="interpreter of another version, for comparison")
    parser.add_argument("--rows", nargs="+", default=[""], help="beginnings of the rows to run")
    parser.add_argument("--output", type=Path, help="file for all times in JSON")
    parser.add_argument("--cold", action="store_true", help="compile anew in every process")
    options = parser.parse_args()
    from machine import machine_facts, print_machine

    print_machine()
    heads = "".join(f"{part:>15}" for part in PARTS) + "".join(f"{one:>8}" for one in OTHERS)
    print(f"{'row':30}{'total':>8}{heads}{'ratio':>8}")
    pythons = [sys.executable, *filter(None, [options.python])]
    rows = []
    for name in ROWS:
        if not name.startswith(tuple(options.rows)):
            continue
        # The first round compiles, and is counted only if that is what is measured.
        warm_up = 0 if options.cold else 1
        found = [
            [measured(name, python, options.cold) for python in pythons]
            for _ in range(warm_up + options.rounds)
        ][warm_up:]
        rows.append({"row": name, "times": found})
        print(line(name, found), flush=True)
    if options.output is not None:
        facts = {"machine": machine_facts(), "rows": rows}
        options.output.write_text(json.dumps(facts, indent=1), encoding="utf-8")


def line(name: str, found: list[list[dict[str, float]]]) -> str:
    """Return the line of a row; ``found``: its times by round and interpreter."""
    names = "total", *PARTS, *OTHERS
    own = {part: statistics.median(one[0][part] for one in found) for part in names}
    text = f"{name:30}{own['total']:8.2f}" + "".join(f"{own[part]:15.2f}" for part in PARTS)
    text += "".join(f"{own[part]:8.1f}" for part in OTHERS)
    if len(found[0]) > 1:
        ratio = statistics.median(other["total"] / this["total"] for this, other in found)
        text += f"{ratio:8.2f}"
    return text


def measured(name: str, python: str, cold: bool) -> dict[str, float]:
    """Run the command of a row with an interpreter, and return its processor times in seconds."""
    config, settings = ROWS[name]
    with tempfile.TemporaryDirectory() as folder:
        result = str(Path(folder) / "result.h5")
        sweep = ["sweep", config, "-o", result, *(f"--set={one}" for one in settings)]
        threads = "2" if name.endswith("2 threads") else "1"
        environment = {**os.environ, "NUMBA_NUM_THREADS": threads}
        # A user's Python keeps its compiled modules.
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        if cold or name.startswith("first"):
            environment["NUMBA_CACHE_DIR"] = folder
        times = timed(python, sweep, environment)
        if name.startswith("refine"):
            times = timed(python, ["stages", result, "--refine", "0.001"], environment)
        if name.startswith("figure"):
            figure = str(Path(folder) / "figure.png")
            times = timed(python, ["plot", result, "-o", figure], environment)
    return times


def timed(python: str, command: list[str], environment: dict[str, str]) -> dict[str, float]:
    """Run a command with the times of its parts."""
    words = [python, __file__, "--command", *command]
    before = time_of_children()
    # Not in the folder of a clone, whose sources Python would then import.
    ended = subprocess.run(
        words, env=environment, cwd=tempfile.gettempdir(), capture_output=True, text=True
    )
    if ended.returncode:
        raise SystemExit(ended.stderr)
    found = json.loads(ended.stderr.splitlines()[-1])
    # With the end of the process, which no process can time itself.
    found["total"] = time_of_children() - before
    return {**dict.fromkeys(OTHERS, 0.0), **found}


def time_of_children() -> float:
    """Return the processor time of all processes that were started and have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


class Clock:
    """Processor time by part; the time of a part within another one counts for the inner one."""

    def __init__(self) -> None:
        self.times = dict.fromkeys(PARTS, 0.0)
        self._inner: list[float] = []
        self._longer = 0

    def wrap(self, owner: Any, name: str, part: str) -> None:
        """Replace a function or method by one that is timed."""
        called: Callable[..., Any] = getattr(owner, name)

        def with_time(*arguments: Any, **options: Any) -> Any:
            # The kernel within a longer record counts for the record.
            self._longer += part == LONGER
            own = LONGER if self._longer else part
            self._inner.append(0.0)
            began = time.process_time()
            try:
                return called(*arguments, **options)
            finally:
                took = time.process_time() - began
                self.times[own] += took - self._inner.pop()
                self._longer -= part == LONGER
                if self._inner:
                    self._inner[-1] += took

        setattr(owner, name, with_time)


def watch_the_engine(clock: Clock) -> None:
    """Import the engine, which `plot` does without, and time its parts."""
    import gearchaos_kernels.batch as batch
    from numba.core.dispatcher import Dispatcher

    import gearchaos.dynamics.labelling as labelling
    import gearchaos.engine.kept as kept
    import gearchaos.engine.running  # noqa: F401
    from gearchaos.results.files.block_store import BlockStore

    clock.times["start-up"] = time.process_time()
    clock.wrap(Dispatcher, "compile", "compilation")
    clock.wrap(batch, "_integrate_blocks", "kernel")
    clock.wrap(labelling, "integrate", LONGER)
    clock.wrap(kept, "labels_of", "labels")
    clock.wrap(BlockStore, "write", "files")
    clock.wrap(BlockStore, "merge", "files")


def command(words: list[str]) -> None:
    """Run a command of gearchaos in this process; print the times of its parts as JSON."""
    sys.path.pop(0)
    began = time.perf_counter()
    clock = Clock()
    if words[0] != "plot":
        watch_the_engine(clock)
    sys.argv = [words[0], *words[1:]]
    try:
        runpy.run_module(f"gearchaos.{words[0]}", run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        if ended.code:
            raise
    found = {**clock.times, "clock": time.perf_counter() - began}
    found["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    sys.stderr.write("\n" + json.dumps(found) + "\n")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--command"]:
        command(sys.argv[2:])
    else:
        main()
