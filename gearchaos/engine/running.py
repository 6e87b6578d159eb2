"""A sweep in memory: a configuration in, a result out."""

import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import numba
import numpy as np
from gearchaos_kernels.compilation import on_compilation

from gearchaos.arguments import whole_number
from gearchaos.arrays import Arrays
from gearchaos.configuration.methods import METHODS
from gearchaos.engine.choosing import with_chosen_steps, with_controllers
from gearchaos.engine.computing import Bounds, block_lanes, block_memory, blocks, rehearse
from gearchaos.engine.error_check import Tally
from gearchaos.engine.executors import LocalExecutor, compute_blocks
from gearchaos.engine.kept import variables_of
from gearchaos.engine.provenance import provenance
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.models import Given, configuration_of
from gearchaos.outputs.variable import Variable, require_listed
from gearchaos.progress import complain, say, speaking
from gearchaos.results.reading.result import Result

COMPILING = "preparing the kernel of this scene, once; this may take up to a minute"
"""Message before a kernel is compiled."""


@contextmanager
def compiling() -> Iterator[None]:
    """Report if the following code compiles a kernel, instead of loading it from the cache."""
    once = cache(lambda: say(COMPILING))
    with on_compilation(once):
        yield


def run(config: Given, threads: int | None = None, progress: bool = False) -> Result:
    """Compute a sweep in memory.

    Parameters
    ----------
    config : Configuration, mapping or path
        The configuration, its tables as nested mappings, or the path of its file.
    threads : int, optional
        Number of threads; by default all cores.
    progress : bool
        Whether to show a progress bar on stderr.

    Returns
    -------
    Result
        Named arrays with units; `Result.save` writes them to a file.

    Raises
    ------
    ConfigurationError
        If the configuration is wrong, or if there are fewer threads.

    Examples
    --------
    >>> config = gearchaos.load_config("sweeps/pan2021.toml", ["sweep.count=2"])
    >>> gearchaos.run(config)["lyapunov_exponent"].shape
    (2,)
    """
    choose_threads(threads)
    with speaking(quiet=not progress):
        run = prepare(plan_run(configuration_of(config)))
        began = time.monotonic()
        found: dict[Bounds, Arrays] = {}
        every = blocks(run, block_lanes(run, numba.get_num_threads()))
        with LocalExecutor(run) as executor:
            tally = Tally(run.lanes.repeats_after)
            compute_blocks(executor, every, found.__setitem__, tally)
        say(*tally.remarks)
        in_order = [found[block] for block in sorted(found)]
        return result_of(run, in_order, metadata(run, time.monotonic() - began))


def result_of(
    run: RunPlan,
    blocks: Sequence[Arrays],
    facts: Mapping[str, Any],
    more: Sequence[Variable] = (),
) -> Result:
    """Join blocks in the order of computation to a result with these metadata.

    ``more``: variables in the blocks besides those of the sweep. Raises ValueError if the blocks
    contain any other variable.
    """
    lanes = run.lanes
    order = np.argsort(lanes.computed_at(np.arange(len(lanes)))) if lanes.reordered else ...
    data = {name: np.concatenate([arrays[name] for arrays in blocks])[order] for name in blocks[0]}
    axes = [axis.name for axis in lanes.axes]
    variables = [*variables_of(run), *more]
    require_listed(data, [variable.name for variable in variables])
    return Result(axes, variables, data, lanes.parameters, facts)


def prepare(run: RunPlan, *, compile_now: bool = True, history_periods: int = 0) -> RunPlan:
    """Compile the kernel, choose transient and steps, print the notes, and return the run.

    Raises ConfigurationError if a block of lanes, where it is computed here, does not fit into
    memory.
    """
    check()  # Imports take long enough for an interrupt.
    if compile_now:
        plan, wanted = run.plan, block_memory(run, numba.get_num_threads())
        what = f"integration.recorded_periods = {plan.recorded_periods}, outputs.section_points = "
        what += f"{plan.section_points}: a block of lanes"
        fewer = ", take fewer steps" if METHODS[plan.method].shares_maps else ""
        remedy = f"record fewer periods, keep fewer points{fewer}"
        require_memory(run, wanted, what, remedy)
        with compiling():
            rehearse(run, history_periods)
        check()
    with compiling():
        run = with_controllers(with_chosen_steps(run))
        if compile_now and run.lanes.controllers is not None:
            rehearse(run, history_periods)
    complain(*run.warnings)
    say(*(note for note in run.notes if note not in run.warnings))
    return run


def require_memory(run: RunPlan, wanted: int, what: str, remedy: str) -> None:
    """Raise ConfigurationError if ``what`` takes more bytes than this machine has."""
    # Windows does not report its memory here.
    known = hasattr(os, "sysconf")
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if known else math.inf
    if wanted > memory:
        raise ConfigurationError(
            f"{run.config.source}: {what} takes {wanted:.3g} bytes, more than the "
            f"{memory:.3g} of this machine; {remedy}"
        )


def choose_threads(threads: int | None) -> None:
    """Use this number of threads, by default all cores; ConfigurationError if there are fewer."""
    most = numba.config.NUMBA_NUM_THREADS
    threads = None if threads is None else whole_number("threads", threads)
    if threads is not None and not 1 <= threads <= most:
        raise ConfigurationError(
            f"threads = {threads}: must be between 1 and {most}, the number of cores here "
            "(the variable NUMBA_NUM_THREADS, if set, takes its place)"
        )
    numba.set_num_threads(most if threads is None else threads)


@contextmanager
def one_thread() -> Iterator[None]:
    """Integrate few lanes in one thread; others would cost more than they save."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def metadata(run: RunPlan, seconds: float) -> Mapping[str, Any]:
    """Return the metadata of a result, which took a number of seconds."""
    config, repeats = run.config, run.lanes.repeats_after
    return {
        "title": config.title,
        "model": config.kind,
        "effects": " ".join(config.scene.effects),
        "start": config.start.kind,
        "carry": config.start.carry,
        **config.integration.tables(),
        "method_description": run.method_description,
        "steps_per_period": run.plan.steps_per_period,
        "transient_periods": run.plan.transient_periods,
        "recorded_periods": run.plan.recorded_periods,
        "excitation_period": repeats,
        **run.lanes.model.facts(config, repeats),
        "notes": "\n".join(run.notes),
        **provenance(seconds),
        "configuration": config.text,
        "configuration_resolved": config.resolved_toml(),
    }
