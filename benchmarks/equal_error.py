"""How much faster are resolved steps than plain ones at the same error, and flow maps than both?

    python benchmarks/equal_error.py [--rounds 7] [--periods 100]

Lanes of Pan 2021 that cross clearance boundaries, from rest; the error is the largest one of any
state after 20 mesh periods, in the median lane, against 25,600 resolved steps per period, which
share nothing with flow maps. For each wanted error the coarsest of the tried grids that reaches it
is timed, plain, resolved and 24 flow maps in turn, on one thread, in processor time, over as many
periods as --periods sets: of a sweep over 1000, a call as such is no part worth naming. Flow maps
are made before; the time for that is printed apart.
"""

import argparse
import statistics
import time
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import Effects, Plan, integrate
from gearchaos_kernels.batch import scene_of
from gearchaos_kernels.methods.flow_map.store import maps_of
from machine import print_machine

from gearchaos import load_config
from gearchaos.accuracy import MODES
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021_full.toml"
LANES = 256
PERIODS = 20
TRUTH_STEPS = 25_600
FLOW_MAP_STEPS = 24
GRIDS = tuple(int(100 * 2 ** (n / 2)) for n in range(17))
WANTED = (1e-4, 1e-6, 1e-8)


def main() -> None:
    """Find the grids, time them in turn, print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--periods", type=int, default=100)
    options = parser.parse_args()
    print_machine()
    numba.set_num_threads(1)
    config = load_config(SWEEP, ["sweep.from=3.0", "sweep.to=11.0", f"sweep.count={LANES}"])
    lanes = Lanes(config).system_of(np.arange(LANES))
    for effects in Effects(), Effects(axial=False), Effects(axial=False, transverse=False):
        _compare(lanes.replace(effects=effects), options.rounds, options.periods)


def _compare(system, rounds: int, timed_periods: int) -> None:
    def integrated(steps: int, mode: str, tangent: bool = False, periods=PERIODS) -> np.ndarray:
        resolved, method = MODES[mode]
        plan = Plan(steps, 0, periods, 0, tangent, resolved, method=method)
        return integrate(system, np.zeros((LANES, len(system.states))), plan).end_state

    def seconds(steps: int, mode: str, tangent: bool) -> float:
        began = time.process_time()
        integrated(steps, mode, tangent, timed_periods)
        return time.process_time() - began

    truth = integrated(TRUTH_STEPS, "resolved")

    def error(steps: int, mode: str) -> float:
        return float(np.median(np.abs(integrated(steps, mode) - truth).max(axis=1)))

    errors = {mode: {n: error(n, mode) for n in GRIDS} for mode in ("plain", "resolved")}
    print(
        f"\n{len(system.states)} states; {FLOW_MAP_STEPS} flow maps: error "
        f"{error(FLOW_MAP_STEPS, 'flow map'):.0e}, made in {_making(system) * 1e3:.0f} ms; "
        "steps, and time in that of flow maps"
    )
    print(f"{'error':>8}{'plain':>15}{'resolved':>15}{'plain, tangent':>18}{'resolved':>15}")
    for wanted in WANTED:
        grids = {mode: _coarsest(errors[mode], wanted) for mode in errors}
        cells = ""
        for tangent in (False, True):
            for mode, steps in grids.items():
                if steps is None:
                    cells += f"{'-':>15}"
                    continue
                pair = (steps, mode), (FLOW_MAP_STEPS, "flow map")
                for contestant in pair:
                    integrated(*contestant, tangent)
                times = [[seconds(*one, tangent) for one in pair] for _ in range(rounds)]
                ratio = statistics.median(mine / map_ for mine, map_ in times)
                cells += f"{steps:9d}{ratio:6.1f}"
        print(f"{wanted:8.0e}{cells}", flush=True)


def _making(system) -> float:
    """Return the seconds in which the maps that these lanes share are made."""
    plan = Plan(FLOW_MAP_STEPS, 0, PERIODS, 0, method="flow_map")
    seconds = []
    for number in range(1, 6):
        # Maps that were made are kept; those of a slightly larger damping are not.
        damping = system.groups.damping_ratio * (1.0 + number * 1e-9)
        other = system.replace(groups=system.groups._replace(damping_ratio=damping)).of([0])
        began = time.process_time()
        maps_of(other, FLOW_MAP_STEPS, scene_of(other, plan))
        seconds.append(time.process_time() - began)
    return statistics.median(seconds)


def _coarsest(errors: dict[int, float], wanted: float) -> int | None:
    """Return the fewest steps from which on no tried grid is worse than wanted."""
    good = None
    for steps in reversed(GRIDS):
        if errors[steps] > wanted:
            break
        good = steps
    return good


if __name__ == "__main__":
    main()
