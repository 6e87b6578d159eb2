"""The blocks that a store lacks, computed into it."""

from functools import partial

import numba

from gearchaos.engine.error_check import Tally
from gearchaos.engine.executors import BlockExecutor, LocalExecutor, compute_blocks
from gearchaos.engine.provenance import SOFTWARE
from gearchaos.engine.sharding import Shard, shared_block_lanes
from gearchaos.engine.simulation import Arrays, Bounds, Simulation
from gearchaos.progress import Progress, complain
from gearchaos.results.block_store import BlockStore


def open_store(
    simulation: Simulation, output: str, *, resume: bool, shard: Shard | None = None
) -> BlockStore:
    """Open the store of a sweep, see `BlockStore`; it needs not be compiled for that."""
    return BlockStore(
        output,
        simulation.variables,
        simulation.config.resolved_toml(),
        SOFTWARE,
        text=simulation.config.text,
        resume=resume,
        blocks=shard and shard.blocks(len(simulation.lanes)),
        shards=shard and shard.of,
    )


def fill(
    simulation: Simulation, store: BlockStore, cluster: str | None
) -> tuple[Tally, dict[str, int]]:
    """Compute the blocks that are missing, and keep each of them as soon as it is there.

    The simulation is compiled and its number of steps chosen; ``cluster`` says where dask workers
    are, see `DaskExecutor`, and None computes in this process. Returns the tally of all own blocks,
    the finished ones too, and what the result file says about who has computed.
    """
    tally = Tally()
    finished, problems = store.finished(tally.add)
    for problem in problems:
        complain(f"{problem}; it is computed again")
    done = sum(last - first for first, last in finished)
    performed_by = {}
    if cluster is None:
        size = simulation.block_lanes(numba.get_num_threads())
        readers = {block: partial(store.read, *block) for block in finished}
        executor: BlockExecutor = LocalExecutor(simulation, readers)
    else:
        from gearchaos.engine.dask_executor import DaskExecutor

        executor = DaskExecutor(simulation, cluster)
        size = shared_block_lanes(len(simulation.lanes), executor.workers)
        performed_by = {"threads": 1, "workers": executor.workers}
    missing = store.missing(finished, size)
    with executor, Progress(store.own_lanes, done) as progress:

        def keep(block: Bounds, arrays: Arrays) -> None:
            store.write(*block, arrays)
            tally.add(arrays)
            progress.advance(block[1] - block[0])

        compute_blocks(executor, missing, keep)
    return tally, performed_by
