"""Output of ``sweep --dry-run``: the lanes of a sweep, and the time and memory it would take."""

import json
import math
import os
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
from gearchaos_kernels import LANES
from tqdm import tqdm

from gearchaos.arrays import Integers
from gearchaos.dynamics.stability import fewest_stable_steps
from gearchaos.engine.computing import block_lanes, block_memory, integrate_places
from gearchaos.engine.kept import arrays_of, variables_of
from gearchaos.engine.resonances import resonances
from gearchaos.engine.run_plan import RunPlan
from gearchaos.engine.store_filling import Shard
from gearchaos.outputs.names import DIRECTION, START
from gearchaos.progress import count_of, notice
from gearchaos.results.files.block_store import PIECE_BYTES, lanes_and_record
from gearchaos.results.files.result_file import CACHE_BYTES

SAMPLE_STEPS = 500
"""Steps per period of a sample, if they are stable; most sweeps take fewer."""

SAMPLE_PERIODS = 1000
"""Mesh periods of a sample; with far fewer, labelling would take too large a share of the time."""


class Estimate(NamedTuple):
    """Size, time and memory of a run, or of one shard of it.

    ``lanes`` is their number, ``every`` that of the whole sweep. ``steps`` counts those of all
    lanes. ``file_bytes`` is the size before compression, ``memory_bytes`` the peak of the process.
    """

    lanes: int
    every: int
    steps: int
    seconds: float
    threads: int
    file_bytes: int
    memory_bytes: int


def describe(
    run: RunPlan, output: str, shard: Shard | None, as_json: bool, others: Sequence[RunPlan] = ()
) -> None:
    """Print what a run, or one shard of it, would compute, and an estimate of time and memory.

    ``others``: the same run with other methods, whose time is printed for comparison.
    """
    estimate, resonant = _estimated(run, shard), resonances(run.lanes)
    seconds = {run.plan.method: estimate.seconds}
    seconds |= {one.plan.method: _estimated(one, shard).seconds for one in others}
    if as_json:
        facts = {
            "output": output,
            "exists": os.path.exists(output),
            "states": len(run.lanes.states),
            "lanes": estimate.lanes,
            "steps": estimate.steps,
            "seconds": estimate.seconds,
            "method": run.plan.method,
            "method_description": run.method_description,
            "seconds_of_methods": seconds,
            "threads": estimate.threads,
            "file_bytes": estimate.file_bytes,
            "memory_bytes": estimate.memory_bytes,
            **resonant.facts,
            "steps_per_period": run.plan.steps_per_period,
        }
        print(json.dumps(facts, indent=1))
        return
    first = {"output": f"{output}{' (exists)' if os.path.exists(output) else ''}"}
    compared = {
        "compared": ", ".join(f"{name} about {_duration(time)}" for name, time in seconds.items())
    }
    words = _words(run, estimate) | (compared if others else {})
    for key, value in {**first, **resonant.texts, **words}.items():
        sys.stderr.write(f"{key + ':':12}{value}\n")


def _estimated(run: RunPlan, shard: Shard | None) -> Estimate:
    """Estimate what a run, or one shard of it, takes, from a sample of its lanes."""
    plan, (every, record) = run.plan, lanes_and_record(variables_of(run))
    own = every if shard is None else sum(last - first for first, last in shard.blocks(every))
    seconds = own * _seconds_per_lane(run)
    file_bytes, kept = own * record.itemsize, [record[name] for name in record.names or ()]
    memory = _memory(run) + sum(min(CACHE_BYTES, every * one.itemsize) for one in kept)
    memory += min(PIECE_BYTES, file_bytes) if run.lanes.reordered else 0
    # An allowance: the memory of HDF5 and the allocator during writing is not known beforehand.
    memory += memory // 20
    steps = own * (plan.transient_periods + plan.recorded_periods) * plan.steps_per_period
    threads = numba.get_num_threads()
    return Estimate(own, every, steps, seconds, threads, file_bytes, memory)


def _words(run: RunPlan, estimate: Estimate) -> dict[str, str]:
    """Return the lines about effects, states, lanes and the estimate, each with its heading."""
    config, lanes = run.config, run.lanes
    spans = [
        f"{count_of(axis.values.size, 'value')} of {axis.name} from {axis.values[0]:g} to "
        f"{axis.values[-1]:g}"
        for axis in lanes.axes
        if axis.name not in (START, DIRECTION)
    ]
    if lanes.starts > 1:
        spans.append(f"{lanes.starts} starts each")
    if lanes.directions > 1:
        spans.append("in both directions")
    unused = ", ".join(name for name in config.scene.effects if name not in lanes.effects)
    unused = f" (no requested output needs {unused})" if unused else ""
    of_all = "" if estimate.lanes == estimate.every else f" of {estimate.every}"
    threads = count_of(estimate.threads, "thread")
    controllers = lanes.controllers
    controlled = {"control": controllers.described()} if controllers else {}
    return {
        "effects": ", ".join(config.scene.effects) or "none",
        "states": f"{len(lanes.states)}{unused}",
        "lanes": f"{estimate.lanes}{of_all} ({', '.join(spans)})",
        **controlled,
        "method": run.method_description,
        "steps": f"{estimate.steps:.3g} ({run.plan.steps_per_period} per period)",
        "file": f"about {tqdm.format_sizeof(estimate.file_bytes, 'B')} before compression",
        "memory": f"about {tqdm.format_sizeof(estimate.memory_bytes, 'B')} at the peak of the "
        "process",
        "time": f"about {_duration(estimate.seconds)} with {threads}",
    }


def _duration(seconds: float) -> str:
    """Return a duration in words."""
    return f"{seconds:.1f} s" if seconds < 100 else str(timedelta(seconds=round(seconds)))


def _seconds_per_lane(run: RunPlan) -> float:
    """Measure the time of a block of lanes from all over the sweep, and scale it to all periods.

    It is a whole block, because lanes that are checked or extended are computed in vectors too.
    """
    plan = run.plan
    block = block_lanes(run, numba.get_num_threads())
    places = some_places(run, block // 8 if run.carried else block)
    steps = _sampled_steps(run, places)
    finer = plan.steps_per_period / steps
    periods, whole = plan.transient_periods + plan.recorded_periods, run.lanes.repeats_after
    with notice("computing some lanes to estimate the time"):
        # The first, short round loads the kernels. It takes one step more per period, so that the
        # second round has to make its own maps, whose time does not grow with the periods.
        for more, length in (1, min(1.0, 8.0 / periods)), (0, min(1.0, SAMPLE_PERIODS / periods)):
            transient, recorded = (
                whole * math.ceil(length * every / whole)
                for every in (plan.transient_periods, plan.recorded_periods)
            )
            shorter = plan._replace(
                steps_per_period=steps + more,
                # The share of maps that are kept is that of the whole run.
                map_bytes=int(plan.map_bytes / finer),
                transient_periods=transient,
                recorded_periods=recorded,
                section_points=min(plan.section_points, recorded),
            )
            sample = replace(run, plan=shorter)
            began = time.perf_counter()
            nothing = shorter._replace(transient_periods=0, recorded_periods=0, section_points=0)
            integrate_places(sample, places, nothing)
            made = time.perf_counter()
            found = integrate_places(sample, places, sample.recording)
            arrays_of(sample, sample.lanes.computed_at(places), *found)
            scale = periods / (transient + recorded)
            seconds = (made - began + scale * (time.perf_counter() - made)) / places.size
    return finer * seconds


def _sampled_steps(run: RunPlan, places: Integers) -> int:
    """Return the steps per period of a sample; the time is proportional to them.

    They are few, so that a sample takes seconds, but enough to be stable and for no map to be
    divided.
    """
    steps = run.plan.steps_per_period
    if steps <= SAMPLE_STEPS:
        return steps
    system = run.lanes.system_of(run.lanes.computed_at(places))
    needed = int(fewest_stable_steps(system).max()) + 2 * system.harmonics()
    return min(steps, max(SAMPLE_STEPS, needed))


def some_places(run: RunPlan, count: int) -> Integers:
    """Return about ``count`` places in the order of computation, from all over the sweep.

    They are in runs of neighbours, which behave alike and so are fast in one vector. In a carried
    sweep, where a lane starts from another, all are from the middle.
    """
    lanes = run.lanes
    length = min(len(lanes), count if run.carried else LANES)
    runs = -(-min(count, len(lanes)) // length)
    first = np.linspace(0, len(lanes) // length - 1, runs + 2)[1:-1].round().astype(np.intp)
    return np.add.outer(length * np.unique(first), np.arange(length)).ravel()


def _memory(run: RunPlan) -> int:
    """Return about how many bytes the process takes at most: its peak so far, and one block."""
    block = block_memory(run, numba.get_num_threads())
    with suppress(OSError):
        # On Linux, getrusage includes the peak of the parent process.
        status = Path("/proc/self/status").read_text("utf-8")
        return block + 1024 * int(status.partition("VmHWM:")[2].split()[0])
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:  # Windows.
        return block
    return block + getrusage(RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
