"""The blocks of docs/api.md run as they stand there, one after the other."""

import re
from pathlib import Path

import numpy as np
import pytest

CLONE = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def names():
    blocks = re.findall(r"```python\n(.*?)```", (CLONE / "docs/api.md").read_text(), re.DOTALL)
    assert len(blocks) >= 7
    names: dict = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(CLONE)
        for block in blocks:
            exec(compile(block, "docs/api.md", "exec"), names)
    return names


def test_the_page_says_what_comes_out(names):
    assert names["branch"].text == "period doubling: a real multiplier passes -1"
    assert names["result"].axes == ("pitch_error",)
    assert names["result"]["lyapunov_exponent"].shape == (61,)
    assert names["chart"]["motion"].shape == (3, 5)
    assert names["chart"].axes == ("mesh_frequency", "pitch_error")


def test_a_lane_goes_on_where_it_ended(names):
    lane = names["result"].sel(pitch_error=12.0, method="nearest")
    start = names["system"].integrate(periods=2).states[0]
    assert np.array_equal(start, lane["end_state"])
