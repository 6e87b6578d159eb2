"""The blocks of a sweep in its store: which of them are whose, and the missing ones computed."""

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
from gearchaos.results.files.block_store import BlockStore

BLOCKS_PER_SHARD = 4
"""At least so many blocks for everyone, as far as there are enough lanes: shards end together."""

FEWEST_BLOCK_LANES, MOST_BLOCK_LANES = 8 * LANES, 128 * LANES
"""Lanes of a block: a few threads are kept busy by the fewest, a whole node by the most."""


class Shard(NamedTuple):
    """The ``number``-th, from 1, ``of`` several portions of a sweep, each the work of one job."""

    number: int
    of: int

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read ``2/8``; ConfigurationError if it is no shard."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text, re.ASCII)
        shard = cls(*map(int, found.groups())) if found else cls(0, 0)
        if not 1 <= shard.number <= shard.of:
            raise ConfigurationError(
                f"--shard {text}: must be i/N with i from 1 to N, such as 2/8 for the second of "
                "eight jobs"
            )
        return shard

    def blocks(self, lanes: int) -> list[Bounds]:
        """Return the bounds of this shard's blocks of a sweep of so many lanes."""
        return shared_blocks(lanes, self.of)[self.number - 1 :: self.of]


def shared_blocks(lanes: int, shards: int) -> list[Bounds]:
    """Cut a sweep into blocks, whatever the machine, that so many jobs or workers share."""
    size = shared_block_lanes(lanes, shards)
    return [(first, min(first + size, lanes)) for first in range(0, lanes, size)]


def shared_block_lanes(lanes: int, shards: int) -> int:
    """Return how many lanes such a block has."""
    share = -(-lanes // (BLOCKS_PER_SHARD * shards))
    return min(max(LANES * -(-share // LANES), FEWEST_BLOCK_LANES), MOST_BLOCK_LANES)


def open_store(
    run: RunPlan, output: str, *, resume: bool, shard: Shard | None = None
) -> BlockStore:
    """Open the store of a sweep, see `BlockStore`; it needs not be compiled for that."""
    return BlockStore(
        output,
        variables_of(run),
        run.config.resolved_toml(),
        SOFTWARE,
        text=run.config.text,
        resume=resume,
        blocks=shard and shard.blocks(len(run.lanes)),
        shards=shard and shard.of,
    )


def fill(run: RunPlan, store: BlockStore, cluster: str | None) -> tuple[Tally, dict[str, int]]:
    """Compute the blocks that are missing, and keep each of them as soon as it is there.

    The kernel is compiled and its number of steps chosen; ``cluster`` says where dask workers
    are, see `DaskExecutor`, and None computes in this process. Returns the tally of all own blocks,
    the finished ones too, and what the result file says about who has computed.
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
