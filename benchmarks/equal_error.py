"""How much faster are resolved steps than plain ones at the same error of the state?

    python benchmarks/equal_error.py [--rounds 5]

Lanes of the full scene that cross clearance boundaries, from rest over 20 mesh periods; the error
is the largest one of any state, in the median lane, against 25,600 resolved steps per period. For
each wanted error the coarsest of the tried grids that reaches it is timed, plain and resolved in
turn, on one thread.
"""

import argparse
import statistics
import time
from pathlib import Path

import numpy as np
from gearchaos_kernels import Effects, Plan, integrate, use_threads
from machine import print_machine

from gearchaos import load_config
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021_full.toml"
LANES = 64
PERIODS = 20
TRUTH_STEPS = 25_600
GRIDS = tuple(int(100 * 2 ** (n / 2)) for n in range(17))
WANTED = (1e-4, 1e-6, 1e-8)


def main() -> None:
    """Find the grids, time them in turn, print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    print_machine()
    use_threads(1)
    config = load_config(SWEEP, ["sweep.from=3.0", "sweep.to=11.0", f"sweep.count={LANES}"])
    system = Lanes(config).system_of(np.arange(LANES))._replace(effects=Effects())

    def end_states(steps: int, resolved: bool) -> np.ndarray:
        plan = Plan(steps, 0, PERIODS, 0, False, resolved)
        return integrate(system, np.zeros((LANES, 10)), plan).end_state

    truth = end_states(TRUTH_STEPS, True)
    errors = {
        (steps, resolved): float(np.median(np.abs(end_states(steps, resolved) - truth).max(axis=1)))
        for resolved in (False, True)
        for steps in GRIDS
    }
    print(f"{'error':>8}{'plain':>10}{'resolved':>10}{'times faster':>14}")
    for wanted in WANTED:
        plain, resolved = (_coarsest(errors, mode, wanted) for mode in (False, True))
        if plain is None or resolved is None:
            best = min(errors[steps, False] for steps in GRIDS)
            print(f"{wanted:8.0e}{'-':>10}{resolved or '-':>10}   plain reaches {best:.0e} at best")
            continue
        ratios = []
        for _ in range(rounds):
            seconds = []
            for steps, mode in ((plain, False), (resolved, True)):
                began = time.perf_counter()
                end_states(steps, mode)
                seconds.append(time.perf_counter() - began)
            ratios.append(seconds[0] / seconds[1])
        print(f"{wanted:8.0e}{plain:10d}{resolved:10d}{statistics.median(ratios):14.1f}")


def _coarsest(errors: dict[tuple[int, bool], float], mode: bool, wanted: float) -> int | None:
    """Return the fewest steps from which on no tried grid is worse than wanted."""
    good = None
    for steps in reversed(GRIDS):
        if errors[steps, mode] > wanted:
            break
        good = steps
    return good


if __name__ == "__main__":
    main()
