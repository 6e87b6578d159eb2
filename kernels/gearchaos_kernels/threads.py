"""The processor and the threads that share its cores."""

from __future__ import annotations

import llvmlite.binding
import numba


def processor() -> str:
    """Return LLVM's name of the processor, such as ``znver4``."""
    return str(llvmlite.binding.get_host_cpu_name())


def most_threads() -> int:
    """Return how many threads can be used in this process."""
    return int(numba.config.NUMBA_NUM_THREADS)


def current_threads() -> int:
    """Return how many threads the next batch uses."""
    return int(numba.get_num_threads())


def use_threads(count: int) -> None:
    """Choose how many threads the next batches use.

    Raises
    ------
    ValueError
        If the count is not between 1 and `most_threads`.
    """
    numba.set_num_threads(count)
