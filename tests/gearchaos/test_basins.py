"""Basins of the two coexisting motions of period 1 in Pan 2021, and the basins command."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import gearchaos
from gearchaos.engine.basins import find_basins
from gearchaos.errors import ConfigurationError, FigureError, FileError
from gearchaos.figures import basins, basins_page, fractions
from gearchaos.figures.ensembles import COLORS
from gearchaos.records.label import DIVERGED, UNRESOLVED
from gearchaos.results.reading.basin_units import physical_basins
from gearchaos.results.reading.listed import list_basins
from gearchaos.results.reading.result import Result

from .commands import run_module
from .short_sweeps import PAN2021

BETWEEN_THEM = 0.95
"""At P = 1.04 the motion without contact loss has delta_5 = 1.24 in the section, the other 0.66."""

SHORT = ("integration.transient_periods=200", "integration.recorded_periods=48")


def computed(values: list[float], *start: str) -> Result:
    swept = f"sweep={{parameter='pitch_error', values={values}}}"
    few = (*SHORT, "outputs.section_points=1", "start.box={delta_5=[-3, 3], delta_5_rate=[-3, 3]}")
    return gearchaos.run(gearchaos.load_config(PAN2021, [swept, *few, *start]))


@pytest.fixture(scope="module")
def grid() -> Result:
    # Without bearings, as in the notebook: both use the same compiled loop.
    scene = 'scene.effects=["pitch_error", "stiffness_variation", "backlash"]'
    return computed([1.04], scene, "start.kind=grid", "start.count=11", "outputs.contact=true")


@pytest.fixture(scope="module")
def several() -> Result:
    """Compute a sweep at values before, between and beyond the two folds at 0.780 and 1.691."""
    values = [0.7, 0.9, 1.2, 1.6, 1.8]
    return computed(values, "start.kind=random", "start.count=16", "start.seed=2")


@pytest.fixture
def folder(grid, several, tmp_path):
    grid.save(tmp_path / "grid.h5")
    several.save(tmp_path / "several.h5")
    return tmp_path


def changed(result: Result, data: dict | None = None, without: str = "", **metadata) -> Result:
    return Result(
        result.axes,
        [variable for name, variable in result.variables.items() if name != without],
        {name: result[name] for name in result} | (data or {}),
        result.parameters,
        {**result.metadata, **metadata},
    )


def test_the_exponent_of_a_basin_is_that_of_all_periods_of_its_orbit():
    result = computed([10.9], "start.kind=random", "start.count=8", "start.seed=2")
    doubled = [basin for basin in find_basins(result).basins if basin.period == 2]
    assert doubled
    duration = 2 * 2.0 * np.pi / 0.8758760318208343
    for basin in doubled:
        assert basin.exponent == pytest.approx(np.log(basin.multiplier) / duration)


def test_two_motions_share_the_starts_as_a_plain_count_does(grid):
    found = find_basins(grid)
    high = grid["end_state"][0, :, 0] > BETWEEN_THEM
    one, other = found.basins
    assert 0.2 < high.mean() < 0.8
    assert sorted((one.starts, other.starts)) == sorted((high.sum(), (~high).sum()))
    assert one.starts >= other.starts
    assert (found.numbers[0] == 1).tolist() == (high == (one.section[0, 0] > BETWEEN_THEM)).tolist()
    for basin in found.basins:
        assert (basin.motion, basin.period, basin.section.shape) == ("period 1", 1, (1, 2))
        assert 0.0 < basin.multiplier < 1.0
        mine = found.numbers[0] == basin.number
        assert basin.exponent == pytest.approx(grid["lyapunov_exponent"][0, mine].mean())
        assert basin.means["crossings_per_period"] == grid["crossings_per_period"][0, mine].mean()
    assert "lyapunov_exponent_standard_error" not in one.means


def test_a_start_at_rest_changes_sides_where_the_pair_hops():
    """In pan2021_first.toml, a start at rest hops from one motion to the other at 1.044."""
    found = find_basins(computed([1.04, 1.05], "start.kind=grid", "start.count=3"))
    at_rest = [len(found.grid["delta_5"]) ** 2 // 2]
    sections = {(one.value, one.number): one.section for one in found.basins}
    below, above = (
        sections[value, int(row[at_rest][0])][0, 0]
        for value, row in zip(found.values, found.numbers, strict=True)
    )
    assert below > BETWEEN_THEM > above
    assert found.numbers[0, at_rest] != found.numbers[1, at_rest]


def test_numbers_stay_with_the_motions_across_both_folds(several):
    found = find_basins(several)
    high = several["end_state"][:, :, 0] > BETWEEN_THEM
    assert [{*row} for row in found.numbers] == [{1}, {1, 2}, {1, 2}, {1, 2}, {2}]
    assert np.array_equal(found.numbers == 1, high)
    assert not found.grid
    assert not found.entropy


def test_one_value_of_several_is_looked_at_by_itself(several):
    whole, part = find_basins(several), find_basins(several.sel(pitch_error=1.2))
    assert part.parameter == "pitch_error"
    assert part.values.tolist() == [1.2]
    counts = [sorted(b.starts for b in f.basins if b.value == 1.2) for f in (whole, part)]
    assert counts[0] == counts[1]


def test_what_diverged_or_is_unresolved_is_a_class_of_its_own(grid):
    motion, period = grid["motion"].copy(), grid["period"].copy()
    motion[0, :3], motion[0, 3:5], period[0, :5] = UNRESOLVED, DIVERGED, 0
    found = find_basins(changed(grid, {"motion": motion, "period": period}))
    told = {one.number: (one.motion, one.starts) for one in found.basins}
    assert told[-UNRESOLVED] == ("unresolved", 3)
    assert told[-DIVERGED] == ("diverged", 2)
    assert [one.number > 0 for one in found.basins] == [True, True, False, False]
    assert sum(count for _, count in told.values()) == 121
    assert all(not one.section.size for one in found.basins if one.number < 0)
    assert [len(one.contact) for one in found.basins] == [1, 1, 0, 0]


def test_a_motion_without_an_orbit_at_its_end_is_unresolved(grid):
    period = np.where(np.arange(121) == 7, 3, grid["period"])
    found = find_basins(changed(grid, {"period": period}))
    assert found.numbers[0, 7] == -UNRESOLVED
    assert np.count_nonzero(found.numbers < 0) == 1


def test_results_without_several_starts_labels_or_configuration_are_refused(grid):
    with pytest.raises(ConfigurationError, match=r'axes pitch_error; .*start.kind = "grid"'):
        find_basins(grid.sel(start=3))
    with pytest.raises(FileError, match=r"grid.h5: holds no labels"):
        find_basins(changed(grid, without="period"), "grid.h5")
    with pytest.raises(FileError, match="holds no configuration"):
        find_basins(changed(grid, configuration_resolved=""))
    text = grid.metadata["configuration_resolved"].replace("count = 11", "count = 9")
    with pytest.raises(FileError, match="the configuration of other lanes"):
        find_basins(changed(grid, configuration_resolved=text))


def run(folder, *arguments: str):
    return run_module("gearchaos.basins", *arguments, cwd=folder)


def test_the_table_lists_every_basin_within_80_columns(folder):
    ended = run(folder, "several.h5")
    assert (ended.code, ended.err) == (0, "")
    lines = ended.out.splitlines()
    assert lines[:2] == [
        "basins over pitch_error, 16 starts at each value",
        "exponents per unit of tau",
    ]
    assert max(map(len, lines)) <= 80
    rows = [line.split() for line in lines[3:]]
    assert [row[:4] for row in rows[:3]] == [
        ["0.7", "1", "period", "1"],
        ["0.9", "1", "period", "1"],
        ["0.9", "2", "period", "1"],
    ]
    shares = {}
    for row in rows:
        shares[row[0]] = shares.get(row[0], 0.0) + float(row[6])
        assert float(row[7]) <= float(row[6]) <= float(row[9])
    assert list(shares.values()) == pytest.approx([1.0] * 5)


def test_one_value_is_reported_with_entropy_and_the_means_of_its_basins(folder):
    out = run(folder, "grid.h5").out
    assert "basin entropy" in out
    told = " ".join(out.split())
    assert "1: contact_state_tangential held, crossings_per_period 0" in told
    assert "2: contact_state_tangential single_sided_impact" in told
    for place in ("pitch_error=1.1", "1.1"):
        at = run(folder, "several.h5", "--at", place).out.splitlines()
        assert at[1] == "slice pitch_error = 1.2; others with --at pitch_error=VALUE"


def test_json_reports_all_of_it(folder, grid):
    told = json.loads(run(folder, "grid.h5", "--json").out)
    found = find_basins(grid)
    assert (told["parameter"], told["starts"]) == ("pitch_error", 121)
    assert told["entropy"] == [pytest.approx(found.entropy[0])]
    for facts, one in zip(told["basins"], found.basins, strict=True):
        assert (facts["value"], facts["number"], facts["starts"]) == (1.04, one.number, one.starts)
        assert facts["share_95_percent"] == pytest.approx(one.share_95_percent)
        assert facts["section"] == one.section.tolist()
        assert facts["contact"] == one.contact
        assert facts["means"]["crossings_per_period"] == one.means["crossings_per_period"]


def test_physical_units_are_those_of_the_scales(tmp_path):
    scene = 'scene.effects=["pitch_error", "stiffness_variation", "backlash"]'
    scales = ("mesh.length_scale_um=25.0", "outputs.contact=true")
    result = computed([1.04], scene, "start.kind=grid", "start.count=3", *scales)
    result.save(tmp_path / "grid.h5")
    rate = float(result.parameters["scaling_frequency"].values)
    plain, physical = (
        json.loads(run(tmp_path, "grid.h5", "--json", *units).out)
        for units in ((), ("--units", "physical"))
    )
    assert plain["units"]["lyapunov_exponent"] == "per unit of tau"
    assert plain["units"]["time_driving_tangential"] == "1"
    units = {"delta_5": "um", "delta_5_rate": "m/s", "lyapunov_exponent": "s^-1"}
    assert units.items() <= physical["units"].items()
    factors = [25.0, 25e-6 * rate]
    for one, other in zip(plain["basins"], physical["basins"], strict=True):
        assert np.array(other["section"]) == pytest.approx(np.array(one["section"]) * factors)
        assert other["exponent"] == pytest.approx(one["exponent"] * rate)
        assert other["share"] == one["share"]
        assert other["means"]["time_driving_tangential"] == one["means"]["time_driving_tangential"]
    page = basins_page(physical_basins(find_basins(result)))
    assert page.axes[0].get_xlabel().endswith("(\N{MICRO SIGN}m)")
    assert page.axes[0].get_xlim() == pytest.approx((-3.0 * 37.5, 3.0 * 37.5))
    table = run(tmp_path, "grid.h5", "--csv", "--units", "physical").out
    assert "exponent [s^-1]" in table.splitlines()[0]


def test_starts_that_are_carried_on_have_no_basins(tmp_path):
    starts = ("start.kind=grid", "start.count=2", "start.carry=upwards")
    computed([0.7, 0.9], *starts).save(tmp_path / "carried.h5")
    ended = run(tmp_path, "carried.h5")
    assert (ended.code, ended.out) == (2, "")
    assert 'start.carry = "upwards": beyond the first value' in ended.err


def test_units_are_those_of_the_variables(folder):
    found = find_basins(gearchaos.open_result(folder / "grid.h5"))
    exponent = found.result.variables["lyapunov_exponent"]
    found.result.variables["lyapunov_exponent"] = replace(exponent, units="ms^-1")
    again = find_basins(found.result)
    assert again.units["lyapunov_exponent"] == "ms^-1"
    assert "exponent [ms^-1]" in list_basins(again).headings


def test_units_that_the_configuration_does_not_give_are_refused(folder):
    ended = run(folder, "grid.h5", "--units", "physical")
    assert (ended.code, ended.out) == (2, "")
    assert "length_scale_um" in ended.err


def test_figures_are_drawn_and_foreign_files_kept(folder):
    for name in ("grid", "several"):
        assert run(folder, f"{name}.h5", "-o", f"{name}.png", "--quiet").code == 0
        assert run(folder, f"{name}.h5", "-o", f"{name}.png", "--quiet").code == 0
    (folder / "mine.png").write_bytes(b"mine")
    ended = run(folder, "grid.h5", "-o", "mine.png")
    assert (ended.code, ended.out) == (4, "")
    assert "mine.png" in ended.err
    assert (folder / "mine.png").read_bytes() == b"mine"


def test_a_map_shows_the_basin_of_every_start_and_the_attractors_on_top(grid):
    found, axes = find_basins(grid), Figure().subplots()
    image = basins(axes, found)
    drawn = image.cmap(image.norm(image.get_array()))
    for row, column in ((0, 0), (5, 7), (10, 3)):
        start = found.numbers[0].reshape(11, 11)[column, row]
        assert to_hex(drawn[row, column]).upper() == COLORS[start - 1]
    assert image.get_extent() == pytest.approx([-3.3, 3.3, -3.3, 3.3])
    for line, one in zip(axes.lines, found.basins, strict=True):
        assert line.get_xydata().tolist() == one.section[:, :2].tolist()
    (legend,) = basins_page(found).legends
    share = 100.0 * found.basins[0].share
    assert legend.get_texts()[0].get_text().startswith(f"1: period 1, {share:.3g} %")


def test_fractions_lie_on_top_of_each_other(several):
    found, axes = find_basins(several), Figure().subplots()
    first, second = fractions(axes, found)
    heights = [bar.get_height() for bar in first]
    assert heights == pytest.approx(np.mean(found.numbers == 1, axis=1))
    assert [bar.get_y() for bar in second] == pytest.approx(heights)
    assert [bar.get_y() + bar.get_height() for bar in second] == pytest.approx([1.0] * 5)
    assert second.get_label() == "2: period 1"


def test_random_starts_make_no_map(several):
    with pytest.raises(FigureError, match=r'start.kind = "grid" and name two states'):
        basins_page(find_basins(several.sel(pitch_error=1.2)))
