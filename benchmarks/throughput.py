"""How many Runge-Kutta steps a second does a core do, and how many times a textbook kernel's?

    python benchmarks/throughput.py [--rounds 7]

Rounds alternate between the kernels, so that a machine that slows down slows all of them; every
figure is the median over the rounds, and ratios are medians of the ratios within a round. Flow
maps, 24 a period, are counted as the 200 steps a period of the other rows.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import Effects, GearPairs, Plan, integrate
from machine import print_machine
from textbook import run_textbook

from gearchaos import load_config
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021_full.toml"
STEPS = 200
PERIODS = 100
LANES = 512
TEXTBOOK_LANES = 16
SCENES = {
    "full, 10 states": Effects(),
    "no axial pair, 6 states": Effects(axial=False),
    "torsion, 2 states": Effects(transverse=False, axial=False),
}
FLOW_MAP = {"steps": 24, "method": "flow_map"}
THREADED = {"": {}, ", resolved": {}, ", flow map": FLOW_MAP}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    print_machine()
    print(f"{STEPS} steps per period, median of {rounds} rounds, million steps per second\n")
    contestants = list(_contestants())
    for _, _, work in contestants:
        work()
    rates: dict[tuple[str, bool], list[float]] = {}
    for _ in range(rounds):
        for name, tangent, work in contestants:
            rates.setdefault((name, tangent), []).append(1e3 / nanoseconds_per_step(work))
    _print_table(rates)


def _contestants():
    """Yield (name, with tangent, work); the work returns the number of steps it did."""
    for tangent in (False, True):
        yield "textbook, 10 states", tangent, _textbook(tangent)
        for resolved in (False, True):
            for name, scene in SCENES.items():
                kind = f"{name}, resolved" if resolved else name
                yield kind, tangent, engine(scene, tangent, resolved, threads=1)
        for name, scene in SCENES.items():
            yield f"{name}, flow map", tangent, engine(scene, tangent, True, 1, **FLOW_MAP)
        for kind, how in THREADED.items():
            everything = engine(
                Effects(), tangent, kind != "", numba.config.NUMBA_NUM_THREADS, **how
            )
            yield f"full, {numba.config.NUMBA_NUM_THREADS} threads{kind}", tangent, everything


def _pan(lanes: int) -> GearPairs:
    config = load_config(SWEEP, ["sweep.from=0.0", "sweep.to=15.0", f"sweep.count={lanes}"])
    return Lanes(config).system_of(np.arange(lanes))


def engine(
    scene: Effects,
    tangent: bool,
    resolved: bool,
    threads: int,
    steps: int = STEPS,
    method: str = "rk4",
    **groups: float,
) -> Callable[[], int]:
    """Return work that integrates the sweep of Pan 2021 and returns how many steps that took.

    Steps of RK4: flow maps count for `STEPS` a period. ``groups``: groups of all lanes to replace.
    """
    lanes = LANES * threads
    system = _pan(lanes).replace(effects=scene)
    given = {name: np.full(lanes, value) for name, value in groups.items()}
    system = system.replace(groups=system.groups._replace(**given))
    # The end state is written in full, so that no effect can be optimised away.
    plan = Plan(steps, 0, PERIODS, 1, tangent, resolved, method=method)
    counted = lanes * PERIODS * (steps if method == "rk4" else STEPS)

    def work() -> int:
        numba.set_num_threads(threads)
        integrate(system, np.zeros((lanes, len(system.states))), plan)
        return counted

    return work


def _textbook(tangent: bool) -> Callable[[], int]:
    pan = _pan(TEXTBOOK_LANES)
    data = pan.groups, pan.stiffness_cosine, pan.stiffness_sine

    def work() -> int:
        numba.set_num_threads(1)
        run_textbook(*data, PERIODS, STEPS, tangent)
        return TEXTBOOK_LANES * PERIODS * STEPS

    return work


def nanoseconds_per_step(work: Callable[[], int]) -> float:
    """Time one piece of work."""
    began = time.perf_counter()
    steps = work()
    return (time.perf_counter() - began) / steps * 1e9


def _print_table(rates: dict[tuple[str, bool], list[float]]) -> None:
    print(f"{'kernel':34}{'plain':>8}{'ratio':>8}{'tangent':>10}{'ratio':>8}")
    for name in dict.fromkeys(name for name, _ in rates):
        cells = ""
        for tangent, width in ((False, 8), (True, 10)):
            mine, yardstick = rates[name, tangent], rates["textbook, 10 states", tangent]
            ratio = statistics.median(a / b for a, b in zip(mine, yardstick, strict=True))
            cells += f"{statistics.median(mine):{width}.1f}{ratio:8.1f}"
        print(f"{name:34}{cells}")
    for kind in THREADED:
        for tangent in (False, True):
            many = rates[f"full, {numba.config.NUMBA_NUM_THREADS} threads{kind}", tangent]
            pairs = zip(many, rates[f"full, 10 states{kind}", tangent], strict=True)
            speedup = statistics.median(a / b for a, b in pairs)
            with_tangent = ", with tangent" if tangent else ""
            threads = numba.config.NUMBA_NUM_THREADS
            print(f"{threads} threads over 1{kind}{with_tangent}: {speedup:.2f}")


if __name__ == "__main__":
    main()
