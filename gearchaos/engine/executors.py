"""Executors of blocks of lanes: ``submit(block)`` returns a future, and one loop waits for it.

A `BlockExecutor` is used like those of `concurrent.futures`: leaving its context ends its work. Its
``count_blocks`` returns the number of blocks to submit at a time, so that no worker waits for the
next block. The loop does not depend on whether blocks are computed in this process or on a cluster.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, TypeAlias

import numba

from gearchaos.arrays import Arrays
from gearchaos.engine.computing import Bounds, EndStates, compute_block
from gearchaos.engine.error_check import Tally
from gearchaos.engine.run_plan import RunPlan
from gearchaos.errors import GearchaosError
from gearchaos.interrupts import check
from gearchaos.progress import progress

if TYPE_CHECKING:
    from gearchaos.engine.dask_executor import DaskExecutor

BlockExecutor: TypeAlias = "LocalExecutor | DaskExecutor"

SECONDS_BETWEEN_LOOKS = 1.0
"""Interval of checks whether there are workers, while no block ends."""


class LocalExecutor(ExitStack):
    """Computes blocks in this process, one at a time: all threads share one block.

    ``ends``: end states of a carried sweep; those of computed lanes are stored there. A separate
    thread computes, so that the main thread can write finished blocks. An interrupt, which the main
    thread receives, does not lose the running block.
    """

    def __init__(self, run: RunPlan, ends: EndStates | None = None) -> None:
        super().__init__()
        self._run, self._ends = run, ends or EndStates(run)
        threads = (numba.get_num_threads(),)
        self._pool = ThreadPoolExecutor(1, initializer=numba.set_num_threads, initargs=threads)
        self.callback(self._pool.shutdown, cancel_futures=True)

    def submit(self, block: Bounds) -> Future[Arrays]:
        """Queue a block and return the future of its arrays.

        The future can be cancelled until the block runs.
        """
        return self._pool.submit(self._compute, block)

    def count_blocks(self) -> int:
        """Return the number of blocks to submit at a time: one running, one queued."""
        return 2

    def _compute(self, block: Bounds) -> Arrays:
        """Compute a block and store its end states."""
        arrays = compute_block(self._run, block, self._ends.before(block[0]))
        self._ends.keep(block[0], arrays["end_state"])
        return arrays


def compute_blocks(
    executor: BlockExecutor,
    blocks: Sequence[Bounds],
    keep: Callable[[Bounds, Arrays], None],
    tally: Tally | None = None,
    done: int = 0,
) -> Tally:
    """Compute blocks in this order and keep each block as soon as it is finished.

    ``keep(block, arrays)`` is called in this thread. ``tally`` and ``done``: counts, and number of
    lanes, of blocks that are finished already. Returns the counts of all blocks. After an
    interrupt, running blocks are finished and kept.
    """
    tally, waiting = tally or Tally(), list(reversed(blocks))
    lanes = done + sum(last - first for first, last in blocks)
    futures: dict[Future[Arrays], Bounds] = {}
    with progress(lanes, done) as bar:

        def collect(future: Future[Arrays], block: Bounds) -> None:
            arrays = future.result()
            keep(block, arrays)
            tally.add(arrays)
            bar.update(block[1] - block[0])

        try:
            while waiting or futures:
                while waiting and len(futures) < executor.count_blocks():
                    block = waiting.pop()
                    futures[executor.submit(block)] = block
                for future in _ended(executor, futures):
                    collect(future, futures[future])
                    del futures[future]
                check()
        except KeyboardInterrupt:
            running = {future: block for future, block in futures.items() if not future.cancel()}
            while running:
                for future in _ended(executor, running):
                    # A block that fails is missing afterwards, and counted as missing.
                    with suppress(GearchaosError):
                        collect(future, running.pop(future))
            raise
    return tally


def _ended(
    executor: BlockExecutor, futures: Mapping[Future[Arrays], Bounds]
) -> set[Future[Arrays]]:
    """Return the blocks that have ended; wait for at least one while there are workers."""
    while not (ended := wait(futures, SECONDS_BETWEEN_LOOKS, FIRST_COMPLETED).done):
        executor.count_blocks()
    return ended
