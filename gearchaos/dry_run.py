"""What ``--dry-run`` tells: what a sweep would compute, and how much time and memory that takes."""

import json
import math
import os
import sys
import time
from contextlib import suppress
from datetime import timedelta
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import LANES
from tqdm import tqdm

from gearchaos.configuration import Configuration, swept_values
from gearchaos.engine.simulation import Simulation
from gearchaos.engine.store_filling import Shard
from gearchaos.gear.derivation import FREQUENCY, LENGTH
from gearchaos.progress import notice
from gearchaos.results.block_store import PIECE_BYTES, lanes_and_record
from gearchaos.results.result_file import CACHE_BYTES
from gearchaos.results.variables import DIRECTION, START

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
    plan = simulation.plan
    steps = own * (plan.transient_periods + plan.recorded_periods) * plan.steps_per_period
    if as_json:
        facts = {"output": output, "exists": os.path.exists(output), "states": len(lanes.states)}
        facts |= {"lanes": own, "steps": steps, "seconds": seconds, "threads": threads}
        facts |= {"file_bytes": bytes_kept, "memory_bytes": memory}
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
    pair, groups = {}, lanes.parameters
    if config.pair is not None and {FREQUENCY, LENGTH} <= {*groups}:
        length, load = (np.mean(groups[name].value) for name in (LENGTH, "load"))
        hertz = np.mean(groups[FREQUENCY].value) / (2.0 * math.pi)
        text = f"{hertz:.4g} Hz, that of the mesh at {60.0 * hertz / config.pair.teeth[0]:.0f} rpm"
        pair = {"pair": f"natural frequency {text}; static deflection {load * length:.4g} um"}
    for key, value in {
        "output": f"{output}{' (exists)' if os.path.exists(output) else ''}",
        **pair,
        "effects": ", ".join(config.scene.effects) or "none",
        "states": f"{len(lanes.states)}{unused}",
        "lanes": f"{own}{'' if shard is None else f' of {every}'} ({', '.join(spans)})",
        "steps": f"{steps:.3g} ({plan.steps_per_period} per period)",
        "file": f"about {tqdm.format_sizeof(bytes_kept, 'B')} before compression",
        "memory": f"about {tqdm.format_sizeof(memory, 'B')} at the peak of the process",
        "time": f"about {duration} with {threads} thread{'s' if threads > 1 else ''}",
    }.items():
        sys.stderr.write(f"{key + ':':10}{value}\n")


def _seconds_per_lane(simulation: Simulation) -> float:
    """Compute a block of lanes from all over the sweep, as long as it takes to label them.

    A whole block: what is checked, or looked at again, is computed in vectors of lanes.
    """
    wanted = simulation.block_lanes(numba.get_num_threads()) / (8 if simulation.carried else 1)
    periods = simulation.plan.transient_periods + simulation.plan.recorded_periods
    with notice("computing some lanes, to tell how long all take"):
        # The first time, little is computed, and the kernels are loaded. It takes a step more, so
        # that flow maps are still to be made the second time: once, for however many periods.
        for more, length in (1, min(1.0, 8.0 / periods)), (0, min(1.0, SAMPLE_PERIODS / periods)):
            sample = Simulation(_thinned(simulation, wanted / len(simulation.lanes), length))
            plan, lanes = sample.plan, len(sample.lanes)
            steps, orders = plan.steps_per_period + more, simulation.plan.orders
            sample.plan = plan._replace(steps_per_period=steps, orders=orders)
            began = time.perf_counter()
            none = sample.plan._replace(transient_periods=0, recorded_periods=0)
            sample.integrate(0, lanes, none)
            made = time.perf_counter()
            sample.compute(0, lanes)
            scale = periods / (plan.transient_periods + plan.recorded_periods)
            seconds = (made - began + scale * (time.perf_counter() - made)) / lanes
    return seconds


def _thinned(simulation: Simulation, share: float, length: float) -> Configuration:
    """Return a sweep with this share of the lanes, and of the mesh periods."""
    config, plan, tables = simulation.config, simulation.plan, simulation.config.tables()
    lanes, carried = simulation.lanes, simulation.carried
    pairs = lanes.repeats // (lanes.starts * lanes.directions)
    # Of every axis that is one the same, but lines that are carried side by side remain so.
    axes = 1 if carried else sum(n > 1 for n in lanes.shape)
    share = min(1.0, share) ** (1.0 / max(1, axes))
    others = 1.0 if carried else share
    for table, sweep in config.sweeps.items():
        values, part = swept_values(sweep), share if table == "sweep" else others
        # Neighbours behave alike, which a vector of lanes profits from.
        beside = lanes.side_by_side if carried else lanes.repeats
        run = min(values.size, -(-LANES // beside)) if table == "sweep" else 1
        runs = math.ceil(part * values.size / run)
        first = np.linspace(0, values.size - run, runs + 2)[1:-1].round().astype(int)
        some = values[np.unique(np.add.outer(first, np.arange(run)))].tolist()
        tables[table] = {"parameter": sweep.parameter, "values": some}
    if pairs > 1:
        tables["pitch_error"]["realisations"] = math.ceil(others * pairs)
    tables["start"]["count"] = math.ceil((others * lanes.starts) ** (1.0 / config.start.counted))
    tables["integration"] |= {
        "steps_per_period": plan.steps_per_period,
        "transient_periods": math.ceil(length * plan.transient_periods),
        "recorded_periods": (recorded := math.ceil(length * plan.recorded_periods)),
    }
    tables["integration"].pop("tolerance", None)
    tables["outputs"]["section_points"] = min(config.outputs.section_points, recorded)
    # So short a record need not have whole cycles of them.
    tables["outputs"]["orders"] = ()
    return Configuration.from_tables(tables, config.source)


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
