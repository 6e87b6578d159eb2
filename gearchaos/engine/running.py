"""Run a sweep from Python: a configuration in, a result out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from gearchaos_kernels import current_threads, most_threads, use_threads

from gearchaos.configuration import Configuration
from gearchaos.engine.error_check import Tally
from gearchaos.engine.provenance import provenance
from gearchaos.engine.simulation import Simulation, compute_all
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.progress import Progress, notice, say, speaking
from gearchaos.results.result import Result

PILOT_SECONDS = 0.2
COMPILING = "preparing the kernel of this scene; the first time this takes some seconds"


def run(config: Configuration, threads: int | None = None, progress: bool = False) -> Result:
    """Compute a sweep in memory.

    Parameters
    ----------
    config : Configuration
        From `load_config`.
    threads : int, optional
        Threads to use; by default all that there are.
    progress : bool
        Whether to show a progress bar on stderr.

    Returns
    -------
    Result
        Named arrays with units; `Result.save` writes them to a file.

    Raises
    ------
    ConfigurationError
        If there are not so many threads.
    """
    choose_threads(threads)
    with speaking(quiet=not progress):
        return _run(Simulation(config))


def _run(simulation: Simulation) -> Result:
    prepare(simulation)
    began = time.monotonic()
    size = simulation.block_lanes(current_threads())
    edges = range(0, simulation.lanes, size)
    bounds = simulation.in_order((first, min(first + size, simulation.lanes)) for first in edges)
    parts = {}
    tally = Tally()
    with Progress(simulation.lanes) as bar:
        for (first, last), arrays in compute_all(simulation, bounds):
            parts[first] = arrays
            tally.add(arrays)
            bar.advance(last - first)
    if tally.errors:
        say(tally.errors)
    in_order = [parts[first] for first in sorted(parts)]
    data = {name: np.concatenate([part[name] for part in in_order]) for name in in_order[0]}
    return Result(
        simulation.axis,
        simulation.variables,
        data,
        simulation.parameters,
        metadata(simulation, time.monotonic() - began),
    )


def prepare(simulation: Simulation, compile_now: bool = True) -> None:
    """Compile the kernel, choose the steps where a tolerance is wanted, and say what was found."""
    if compile_now:
        with notice(COMPILING):
            simulation.compile()
    check()
    simulation.choose_steps()
    say(*simulation.notes)


def pilot_rate(simulation: Simulation) -> float:
    """Measure how many Runge-Kutta steps a second this sweep makes here.

    Parameters
    ----------
    simulation : Simulation
        Compiled; a few mesh periods of its first block are integrated.
    """
    lanes = min(simulation.lanes, simulation.block_lanes(current_threads()))
    if simulation.carried:  # One value after the other.
        lanes = simulation.starts
    periods = 1
    while True:
        began = time.perf_counter()
        steps = simulation.rehearse(lanes, periods)
        seconds = time.perf_counter() - began
        if seconds > PILOT_SECONDS:
            return steps / seconds
        periods *= 2


def choose_threads(threads: int | None) -> None:
    """Use so many threads from now on; all that there are by default.

    Raises
    ------
    ConfigurationError
        If there are not so many.
    """
    most = most_threads()
    if threads is not None and not 1 <= threads <= most:
        raise ConfigurationError(
            f"threads = {threads}: must be between 1 and {most}, the number of cores here "
            "(the variable NUMBA_NUM_THREADS, if set, takes its place)"
        )
    use_threads(most if threads is None else threads)


def metadata(simulation: Simulation, seconds: float) -> Mapping[str, Any]:
    """Return what a result says about itself beside its arrays.

    Parameters
    ----------
    simulation : Simulation
    seconds : float
        Wall time of the computation in s.
    """
    config = simulation.config
    return {
        "axis": simulation.axis,
        "title": config.title,
        "formulation": config.formulation,
        "effects": " ".join(config.scene.effects),
        "start": config.start.kind,
        "carry": config.start.carry,
        "method": "classical Runge-Kutta of order 4 with fixed steps",
        **config.integration.model_dump(exclude_none=True),
        "steps_per_period": simulation.plan.steps_per_period,
        **provenance(current_threads(), seconds),
        "configuration": config.text,
        "configuration_resolved": config.resolved_toml(),
    }
