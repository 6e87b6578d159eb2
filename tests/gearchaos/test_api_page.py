"""The Python blocks of README.md and of pages in docs/ run unchanged, one after the other."""

import re
from pathlib import Path

import numpy as np
import pytest

import gearchaos

CLONE = Path(__file__).resolve().parents[2]


def run_blocks(page: str, folder: Path, names: dict) -> None:
    """Run the blocks of a page in a folder that contains the sweeps of the clone."""
    (folder / "sweeps").symlink_to(CLONE / "sweeps")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for block in re.findall(r"```python\n(.*?)```", (CLONE / page).read_text(), re.DOTALL):
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


def test_a_result_is_read_as_its_page_shows(tmp_path):
    names: dict = {}
    run_blocks("docs/how-to/read-results.md", tmp_path, names)
    assert names["result"].parameters["mass_ratio_p"].origin == "derived"
    assert set(names["chaotic"].motion.values) == {2.0}


SMALL = {
    "pan2021": ["sweep.count=5"],
    "planetary": ["sweep={parameter='operation.speed_rpm', values=[2000.0, 2700.0]}"],
}
SHORT = ["integration.transient_periods=20", "integration.recorded_periods=8"]


@pytest.mark.slow
@pytest.mark.parametrize("page", ["configuration", "control", "file-format", "machines"])
def test_the_python_of_a_page_runs(page, tmp_path):
    for name, overrides in SMALL.items():
        if f'"{name}.h5"' in (CLONE / "docs" / f"{page}.md").read_text():
            small = ["outputs.section_points=4", *SHORT, *overrides]
            config = gearchaos.load_config(CLONE / "sweeps" / f"{name}.toml", small)
            gearchaos.run(config).save(str(tmp_path / f"{name}.h5"))
    names: dict = {}
    run_blocks(f"docs/{page}.md", tmp_path, names)
    expected = {
        "configuration": lambda: names["groups"].load == 0.25966,
        "control": lambda: names["motion"].captured.any(),
        "file-format": lambda: names["exponent"].shape == (5,),
        "machines": lambda: names["orbit"].stable and (tmp_path / "planets.png").exists(),
    }
    assert expected[page]()
