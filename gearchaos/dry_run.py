"""What ``--dry-run`` tells: what a sweep would compute, and how much time and memory that takes."""

import json
import math
import os
import sys
import time
from contextlib import suppress
from copy import copy
from datetime import timedelta
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import LANES
from tqdm import tqdm

from gearchaos.arrays import Integers
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.resonances import resonances
from gearchaos.engine.simulation import Simulation
from gearchaos.engine.store_filling import Shard
from gearchaos.outputs.names import DIRECTION, START
from gearchaos.progress import notice
from gearchaos.results.files.block_store import PIECE_BYTES, lanes_and_record
from gearchaos.results.files.result_file import CACHE_BYTES

SAMPLE_STEPS = 500
"""Steps per period of a sample, if they are stable: several times as many as most sweeps take."""

SAMPLE_PERIODS = 1000
"""Mesh periods of a sample: over much fewer, labels cost more than their share."""


def describe(simulation: Simulation, output: str, shard: Shard | None, as_json: bool) -> None:
    """Say what a run, or one shard of it, would compute, judged by a sample of its lanes."""
    config, lanes, threads = simulation.config, simulation.lanes, numba.get_num_threads()
    every, record = lanes_and_record(simulation.variables)
    own = every if shard is None else sum(last - first for first, last in shard.blocks(every))
    seconds = own * _seconds_per_lane(simulation)
    bytes_kept, kept = own * record.itemsize, [record[name] for name in record.names or ()]
    memory = _memory(simulation) + sum(min(CACHE_BYTES, every * one.itemsize) for one in kept)
    memory += min(PIECE_BYTES, bytes_kept) if simulation.carried else 0
    # What HDF5 and the allocator keep while a file is written is not known beforehand.
    memory += memory // 20
    plan, resonant = simulation.plan, resonances(lanes)
    steps = own * (plan.transient_periods + plan.recorded_periods) * plan.steps_per_period
    if as_json:
        facts = {"output": output, "exists": os.path.exists(output), "states": len(lanes.states)}
        facts |= {"lanes": own, "steps": steps, "seconds": seconds, "threads": threads}
        facts |= {"file_bytes": bytes_kept, "memory_bytes": memory, **resonant.facts}
        facts["steps_per_period"] = plan.steps_per_period
        print(json.dumps(facts, indent=1))
        return
    duration = f"{seconds:.1f} s" if seconds < 100 else str(timedelta(seconds=round(seconds)))
    spans = [
        f"{axis.values.size} values of {axis.name} from {axis.values[0]:g} to {axis.values[-1]:g}"
        for axis in lanes.axes
        if axis.name not in (START, DIRECTION)
    ]
    if lanes.starts > 1:
        spans.append(f"{lanes.starts} starts each")
    if lanes.directions > 1:
        spans.append("in both directions")
    unused = ", ".join(name for name in config.scene.effects if name not in lanes.effects)
    unused = f" (nothing that is kept needs {unused})" if unused else ""
    for key, value in {
        "output": f"{output}{' (exists)' if os.path.exists(output) else ''}",
        **resonant.texts,
        "effects": ", ".join(config.scene.effects) or "none",
        "states": f"{len(lanes.states)}{unused}",
        "lanes": f"{own}{'' if shard is None else f' of {every}'} ({', '.join(spans)})",
        "steps": f"{steps:.3g} ({plan.steps_per_period} per period)",
        "file": f"about {tqdm.format_sizeof(bytes_kept, 'B')} before compression",
        "memory": f"about {tqdm.format_sizeof(memory, 'B')} at the peak of the process",
        "time": f"about {duration} with {threads} thread{'s' if threads > 1 else ''}",
    }.items():
        sys.stderr.write(f"{key + ':':12}{value}\n")


def _seconds_per_lane(simulation: Simulation) -> float:
    """Compute a block of lanes from all over the sweep, as long as it takes to label them.

    A whole block: what is checked, or looked at again, is computed in vectors of lanes.
    """
    sample, plan = copy(simulation), simulation.plan
    block = simulation.block_lanes(numba.get_num_threads())
    places = some_places(simulation, block // 8 if simulation.carried else block)
    steps = _sampled_steps(simulation, places)
    finer = plan.steps_per_period / steps
    periods, whole = plan.transient_periods + plan.recorded_periods, simulation.lanes.repeats_after
    with notice("computing some lanes, to tell how long all take"):
        # The first time, little is computed, and the kernels are loaded. It takes a step more, so
        # that flow maps are still to be made the second time: once, for however many periods.
        for more, length in (1, min(1.0, 8.0 / periods)), (0, min(1.0, SAMPLE_PERIODS / periods)):
            transient, recorded = (
                whole * math.ceil(length * every / whole)
                for every in (plan.transient_periods, plan.recorded_periods)
            )
            sample.plan = plan._replace(
                steps_per_period=steps + more,
                # As large a share of the flow maps is kept as in the whole run.
                map_bytes=int(plan.map_bytes / finer),
                transient_periods=transient,
                recorded_periods=recorded,
                section_points=min(plan.section_points, recorded),
            )
            began = time.perf_counter()
            sample.integrate(places, sample.plan._replace(transient_periods=0, recorded_periods=0))
            made = time.perf_counter()
            found = sample.integrate(places, sample.recording)
            sample.arrays(sample.lanes.computed_at(places), *found)
            scale = periods / (transient + recorded)
            seconds = (made - began + scale * (time.perf_counter() - made)) / places.size
    return finer * seconds


def _sampled_steps(simulation: Simulation, places: Integers) -> int:
    """Return the steps per period of a sample: the time grows with them in proportion.

    So few that a sample takes seconds, and as many as a step of RK4 needs to be stable, and a flow
    map not to be divided.
    """
    steps = simulation.plan.steps_per_period
    if steps <= SAMPLE_STEPS:
        return steps
    system = simulation.lanes.system_of(simulation.lanes.computed_at(places))
    needed = int(fewest_stable_steps(system).max()) + 2 * system.harmonics()
    return min(steps, max(SAMPLE_STEPS, needed))


def some_places(simulation: Simulation, count: int) -> Integers:
    """Return about so many places in the order of computation, from all over the sweep.

    Neighbours behave alike, which a vector of lanes profits from. Those of a carried sweep, where
    one lane goes on from another, are all from its middle.
    """
    lanes = simulation.lanes
    run = min(len(lanes), count if simulation.carried else LANES)
    runs = -(-min(count, len(lanes)) // run)
    first = np.linspace(0, len(lanes) // run - 1, runs + 2)[1:-1].round().astype(np.intp)
    return np.add.outer(run * np.unique(first), np.arange(run)).ravel()


def _memory(simulation: Simulation) -> int:
    """Return about how many bytes the process takes at most: as many as so far, and a block."""
    block = simulation.block_memory(numba.get_num_threads())
    with suppress(OSError):
        # Linux counts for getrusage what the process that began this one took.
        status = Path("/proc/self/status").read_text("utf-8")
        return block + 1024 * int(status.partition("VmHWM:")[2].split()[0])
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:  # Windows.
        return block
    return block + getrusage(RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
