"""Computation of blocks by the workers of a dask.distributed cluster."""

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
from gearchaos.engine.choosing import with_controllers
from gearchaos.engine.computing import Bounds, EndStates, compute_block
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.engine.run_plan import Chosen, RunPlan, plan_run
from gearchaos.errors import ConfigurationError, ExecutionError
from gearchaos.interrupts import check
from gearchaos.models import Configuration
from gearchaos.progress import count_of, notice, say
from gearchaos.version import Software, software_version

BLOCKS_PER_WORKER = 2
"""One block in computation and one in the queue, so that a worker never waits."""
_HOURS_WITHOUT_WORKERS = 24.0  # Jobs of workers may be queued for hours.
_SECONDS_TO_IMPORT = 300.0
_SECONDS_BETWEEN_LOOKS = 0.2
_WORKERS_PER_CORE = 8  # Each is a process of 200 MB; the limit stops typing errors.

# Ctrl-C in a terminal also reaches the workers: they ignore it and finish their blocks.
_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


class DaskExecutor(ExitStack):
    """Submits blocks to the workers of a cluster; blocks of a lost worker are computed again.

    Parameters
    ----------
    run : RunPlan
        A run that is not carried, with chosen steps.
    address : str
        Address of a scheduler, such as ``tcp://node7:8786``, or ``local:N`` for N local processes.

    Raises
    ------
    ConfigurationError
        If N is not a number of workers.
    ExecutionError
        If no scheduler answers.
    """

    def __init__(self, run: RunPlan, address: str) -> None:
        super().__init__()
        self._address = address
        self._recipe = run.config.resolved_toml(), run.chosen
        for name in ("distributed", "distributed.client"):
            # Errors arrive as exceptions; no log is needed.
            logging.getLogger(name).setLevel(logging.CRITICAL)
        with ExitStack() as stack:
            self._client: Any = stack.enter_context(_connected(stack, address))
            workers = self.count_workers()
            self._require_software()
            self._executor = self._client.get_executor(pure=False)
            self.callback(stack.pop_all().close)
        say(f"{count_of(workers, 'dask worker')} at {address}")

    def count_workers(self) -> int:
        """Return the number of workers of the cluster; wait if there is none."""
        client, hours = self._client, _HOURS_WITHOUT_WORKERS
        try:
            while not (workers := len(_answer(client.nthreads, _patience()))):
                say(f"{self._address}: waits up to {hours:g} h for a worker to join")
                _answer(lambda: client.wait_for_workers(1), 3600.0 * hours)
        except KeyboardInterrupt:
            # There is no worker that could finish the submitted blocks.
            self.close()
            raise
        except OSError as error:
            raise self._worded(error) from None
        return workers

    def count_blocks(self) -> int:
        """Return the number of blocks to submit at a time."""
        return BLOCKS_PER_WORKER * self.count_workers()

    def submit(self, block: Bounds) -> Future[Arrays]:
        """Submit a block to the cluster and return the future of its arrays."""
        future: Future[Arrays] = Future()
        # Only the workers know which blocks run: all submitted blocks are finished.
        future.set_running_or_notify_cancel()
        inner = self._executor.submit(compute_on_worker, SOFTWARE, *self._recipe, block)
        inner.add_done_callback(lambda done: _settle(future, done.result, self._worded))
        return future

    def _require_software(self) -> None:
        """Raise ExecutionError if a worker cannot import this package."""
        # Without the package a worker cannot receive blocks; its version is checked per block.
        try:
            with notice(f"{self._address}: waits up to {_SECONDS_TO_IMPORT:g} s for the workers"):
                _answer(lambda: self._client.run(find_spec, __name__), _SECONDS_TO_IMPORT)
        except (ImportError, OSError) as error:
            raise self._worded(error) from None

    def _worded(self, error: BaseException) -> BaseException:
        """Return an error of the cluster as an ExecutionError, other errors as they are."""
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


def compute_on_worker(
    software: Software, configuration: str, chosen: Chosen, block: Bounds
) -> dict[str, Any]:
    """Compute a block on a worker; ExecutionError if its software is not that of the client.

    ``configuration``: the resolved TOML text; ``chosen``: steps and transient, which the client has
    chosen once for all workers.
    """
    if software != SOFTWARE:
        raise ExecutionError(
            f"the worker {distributed.get_worker().address} has {SOFTWARE}, this process "
            f"{software}: install the same on both"
        )
    # A worker with n task threads has n cores, which compute one block at a time.
    with _ONE_AT_A_TIME:
        tasks, most = distributed.get_worker().state.nthreads, numba.config.NUMBA_NUM_THREADS
        numba.set_num_threads(min(tasks, most) if tasks > 1 else most)
        run = _run_plan(configuration, chosen)
        return compute_block(run, block, EndStates(run).before(0))


_ONE_AT_A_TIME = Lock()


@lru_cache(maxsize=1)
def _run_plan(configuration: str, chosen: Chosen) -> RunPlan:
    """Return the run of a configuration, kept for the next block."""
    run = plan_run(Configuration.from_toml(configuration, "<client>")).with_choice(chosen)
    return with_controllers(run)


def _patience() -> float:
    """Return the number of seconds for which a scheduler may be silent."""
    return float(parse_timedelta(dask.config.get("distributed.comm.timeouts.connect")))


def _settle(future: Future[Any], question: Callable[[], Any], worded: Callable[..., Any]) -> None:
    """Set the result of a future, or the error of the question, in words."""
    try:
        future.set_result(question())
    except BaseException as error:
        future.set_exception(worded(error))


def _answer(question: Callable[[], Any], seconds: float) -> Any:
    """Call a function in a thread and check for interrupts; TimeoutError if it takes longer."""
    future: Future[Any] = Future()
    Thread(target=_settle, args=(future, question, lambda error: error), daemon=True).start()
    began = time.monotonic()
    while not wait([future], _SECONDS_BETWEEN_LOOKS).done:
        check()
        # One second later, so that a timeout message of dask itself comes first.
        if time.monotonic() - began > seconds + 1.0:
            raise TimeoutError(f"silent for {seconds:g} s")
    return future.result()


def _connected(stack: ExitStack, address: str) -> Any:
    """Return a client of the scheduler at an address, or of a new local cluster."""
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
        # The transport of the address may raise any other exception.
        except Exception as error:
            raise ExecutionError(
                f"{address}: no dask scheduler answers ({error}); start one with `dask scheduler` "
                "or give its address"
            ) from None
    cores = numba.config.NUMBA_NUM_THREADS
    most = _WORKERS_PER_CORE * cores
    # With more digits, int() may raise another error.
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
    """Start local workers; ExecutionError if a worker ends before it has joined."""

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
