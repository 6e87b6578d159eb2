"""The blocks of a sweep in its store: shards, and the computation of missing blocks."""

import re
from typing import NamedTuple, Self

import numba
from gearchaos_kernels import LANES

from gearchaos.engine.computing import Bounds, EndStates, block_lanes
from gearchaos.engine.error_check import Tally
from gearchaos.engine.executors import BlockExecutor, LocalExecutor, compute_blocks
from gearchaos.engine.kept import variables_of
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.engine.run_plan import RunPlan
from gearchaos.errors import ConfigurationError
from gearchaos.progress import complain
from gearchaos.results.files.block_store import BlockStore, OwnBlocks

BLOCKS_PER_SHARD = 4
"""Smallest number of blocks per shard, given enough lanes: shards then end together."""

FEWEST_BLOCK_LANES, MOST_BLOCK_LANES = 8 * LANES, 128 * LANES
"""Limits of the lanes of a block: enough for a few threads, and for a whole node."""


class Shard(NamedTuple):
    """One of several portions of a sweep, each the work of one job.

    Attributes
    ----------
    number : int
        Number of the portion, from 1.
    of : int
        Number of portions.
    """

    number: int
    of: int

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read ``2/8``; ConfigurationError if the text has another form."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text, re.ASCII)
        shard = cls(*map(int, found.groups())) if found else cls(0, 0)
        if not 1 <= shard.number <= shard.of:
            raise ConfigurationError(
                f"--shard {text}: must be i/N with i from 1 to N, such as 2/8 for the second of "
                "eight jobs"
            )
        return shard

    def blocks(self, lanes: int) -> list[Bounds]:
        """Return the bounds of this shard's blocks of a sweep with ``lanes`` lanes."""
        return shared_blocks(lanes, self.of)[self.number - 1 :: self.of]


def shared_blocks(lanes: int, shards: int) -> list[Bounds]:
    """Cut a sweep into blocks for a number of jobs or workers, equal on every machine."""
    size = shared_block_lanes(lanes, shards)
    return [(first, min(first + size, lanes)) for first in range(0, lanes, size)]


def shared_block_lanes(lanes: int, shards: int) -> int:
    """Return the number of lanes of such a block."""
    share = -(-lanes // (BLOCKS_PER_SHARD * shards))
    return min(max(LANES * -(-share // LANES), FEWEST_BLOCK_LANES), MOST_BLOCK_LANES)


def open_store(
    run: RunPlan, output: str, *, resume: bool, shard: Shard | None = None
) -> BlockStore:
    """Open the store of a sweep, see `BlockStore`; no kernel is compiled."""
    return BlockStore(
        output,
        variables_of(run),
        run.config.resolved_toml(),
        SOFTWARE,
        text=run.config.text,
        resume=resume,
        own=shard and OwnBlocks(shard.blocks(len(run.lanes)), shard.of),
    )


def fill(run: RunPlan, store: BlockStore, cluster: str | None) -> tuple[Tally, dict[str, int]]:
    """Compute the missing blocks, and store each block as soon as it is finished.

    The kernel is compiled and the steps are chosen. ``cluster``: address of a dask scheduler, see
    `DaskExecutor`; None computes in this process. Returns the tally of all own blocks, finished
    ones included, and metadata about the workers.
    """
    tally = Tally(run.lanes.repeats_after)
    finished, problems = store.finished(tally.add)
    for problem in problems:
        complain(f"{problem}; it is computed again")
    done = sum(last - first for first, last in finished)
    performed_by = {}
    if cluster is None:
        size, ends = block_lanes(run, numba.get_num_threads()), EndStates(run)
        for block in finished if run.carried else ():
            ends.keep(block[0], store.read(*block)["end_state"])
        executor: BlockExecutor = LocalExecutor(run, ends)
    else:
        from gearchaos.engine.dask_executor import DaskExecutor

        executor = DaskExecutor(run, cluster)
        workers = executor.count_workers()
        size = shared_block_lanes(len(run.lanes), workers)
        performed_by = {"threads": 1, "workers": workers}
    missing = store.missing(finished, size)
    with executor:
        compute_blocks(executor, missing, lambda at, arrays: store.write(*at, arrays), tally, done)
    return tally, performed_by
