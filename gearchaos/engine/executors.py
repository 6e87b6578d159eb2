"""Where blocks of lanes are computed: ``submit(block)`` gives a future, and one loop waits for it.

A `BlockExecutor` is used as those of `concurrent.futures` are: leaving its context ends what it has
started. Its ``count_blocks`` returns how many blocks to hand out at a time, so that nobody waits
for the next one. The loop does not know whether a block is computed in this process or on a
cluster.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, TypeAlias

import numba

from gearchaos.arrays import Arrays
from gearchaos.engine.computing import Bounds, EndStates, compute
from gearchaos.engine.error_check import Tally
from gearchaos.engine.run_plan import RunPlan
from gearchaos.errors import GearchaosError
from gearchaos.interrupts import check
from gearchaos.progress import progress

if TYPE_CHECKING:
    from gearchaos.engine.dask_executor import DaskExecutor

BlockExecutor: TypeAlias = "LocalExecutor | DaskExecutor"

SECONDS_BETWEEN_LOOKS = 1.0
"""How often it is looked whether somebody is there to compute, while no block ends."""


class LocalExecutor(ExitStack):
    """Computes in this process, one block at a time: all threads work within a block.

    ``ends``: end states of the lanes of a carried sweep that are computed already; those of the
    other lanes are kept there. A thread of its own leaves the main one free to write finished
    blocks, and an interrupt, which the main thread receives, does not cost the running block.
    """

    def __init__(self, run: RunPlan, ends: EndStates | None = None) -> None:
        super().__init__()
        self._run, self._ends = run, ends or EndStates(run)
        threads = (numba.get_num_threads(),)
        self._pool = ThreadPoolExecutor(1, initializer=numba.set_num_threads, initargs=threads)
        self.callback(self._pool.shutdown, cancel_futures=True)

    def submit(self, block: Bounds) -> Future[Arrays]:
        """Begin a block once those before it are done, and return the future of its arrays.

        Its `cancel` succeeds until the block runs.
        """
        return self._pool.submit(self._compute, block)

    def count_blocks(self) -> int:
        """Return how many blocks to hand out at a time: one that runs, and one that waits."""
        return 2

    def _compute(self, block: Bounds) -> Arrays:
        arrays = compute(self._run, block, self._ends.before(block[0]))
        self._ends.keep(block[0], arrays["end_state"])
        return arrays


def compute_blocks(
    executor: BlockExecutor,
    blocks: Sequence[Bounds],
    keep: Callable[[Bounds, Arrays], None],
    tally: Tally | None = None,
    done: int = 0,
) -> Tally:
    """Have blocks computed, handed out in this order, and keep each as soon as it is there.

    ``keep(block, arrays)`` is called in this thread. Returns what the blocks add up to with those
    of a tally, where so many lanes are done already. An interrupt lets the blocks that are running
    end and keeps them.
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
                    # What cannot be computed or kept is missing afterwards, and counted as such.
                    with suppress(GearchaosError):
                        collect(future, running.pop(future))
            raise
    return tally


def _ended(
    executor: BlockExecutor, futures: Mapping[Future[Arrays], Bounds]
) -> set[Future[Arrays]]:
    """Wait until some blocks have ended, as long as the executor has somebody to compute them."""
    while not (ended := wait(futures, SECONDS_BETWEEN_LOOKS, FIRST_COMPLETED).done):
        executor.count_blocks()
    return ended
