"""What does handing out blocks cost: in this process, to one dask worker, and to two?

    python benchmarks/executors.py [--rounds 3] [--output executors.json]

The same sweep is computed into a store of blocks by each executor with each size of blocks. All
executors have the same cores: one worker has all threads, two have half of them each. Rounds visit
every contestant in turn; times are medians, ratios medians of the ratios within a round to the
fastest size of blocks in this process. Starting the workers is not counted, but printed apart.
"""

import argparse
import json
import statistics
import tempfile
import time
from pathlib import Path

import numba
from machine import machine_facts, print_machine

from gearchaos import load_config
from gearchaos.engine.computing import blocks, rehearse
from gearchaos.engine.dask_executor import DaskExecutor
from gearchaos.engine.executors import BlockExecutor, LocalExecutor, compute_blocks
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.engine.store_filling import open_store

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021.toml"
SHORT = ["integration.transient_periods=50", "integration.recorded_periods=100"]
LANES = 8192
SIZES = (64, 256, 1024, 4096)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--lanes", type=int, default=LANES)
    parser.add_argument("--output", type=Path, help="file for all times in JSON")
    options = parser.parse_args()
    print_machine()
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    simulation = plan_run(load_config(SWEEP, [f"sweep.count={options.lanes}", *SHORT]))
    rehearse(simulation)
    began = time.perf_counter()
    with (
        LocalExecutor(simulation) as here,
        DaskExecutor(simulation, "local:1") as one,
        DaskExecutor(simulation, "local:2") as two,
    ):
        executors = {"in this process": here, "1 dask worker": one, "2 dask workers": two}
        for executor in executors.values():
            seconds_of(simulation, executor, options.lanes // 8)  # Workers build the simulation.
        print(f"{time.perf_counter() - began:.1f} s until all workers are ready\n")
        times: dict[tuple[str, int], list[float]] = {}
        for _ in range(options.rounds):
            for name, executor in executors.items():
                for size in SIZES:
                    seconds = seconds_of(simulation, executor, size)
                    times.setdefault((name, size), []).append(seconds)
    print_table(times, options.lanes)
    if options.output is not None:
        rows = [{"executor": n, "lanes": s, "seconds": t} for (n, s), t in times.items()]
        facts = {"machine": machine_facts(), "lanes": options.lanes, "times": rows}
        options.output.write_text(json.dumps(facts, indent=1), encoding="utf-8")


def seconds_of(simulation: RunPlan, executor: BlockExecutor, size: int) -> float:
    """Compute the sweep in blocks of `size` lanes, to the last block on the disk."""
    with tempfile.TemporaryDirectory() as folder:
        output = str(Path(folder) / "sweep.h5")
        with open_store(simulation, output, resume=False) as store:
            began = time.perf_counter()
            compute_blocks(
                executor,
                blocks(simulation, size),
                lambda block, arrays: store.write(*block, arrays),
            )
            return time.perf_counter() - began


def print_table(times: dict[tuple[str, int], list[float]], lanes: int) -> None:
    """Print seconds and ratios, a row for each executor."""
    here = next(iter(times))[0]
    best = min((s for n, s in times if n == here), key=lambda s: statistics.median(times[here, s]))
    heads = "".join(f"{f'{size} lanes':>16}" for size in SIZES)
    print(f"seconds for {lanes} lanes, and ratio to blocks of {best} lanes in this process")
    print(f"{'':18}{heads}")
    for name in dict.fromkeys(name for name, _ in times):
        cells = ""
        for size in SIZES:
            pairs = zip(times[name, size], times[here, best], strict=True)
            ratio = statistics.median(mine / yardstick for mine, yardstick in pairs)
            cells += f"{statistics.median(times[name, size]):10.2f}{ratio:6.2f}"
        print(f"{name:18}{cells}")


if __name__ == "__main__":
    main()
