"""How much faster are two threads than one, for the lanes of one sweep?

    python benchmarks/two_threads.py [--lanes 1500] [--rounds 21]

The sweep of Pan 2021 from rest, by the clock. A round times one and two threads one after the
other; every figure is the median of the ratios within a round. Other processes take their share of
the second core: on a busy machine the ratio is smaller.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import integrate
from machine import print_machine

from gearchaos import load_config
from gearchaos.engine.run_plan import plan_run

SWEEP = Path(__file__).parents[1] / "sweeps" / "pan2021.toml"


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lanes", type=int, default=1500)
    parser.add_argument("--rounds", type=int, default=21)
    options = parser.parse_args()
    print_machine()
    print(f"two threads over one, {options.lanes} lanes, median of {options.rounds} rounds\n")
    for method in ("rk4", "flow_map"):
        work = _sweep(method, options.lanes)
        work(1), work(2)
        ratio = statistics.median(work(1) / work(2) for _ in range(options.rounds))
        print(f"{method:10}{ratio:6.2f}", flush=True)


def _sweep(method: str, lanes: int) -> Callable[[int], float]:
    """Return work that integrates the sweep with a number of threads and returns its seconds."""
    changes = [f"sweep.count={lanes}", f'integration.method="{method}"']
    run = plan_run(load_config(SWEEP, changes))
    system = run.lanes.system_of(np.arange(lanes))
    start = np.zeros((lanes, len(system.states)))

    def work(threads: int) -> float:
        numba.set_num_threads(threads)
        began = time.perf_counter()
        integrate(system, start, run.plan)
        return time.perf_counter() - began

    return work


if __name__ == "__main__":
    main()
