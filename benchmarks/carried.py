"""What does carrying cost: how fast are sweeps that hand their states on, beside free lanes?

    python benchmarks/carried.py [--rounds 3] [--output carried.json]

The same lanes, with tangent vector and labels, once free and once as carried sweeps side by
side: the lines of a second parameter, half as many in both directions. Rounds visit every number of
sweeps in turn; times are medians, ratios medians of the ratios to the free lanes of that round.
"""

import argparse
import json
import statistics
import time
from pathlib import Path

import numba
from machine import machine_facts, print_machine

from gearchaos import load_config
from gearchaos.engine.computing import EndStates, block_lanes, compute_block, rehearse
from gearchaos.engine.computing import blocks as blocks_of
from gearchaos.engine.executors import LocalExecutor, compute_blocks
from gearchaos.engine.run_plan import RunPlan, plan_run

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021.toml"
SWEEPS = (2, 16, 64, 128)
STEPS = 8
"""Values that each sweep goes through."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--output", type=Path, help="file for all times in JSON")
    options = parser.parse_args()
    print_machine()
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    simulations = {
        (sweeps, carry): simulation(sweeps, carry)
        for sweeps in SWEEPS
        for carry in ("none", "both")
    }
    lanes: dict[tuple[int, str], list[float]] = {key: [] for key in simulations}
    for one in simulations.values():
        rehearse(one)
        compute_block(one, (0, 1), EndStates(one).before(0))
    for _ in range(options.rounds):
        for key, one in simulations.items():
            lanes[key].append(lanes_per_second(one))
    print(f"\n{'sweeps':>8}{'carried, lanes/s':>18}{'free, lanes/s':>15}{'ratio':>8}")
    for sweeps in SWEEPS:
        carried, free = lanes[sweeps, "both"], lanes[sweeps, "none"]
        ratio = statistics.median(a / b for a, b in zip(carried, free, strict=True))
        medians = statistics.median(carried), statistics.median(free)
        print(f"{sweeps:8d}{medians[0]:18.1f}{medians[1]:15.1f}{ratio:8.2f}")
    if options.output is not None:
        rows = [{"sweeps": s, "carry": c, "lanes_per_second": r} for (s, c), r in lanes.items()]
        facts = {"machine": machine_facts(), "steps": STEPS, "rates": rows}
        options.output.write_text(json.dumps(facts, indent=1), encoding="utf-8")


def simulation(sweeps: int, carry: str) -> RunPlan:
    """Sweep the pitch error at several damping ratios, twice as many where nothing is carried."""
    lines = sweeps // 2 if carry == "both" else sweeps
    second = f'{{parameter="damping_ratio", from=0.04, to=0.06, count={lines}}}'
    steps = [f"second_sweep={second}", f"sweep.count={STEPS}", f"start.carry={carry}"]
    return plan_run(load_config(SWEEP, steps))


def lanes_per_second(simulation: RunPlan) -> float:
    """Compute all lanes in blocks as a run does."""
    blocks = blocks_of(simulation, block_lanes(simulation, numba.get_num_threads()))
    with LocalExecutor(simulation) as executor:
        began = time.perf_counter()
        compute_blocks(executor, blocks, {}.__setitem__)
        return len(simulation.lanes) / (time.perf_counter() - began)


if __name__ == "__main__":
    main()
