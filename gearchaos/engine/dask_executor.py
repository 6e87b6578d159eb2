"""Blocks of lanes computed by the workers of a dask.distributed cluster."""

import logging
import re
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, wait
from contextlib import ExitStack
from functools import lru_cache
from importlib.util import find_spec
from threading import Lock, Thread
from typing import Any

import dask
import distributed
import numba
from dask.utils import parse_timedelta

from gearchaos.arrays import Arrays
from gearchaos.engine.computing import Bounds, EndStates, compute
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.engine.run_plan import Chosen, RunPlan, plan_run
from gearchaos.errors import ConfigurationError, ExecutionError
from gearchaos.interrupts import check
from gearchaos.models import Configuration
from gearchaos.progress import notice, say
from gearchaos.version import Software, software_version

BLOCKS_PER_WORKER = 2  # One that is computed, and one that waits, so that a worker need not wait.
_HOURS_WITHOUT_WORKERS = 24.0  # Their jobs may stand in a queue.
_SECONDS_TO_IMPORT = 300.0
_SECONDS_BETWEEN_LOOKS = 0.2
_WORKERS_PER_CORE = (
    8  # Each is a process of some 200 MB: with many more, a typing error fills memory.
)

# Ctrl-C in a terminal reaches the workers too: they finish the blocks that they have.
_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


class DaskExecutor(ExitStack):
    """Hands blocks to the workers of a cluster; blocks of a lost worker are run again.

    The run is not carried and its number of steps has been chosen; the address is that of a
    scheduler, such as ``tcp://node7:8786``, or ``local:N`` for N processes here. Raises
    ConfigurationError if N is no number of workers, ExecutionError if no scheduler answers.
    """

    def __init__(self, run: RunPlan, address: str) -> None:
        super().__init__()
        self._address = address
        self._recipe = run.config.resolved_toml(), run.chosen
        for name in ("distributed", "distributed.client"):
            # What goes wrong comes as an exception.
            logging.getLogger(name).setLevel(logging.CRITICAL)
        with ExitStack() as stack:
            self._client: Any = stack.enter_context(_connected(stack, address))
            workers = self.count_workers()
            self._require_software()
            self._executor = self._client.get_executor(pure=False)
            self.callback(stack.pop_all().close)
        say(f"{workers} dask worker{'s' if workers > 1 else ''} at {address}")

    def count_workers(self) -> int:
        """Ask the cluster how many workers there are; wait for one where none is left."""
        client, hours = self._client, _HOURS_WITHOUT_WORKERS
        try:
            while not (workers := len(_answer(client.nthreads, _patience()))):
                say(f"{self._address}: waits up to {hours:g} h for a worker to join")
                _answer(lambda: client.wait_for_workers(1), 3600.0 * hours)
        except KeyboardInterrupt:
            # Nobody computes what has been handed out.
            self.close()
            raise
        except OSError as error:
            raise self._worded(error) from None
        return workers

    def count_blocks(self) -> int:
        """Ask the cluster how many blocks to hand out at a time."""
        return BLOCKS_PER_WORKER * self.count_workers()

    def submit(self, block: Bounds) -> Future[Arrays]:
        """Hand a block to the cluster and return the future of its arrays."""
        future: Future[Arrays] = Future()
        # Which of them runs is known to the workers only: all that are handed out are finished.
        future.set_running_or_notify_cancel()
        inner = self._executor.submit(compute_block, SOFTWARE, *self._recipe, block)
        inner.add_done_callback(lambda done: _settle(future, done.result, self._worded))
        return future

    def _require_software(self) -> None:
        # Blocks cannot even be sent to a worker without it; versions are compared with the blocks.
        try:
            with notice(f"{self._address}: waits up to {_SECONDS_TO_IMPORT:g} s for the workers"):
                _answer(lambda: self._client.run(find_spec, __name__), _SECONDS_TO_IMPORT)
        except (ImportError, OSError) as error:
            raise self._worded(error) from None

    def _worded(self, error: BaseException) -> BaseException:
        match error:
            case TimeoutError():
                text = f"{error}; are scheduler and workers alive?"
            case CancelledError() | OSError():
                text = "the connection to the scheduler was lost"
            case distributed.KilledWorker():
                text = f"one block was lost with {error.allowed_failures + 1} workers in turn; see "
                text += "their logs, and give them more memory if it is that"
            case ImportError():
                text = f"a worker lacks the software ({error}); install there what is here, "
                text += f"gearchaos {software_version()}"
            case _:
                return error
        return ExecutionError(f"{self._address}: {text}")


def compute_block(
    software: Software, configuration: str, chosen: Chosen, block: Bounds
) -> dict[str, Any]:
    """Compute a block on a worker; ExecutionError if its software is not that of the client.

    ``configuration`` is the resolved one in TOML; steps and transient are chosen once, not on every
    worker.
    """
    if software != SOFTWARE:
        raise ExecutionError(
            f"the worker {distributed.get_worker().address} has {SOFTWARE}, this process "
            f"{software}: install the same on both"
        )
    # A worker of several task threads is one of as many cores: its blocks take turns.
    with _ONE_AT_A_TIME:
        tasks, most = distributed.get_worker().state.nthreads, numba.config.NUMBA_NUM_THREADS
        numba.set_num_threads(min(tasks, most) if tasks > 1 else most)
        run = _run_plan(configuration, chosen)
        return compute(run, block, EndStates(run).before(0))


_ONE_AT_A_TIME = Lock()


@lru_cache(maxsize=1)
def _run_plan(configuration: str, chosen: Chosen) -> RunPlan:
    return plan_run(Configuration.from_toml(configuration, "<client>")).with_choice(chosen)


def _patience() -> float:
    """Return for how many seconds a scheduler may be silent."""
    return float(parse_timedelta(dask.config.get("distributed.comm.timeouts.connect")))


def _settle(future: Future[Any], question: Callable[[], Any], worded: Callable[..., Any]) -> None:
    """Give a future the answer to a question, or the error that comes instead, worded."""
    try:
        future.set_result(question())
    except BaseException as error:
        future.set_exception(worded(error))


def _answer(question: Callable[[], Any], seconds: float) -> Any:
    """Ask in a thread, and heed interrupts meanwhile."""
    future: Future[Any] = Future()
    Thread(target=_settle, args=(future, question, lambda error: error), daemon=True).start()
    began = time.monotonic()
    while not wait([future], _SECONDS_BETWEEN_LOOKS).done:
        check()
        # What dask has to say itself once the time is up goes before this.
        if time.monotonic() - began > seconds + 1.0:
            raise TimeoutError(f"silent for {seconds:g} s")
    return future.result()


def _connected(stack: ExitStack, address: str) -> Any:
    local = re.fullmatch(r"local:(.*)", address)
    if local is None:
        try:
            with notice(f"{address}: waits up to {_patience():g} s for an answer"):
                return _answer(lambda: distributed.Client(address), _patience())
        except (ValueError, TypeError) as error:
            raise ConfigurationError(
                f"--dask {address}: cannot be the address of a scheduler here ({error}); give one "
                "such as tcp://node7:8786"
            ) from None
        # What else is raised is up to the transport that the address names.
        except Exception as error:
            raise ExecutionError(
                f"{address}: no dask scheduler answers ({error}); start one with `dask scheduler` "
                "or give its address"
            ) from None
    cores = numba.config.NUMBA_NUM_THREADS
    most = _WORKERS_PER_CORE * cores
    # Of more digits, int() may raise an error of its own.
    known = re.fullmatch(r"0*(\d{1,9})", local[1], re.ASCII)
    workers = int(known[1]) if known else 0
    if not 1 <= workers <= most:
        raise ConfigurationError(
            f"--dask {address}: must be local:N with N from 1 to {most} workers, or the address of "
            "a scheduler"
        )
    if workers > cores:
        only = "the only core" if cores == 1 else f"the {cores} cores"
        say(f"{address}: the workers share {only} here; local:{cores} is as fast")
    stack.enter_context(cluster := _local_cluster(address, workers))
    return distributed.Client(cluster)


def _local_cluster(address: str, workers: int) -> Any:
    """Start workers here; ExecutionError if one of them dies before it has joined."""

    def started() -> Any:
        return distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            memory_limit=0,
            silence_logs=logging.CRITICAL,
            env={"NUMBA_NUM_THREADS": str(max(1, numba.get_num_threads() // workers))},
            preload=[_IGNORE_INTERRUPTS],
        )

    try:
        with notice(f"{address}: waits up to {_SECONDS_TO_IMPORT:g} s for the workers to start"):
            return _answer(started, _SECONDS_TO_IMPORT)
    except Exception as error:
        raise ExecutionError(
            f"{address}: a worker has ended before it could join ({error}); look for a lack of "
            "memory or processes, or leave --dask out"
        ) from error
