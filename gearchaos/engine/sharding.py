"""The shards of a sweep that several jobs compute: ``--shard 2/8`` takes every eighth block."""

import re
from typing import NamedTuple, Self

from gearchaos_kernels import LANES

from gearchaos.engine.simulation import Bounds
from gearchaos.errors import ConfigurationError

BLOCKS_PER_SHARD = 4
"""At least so many blocks for everyone, as far as there are enough lanes: shards end together."""

FEWEST_LANES, MOST_LANES = 8 * LANES, 128 * LANES
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
    return min(max(LANES * -(-share // LANES), FEWEST_LANES), MOST_LANES)
