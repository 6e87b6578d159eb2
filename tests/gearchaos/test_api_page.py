"""The Python blocks of docs/api.md and README.md run as they stand there, one after the other."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

CLONE = Path(__file__).resolve().parents[2]


def run_blocks(page: str, folder: Path, names: dict) -> None:
    """Run the blocks of a page in a folder that looks like the clone."""
    (folder / "sweeps").symlink_to(CLONE / "sweeps")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for block in re.findall(r"```python\n(.*?)```", (CLONE / page).read_text(), re.DOTALL):
            if "pan2021.h5" in block:
                shutil.copy("coarse.h5", "pan2021.h5")
            exec(compile(block, page, "exec"), names)


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    names: dict = {}
    run_blocks("docs/api.md", tmp_path_factory.mktemp("api"), names)
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


def test_what_the_readme_shows_in_python_runs(tmp_path):
    names: dict = {}
    run_blocks("README.md", tmp_path, names)
    assert names["system"].orbit(period=2).multipliers.shape == (6,)
    assert names["result"]["lyapunov_exponent"].shape == (301,)
    assert set(names["chaotic"].motion.values) == {2.0}
