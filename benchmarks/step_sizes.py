"""Where do the stages of figure 7 of Pan 2021 come out at each step size, and in what time?

    python benchmarks/step_sizes.py [--steps 50,100,200,400,800] [--output step_sizes]

The same sweep at several numbers of steps per mesh period, with plain and with resolved steps, and
with 12 to 96 flow maps. The boundaries are read off the sweep's own grid of 0.01; the last column
is the wall time of the computation relative to the fastest run.
"""

import argparse
import json
import statistics
import time
from pathlib import Path

import matplotlib
import numba
import numpy as np
from machine import machine_facts, print_machine
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

import gearchaos
from gearchaos.accuracy import MODES
from gearchaos.figures.style import style
from gearchaos.figures.work_precision import LOOKS
from gearchaos.records.period import motion_period
from gearchaos.results.reading.result import Result

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021.toml"
CHAOTIC = 0.01
FLOW_MAP_STEPS = (12, 24, 48, 96)
BOUNDARIES = ("hop", "period 1 ends", "period 2 ends", "chaos begins", "period 3 from", "to")


def main() -> None:
    """Run the sweeps, print a table, write JSON and a figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", default="50,72,100,144,200,288,400,800")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--output", type=Path, default=Path("step_sizes"))
    options = parser.parse_args()
    print_machine()
    steps = tuple(map(int, options.steps.split(",")))
    runs = [
        (mode, count, _config(mode, count))
        for mode in MODES
        for count in (FLOW_MAP_STEPS if mode == "flow map" else steps)
    ]
    for _, _, config in runs:
        gearchaos.run(config.replace("sweep.count", 11))
    # Rounds visit every run in turn, so that a machine that slows down slows all of them.
    rounds = [[_timed(config) for _, _, config in runs] for _ in range(options.rounds)]
    rows = [
        (mode, count, rounds[0][number][0], statistics.median(r[number][1] for r in rounds))
        for number, (mode, count, _) in enumerate(runs)
    ]
    _print(rows)
    table = [
        {"mode": mode, "steps_per_period": steps, "boundaries": found, "seconds": seconds}
        for mode, steps, found, seconds in rows
    ]
    facts = {"machine": machine_facts(), "threads": numba.config.NUMBA_NUM_THREADS, "runs": table}
    options.output.with_suffix(".json").write_text(json.dumps(facts, indent=1))
    _draw(rows, options.output.with_suffix(".png"))


def _config(mode: str, steps: int) -> gearchaos.Configuration:
    resolved, method = MODES[mode]
    table = {
        "steps_per_period": steps,
        "crossings": "resolved" if resolved else "plain",
        "method": method,
    }
    return gearchaos.load_config(SWEEP, [f"integration.{key}={table[key]}" for key in table])


def _timed(config: gearchaos.Configuration) -> tuple[dict[str, float], float]:
    began = time.perf_counter()
    result = gearchaos.run(config)
    seconds = time.perf_counter() - began
    return boundaries(result), seconds


def boundaries(result: Result) -> dict[str, float]:
    """Return the places of figure 7's stage boundaries in multiples of the pitch error."""
    multiple = result["pitch_error"]
    section = result["section_delta_5"]
    period = motion_period(section[:, :, np.newaxis])
    low = multiple < 3.0
    jump = np.abs(np.diff(section[low, -1]))
    window = _longest_run(np.isin(period, (3, 6)))
    first_chaos = int(np.argmax(result["lyapunov_exponent"] > CHAOTIC))
    before = multiple < multiple[first_chaos]
    places = (
        multiple[np.argmax(jump) + 1],
        multiple[np.flatnonzero(before & (period == 1))[-1]],
        multiple[np.flatnonzero(before & (period == 2))[-1]],
        multiple[first_chaos],
        multiple[window[0]],
        multiple[window[1]],
    )
    return {name: float(place) for name, place in zip(BOUNDARIES, places, strict=True)}


def _longest_run(chosen: np.ndarray) -> tuple[int, int]:
    """Return the first and last index of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    runs = edges.reshape(-1, 2)
    first, after = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    return int(first), int(after) - 1


def _print(rows: list[tuple[str, int, dict[str, float], float]]) -> None:
    fastest = min(seconds for *_, seconds in rows)
    print(f"{'mode':10}{'steps':>6}" + "".join(f"{n:>15}" for n in BOUNDARIES) + f"{'time':>8}")
    for mode, steps, found, seconds in rows:
        places = "".join(f"{found[name]:15.2f}" for name in BOUNDARIES)
        print(f"{mode:10}{steps:6d}{places}{seconds / fastest:8.1f}")


def _draw(rows: list[tuple[str, int, dict[str, float], float]], path: Path) -> None:
    finest = rows[-1][2]
    with matplotlib.rc_context(style()):
        figure = Figure(figsize=(3.35, 3.2), layout="constrained")
        shifts, times = figure.subplots(2, sharex=True)
        for mode, look in LOOKS.items():
            mine = [row for row in rows if row[0] == mode]
            steps = [row[1] for row in mine]
            worst = [
                max(abs(found[name] - finest[name]) for name in BOUNDARIES)
                for _, _, found, _ in mine
            ]
            marks = {**look, "markersize": 3, "linewidth": 0.8}
            shifts.plot(steps, worst, label=mode, **marks)
            times.plot(steps, [row[3] for row in mine], **marks)
        every = sorted({row[1] for row in rows})[::2]
        for axes in (shifts, times):
            axes.set_xscale("log")
            axes.set_xticks(every, [str(steps) for steps in every])
            axes.xaxis.set_minor_locator(NullLocator())
        shifts.set_ylabel("largest shift of\na stage boundary")
        shifts.legend(frameon=False)
        times.set_ylabel("wall time (s)")
        times.set_ylim(bottom=0)
        times.set_xlabel("steps per mesh period")
        figure.savefig(path, dpi=300)


if __name__ == "__main__":
    main()
