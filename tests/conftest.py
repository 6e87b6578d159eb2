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

FIRST = ("vectorisation", "flow_map", "dask", "explore", "oracle", "second_model", "claims")
FIRST += ("linear_systems", "controlled_machines", "hard_boundaries", "explore_menus")
FIRST += (
    "fuzz",
    "sweep_interrupted",
    "chosen",
    "teeth_flanks",
    "notebook",
    "teeth_linear",
    "teeth",
)
FIRST += ("twin", "leaks", "threads", "hard_groups", "swept_parameters", "shard_option", "accuracy")
"""Files that run first, in this order: they take longest, or compile what many others need.

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


def pytest_collection_finish(session):
    """Take what is imported out of the garbage collector's sight: it stays to the end.

    Where several processes run tests, let none compile what another one is compiling.
    """
    if hasattr(session.config, "workerinput"):
        from .gearchaos.compiled_once import install

        install()
    gc.freeze()
