"""A process that runs and draws repeatedly leaks no threads, files or memory."""

import gc
import os
import threading
import weakref
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.figures import bifurcation_page, map_page

from .test_figures import logistic_sweep
from .test_maps import RESULT as MAP
from .tiny_sweep import configuration

RUNS, PAGES = 200, 30

SELF = Path("/proc/self")
MEGABYTE = 1 << 20


def memory() -> float:
    """Return the memory of this process in MB after a garbage collection."""
    gc.collect()
    pages = int((SELF / "statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MEGABYTE


def held() -> tuple[int, int]:
    """Return the numbers of threads and open files of this process."""
    return len(os.listdir(SELF / "task")), len(os.listdir(SELF / "fd"))


@pytest.mark.skipif(
    not SELF.exists(), reason="/proc is missing: threads, files and memory cannot be counted"
)
def test_many_runs_leave_threads_files_and_memory_where_they_were():
    config, threads_before = configuration(0, "sweep.count=2"), {*threading.enumerate()}
    for _ in range(3):
        gearchaos.run(config)
    before, memory_before = held(), memory()
    for _ in range(RUNS):
        gearchaos.run(config)
    assert not {*threading.enumerate()} - threads_before
    threads, files = held()
    assert threads <= before[0]
    assert files <= before[1]
    # At most 100 kB per run.
    assert memory() - memory_before < 20.0


@pytest.mark.skipif(not SELF.exists(), reason="/proc is missing: memory cannot be read")
def test_many_pages_leave_memory_where_it_was():
    result = logistic_sweep(np.linspace(2.8, 3.9, 31))

    def drawn(pages: int) -> list[weakref.ref]:
        return [weakref.ref(bifurcation_page(result)) for _ in range(pages)]

    # Later pages reuse memory that is not collected yet.
    drawn(15)
    before = memory()
    for _ in range(PAGES // 15):
        pages = drawn(15)
        now = memory()
        assert not any(page() for page in pages)
    # A page takes 5 MB while it exists; the limit is a fifth of the memory of all pages.
    assert now - before < PAGES


@pytest.mark.parametrize(
    "draw", [lambda: map_page(MAP), lambda: bifurcation_page([MAP.sel(pitch_error=1.0)] * 2)]
)
def test_a_page_that_nobody_holds_is_gone(draw):
    page = weakref.ref(draw())
    gc.collect()
    assert page() is None
