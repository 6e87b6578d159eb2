"""The table of variables is complete: what it has no row for is refused, not left out."""

import numpy as np
import pytest

from gearchaos.engine.running import result_of
from gearchaos.results.files.block_store import BlockStore
from gearchaos.results.files.result_file import write_result
from gearchaos.results.variables import STATUS, listed, require_listed

from .short_sweeps import unlabelled
from .test_block_store import CONFIGURATION, LANES, PARAMETERS, SOFTWARE, VARIABLES, sweep

EVERY = {"every sweep": True}


@pytest.mark.parametrize(
    ("given", "unknown"),
    [
        ((EVERY | {"lyapnov": True}, {}, {}), "lyapnov"),
        # The words for states are no variables.
        ((EVERY | {"state": ["delta_5"]}, {}, {}), "state"),
        ((EVERY, {"section_points": np.arange(3)}, {}), "section_points"),
        ((EVERY, {}, {"statuses": ["ok"], "motions": ["chaotic"]}), "motions, statuses"),
    ],
)
def test_a_key_without_a_row_is_refused(given, unknown):
    with pytest.raises(ValueError, match=rf"^{unknown}: no row of variables\.csv"):
        listed((), *given)


def test_rows_that_a_sweep_leaves_out_may_have_values_and_meanings():
    found = listed((), EVERY, {"order": np.arange(2)}, {"motion": ["chaotic"]})
    assert STATUS in [one.name for one in found]


def test_arrays_without_a_variable_are_refused_and_no_others():
    require_listed({"status": 0}, ["status", "motion"])
    with pytest.raises(ValueError, match=r"^noise: would not be written"):
        require_listed({"status": 0, "noise": 1}, ["status", "motion"])


def test_a_block_with_an_array_too_many_is_not_kept(tmp_path):
    arrays = sweep() | {"noise": np.zeros(LANES)}
    with BlockStore(tmp_path / "a.h5", VARIABLES, CONFIGURATION, SOFTWARE) as store:
        with pytest.raises(ValueError, match=r"^noise: would not be written"):
            store.write(0, LANES, arrays)
        assert not store.finished()[0]


def test_a_file_with_an_array_too_many_is_not_written(tmp_path):
    blocks = [(0, LANES, sweep() | {"noise": np.zeros(LANES)})]
    with pytest.raises(ValueError, match=r"^noise: would not be written"):
        write_result(tmp_path / "a.h5", VARIABLES, blocks, PARAMETERS, {"title": "t"})
    assert not list(tmp_path.iterdir())


def test_a_result_with_an_array_too_many_is_not_made():
    found = unlabelled("sweep.count=2")
    arrays = found.compute(0, 2)
    assert result_of(found, [arrays], {}).axes == ("pitch_error",)
    with pytest.raises(ValueError, match=r"^noise: would not be written"):
        result_of(found, [{**arrays, "noise": np.zeros(2)}], {})
