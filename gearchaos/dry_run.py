"""What ``--dry-run`` tells: what a sweep would compute, and how long that would take."""

from __future__ import annotations

import math
import os
import sys
from datetime import timedelta

import numpy as np
from gearchaos_kernels import current_threads
from tqdm import tqdm

from gearchaos.engine.running import pilot_seconds
from gearchaos.engine.simulation import Simulation
from gearchaos.results.variables import START


def describe(simulation: Simulation, output: str) -> None:
    """Say what a run would compute and how long it would take, judged by a few real lanes."""
    seconds = pilot_seconds(simulation)
    duration = f"{seconds:.1f} s" if seconds < 100 else str(timedelta(seconds=round(seconds)))
    config = simulation.config
    lanes, threads = simulation.lanes, current_threads()
    sizes = {v.name: len(v.values) for v in simulation.variables if v.values is not None}
    bytes_kept = sum(
        np.dtype(v.dtype).itemsize * math.prod(sizes[dim] for dim in v.dims)
        for v in simulation.variables
        if v.values is None
    )
    spans = [
        f"{axis.values.size} values of {axis.name} from {axis.values[0]:g} to {axis.values[-1]:g}"
        for axis in lanes.axes
        if axis.name != START
    ]
    if lanes.starts > 1:
        spans.append(f"{lanes.starts} starts each")
    memory, steps = simulation.block_memory(threads), simulation.plan.steps_per_period
    for key, value in {
        "output": f"{output}{' (exists)' if os.path.exists(output) else ''}",
        "effects": ", ".join(config.scene.effects) or "none",
        "states": f"{len(lanes.states)}{_left_out(simulation)}",
        "lanes": f"{len(lanes)} ({', '.join(spans)})",
        "steps": f"{simulation.periods * steps:.3g} ({steps} per period)",
        "file": f"about {tqdm.format_sizeof(bytes_kept, 'B')} before compression",
        "memory": f"about {tqdm.format_sizeof(memory, 'B')} for a block of lanes",
        "time": f"about {duration} with {threads} thread{'s' if threads > 1 else ''}",
    }.items():
        sys.stderr.write(f"{key + ':':10}{value}\n")


def _left_out(simulation: Simulation) -> str:
    unused = [
        name for name in simulation.config.scene.effects if name not in simulation.lanes.effects
    ]
    return f" (nothing that is kept needs {', '.join(unused)})" if unused else ""
