"""Settings of all tests."""

import gc
import os

import pytest
from hypothesis import settings

# Several processes share the cores: a thread that waits shall leave its core to the others.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

# The same examples on every run: a failure is a failure of the change that was made.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """Use all cores unless -n says how many, or somebody wants to look into this process."""
    option = config.option
    looked_into = option.usepdb or option.trace or option.capture == "no"
    if hasattr(config, "workerinput") or looked_into:  # A worker starts none of its own.
        return
    if getattr(option, "numprocesses", 0) is None:
        option.numprocesses = "logical"
        # A file in one process: what its tests compile is compiled once.
        option.dist = "loadfile"


def pytest_collection_finish():
    """Take what is imported out of the garbage collector's sight: it stays to the end."""
    gc.freeze()
