"""What does a controller cost a lane?

    python benchmarks/control.py [--rounds 25]

The pair of Pan 2021 in chaos is integrated without and with a controller, in turns. The gain is so
small that the motion crosses as many boundaries in both. Times are processor times of one thread;
ratios are medians over the rounds. Those of RK4 vary by 15 % from process to process: run the
script several times.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import Control, GearPairs, Plan, integrate
from machine import print_machine

from gearchaos import load_config
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021.toml"
LANES = 512
PERIODS = {"rk4": 60, "flow_map": 240}
STEPS = {"rk4": 200, "flow_map": 12}
GAIN = 1e-12


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=25)
    rounds = parser.parse_args().rounds
    print_machine()
    numba.set_num_threads(1)
    system = _pan()
    print(f"processor time with a controller over that without, medians of {rounds} rounds\n")
    print(f"{'method':10}{'exponent':>10}{'all states':>12}{'estimate':>10}")
    for method in STEPS:
        for tangent in (False, True):
            works = [_work(system.controlled(one), method, tangent) for one in _controls(system)]
            ratios = _ratios(works, rounds)
            cells = f"{ratios[0]:12.3f}{ratios[1]:10.3f}"
            print(f"{method:10}{'yes' if tangent else 'no':>10}{cells}", flush=True)


def _pan() -> GearPairs:
    """Return lanes of the pair in chaos."""
    config = load_config(SWEEP, ["sweep.from=12.4", "sweep.to=12.6", f"sweep.count={LANES}"])
    return Lanes(config).system_of(np.arange(LANES))


def _controls(system: GearPairs) -> list[Control | None]:
    """Return no controller, one that knows all states, and one that estimates them."""
    states = len(system.states)
    points = np.zeros((LANES, 1, states))
    known = Control.of_states(points, points + GAIN, np.ones(LANES))
    estimated = known._replace(
        measured=np.arange(2),
        noise=np.zeros((LANES, 2)),
        transition=np.tile(0.1 * np.eye(states), (LANES, 1, 1, 1)),
        response=points + 0.1,
        correction=np.full((LANES, 1, states, 2), 0.1),
    )
    return [None, known, estimated]


def _work(system: GearPairs, method: str, tangent: bool) -> Callable[[], None]:
    """Return the integration of all lanes."""
    plan = Plan(STEPS[method], 0, PERIODS[method], 1, tangent, method=method)
    start = np.zeros((LANES, len(system.states)))
    return lambda: integrate(system, start, plan) and None


def _ratios(works: list[Callable[[], None]], rounds: int) -> list[float]:
    """Return the times of all works but the first, over that of the first."""
    for work in works:
        work()
    times = np.array([[_seconds(work) for work in works] for _ in range(rounds)])
    return [statistics.median(times[:, n] / times[:, 0]) for n in range(1, len(works))]


def _seconds(work: Callable[[], None]) -> float:
    """Return the processor time of some work."""
    began = time.process_time()
    work()
    return time.process_time() - began


if __name__ == "__main__":
    main()
