"""Ranges of lanes: what a block leaves out of others, and how missing ones are named."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence

Bounds = tuple[int, int]
"""First lane of a range, and the one after its last."""


def uncovered(block: Bounds, finished: Sequence[Bounds]) -> Iterator[Bounds]:
    """Give what finished blocks, sorted and without overlap, leave out of a block."""
    first, last = block
    for begin, end in finished[bisect_right(finished, first, key=lambda bounds: bounds[1]) :]:
        if begin >= last:
            break
        if first < begin:
            yield first, begin
        first = end
    if first < last:
        yield first, last


def lanes_text(gaps: Sequence[Bounds], most: int = 3) -> str:
    """Word which lanes there are not: "lanes 0 to 255, 512 to 767 and 4 more blocks are"."""
    names = ", ".join(f"{first} to {last - 1}" for first, last in gaps[:most])
    more = f" and {len(gaps) - most} more ranges" if len(gaps) > most else ""
    return f"lanes {names}{more} are"
