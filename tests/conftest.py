"""Settings of all tests."""

import gc
import os

import pytest
from hypothesis import HealthCheck, settings

# The same examples on every run: a failure is a failure of the change that was made, and not of a
# machine that is busy.
TIMED = [HealthCheck.too_slow]
settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=TIMED
)
settings.load_profile("repeatable")

FIRST = ("vectorisation", "flow_map", "explore", "oracle", "shard_option", "dask", "loads")
FIRST += ("hard_groups", "swept_parameters", "sweep_interrupted", "teeth_linear")
FIRST += ("accuracy", "teeth")
"""Files that run first, in this order: none of them shall be the last that runs, and what they
compile shall be in the cache before another process asks for it.

The first one compiles its scenes whatever is in the cache.
"""


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """Use all cores unless -n says how many, or somebody wants to look into this process.

    With one process more than there are: some tests wait for a browser, a scheduler or a disk.
    """
    option = config.option
    looked_into = option.usepdb or option.trace or option.capture == "no"
    if hasattr(config, "workerinput") or looked_into:  # A worker starts none of its own.
        return
    if getattr(option, "numprocesses", 0) is None:
        option.numprocesses = 1 + (os.cpu_count() or 1)
        # A file in one process: what its tests compile is compiled once.
        option.dist = "loadfile"
        option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    """Begin with the files that are told to be first, in their order."""
    places = {f"test_{name}": place for place, name in enumerate(FIRST)}
    items.sort(key=lambda item: places.get(item.path.stem, len(FIRST)))


def pytest_collection_finish():
    """Take what is imported out of the garbage collector's sight: it stays to the end."""
    gc.freeze()
