"""Settings of all tests."""

import gc
import os

import pytest
from hypothesis import HealthCheck, settings

# Every run draws the same examples and has no time limit: a failure comes from a change of the
# code, not from chance or a busy machine.
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
"""Files that run first, in this order: they take longest, or compile loops that others need.

The first one always compiles its scenes, even if the cache contains them.
"""


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """Run tests on all cores, unless -n or an option for debugging in this process is given.

    There is one more process than cores: some tests wait for a browser, a scheduler or a disk.
    """
    option = config.option
    looked_into = option.usepdb or option.trace or option.capture == "no"
    if hasattr(config, "workerinput") or looked_into:  # A worker starts no workers.
        return
    if getattr(option, "numprocesses", 0) is None:
        option.numprocesses = 1 + (os.cpu_count() or 1)
        # Each file runs in one process, so that its loops are compiled once.
        option.dist = "loadfile"
        option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    """Run the files of `FIRST` first, in this order."""
    places = {f"test_{name}": place for place, name in enumerate(FIRST)}
    items.sort(key=lambda item: places.get(item.path.stem, len(FIRST)))


def pytest_collection_finish(session):
    """Exclude all imported objects from garbage collection, because they exist until the end.

    If several processes run tests, each one waits for loops that another one is compiling.
    """
    if hasattr(session.config, "workerinput"):
        from .gearchaos.compiled_once import install

        install()
    gc.freeze()
