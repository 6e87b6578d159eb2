"""A result over the product of its axes: shapes, slices, and equal slices in xarray."""

import itertools
import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs.variable import Variable, coordinate
from gearchaos.results.files.result_file import hyperslabs, write_result
from gearchaos.results.reading.result import Result, open_result, section_variables

from .listed_variables import parameter, sweep_variables

POINTS = 6
LOADS = coordinate("load", "1", "static load", "$f_n$", np.linspace(0.1, 0.5, 3))
ERRORS = coordinate("pitch_error", "1", "pitch error", "$P$", np.linspace(0.0, 3.0, 7))
AXES = {
    "one start": (ERRORS,),
    "several starts": (ERRORS, CATALOGUE.axis("start", np.arange(4))),
    "two parameters": (LOADS, ERRORS),
    "two parameters, several starts": (LOADS, ERRORS, CATALOGUE.axis("start", np.arange(2))),
}


def flat_arrays(variables: list, axes: tuple[Variable, ...]) -> dict[str, np.ndarray]:
    sizes = {v.name: len(v.values) for v in variables if v.values is not None}
    lanes = math.prod(axis.values.size for axis in axes)
    random = np.random.default_rng(3)
    arrays = {}
    for v in variables:
        if v.values is None:
            shape = (lanes, *(sizes[dim] for dim in v.dims[len(axes) :]))
            kind = v.dtype == "float64"
            numbers = random.normal(size=shape) if kind else random.integers(0, 2, shape)
            arrays[v.name] = numbers.astype(v.dtype)
    return arrays


def variables_over(axes: tuple[Variable, ...]) -> list:
    return sweep_variables(
        axes,
        states=["delta_5", "delta_5_rate"],
        section=["delta_5"],
        section_points=POINTS,
        lyapunov=True,
        status_meanings=["ok", "diverged"],
        motion_meanings=["periodic", "chaotic"],
    )


def result_over(axes: tuple[Variable, ...]) -> Result:
    variables = variables_over(axes)
    cosine = parameter("stiffness_cosine", np.array([0.3, 0.2]), "given", dims=("harmonic",))
    parameters = {
        "damping_ratio": parameter("damping_ratio", 0.1, "given"),
        "stiffness_cosine": cosine,
    }
    for axis in axes:
        if axis.name != "start":
            parameters[axis.name] = parameter(axis.name, axis.values, "swept", dims=(axis.name,))
    if len(axes) > 1 and axes[1].name == "pitch_error":
        both = np.outer(LOADS.values, ERRORS.values)
        parameters["both"] = parameter("both", both, "swept", dims=("load", "pitch_error"))
    names = [axis.name for axis in axes]
    data = flat_arrays(variables, axes)
    return Result(names, variables, data, parameters, {"title": "t", "configuration": "x"})


@pytest.fixture(params=AXES)
def axes(request: Any) -> tuple[Variable, ...]:
    return AXES[request.param]


@pytest.fixture
def result(axes: tuple[Variable, ...]) -> Result:
    return result_over(axes)


def test_the_shape_is_that_of_the_axes_and_the_flat_lanes_are_in_c_order(axes, result) -> None:
    shape = tuple(axis.values.size for axis in axes)
    assert result["status"].shape == shape
    assert result["section_delta_5"].shape == (*shape, POINTS)
    flat = flat_arrays(list(result.variables.values()), axes)
    for name, values in flat.items():
        np.testing.assert_array_equal(result.lanes(name), values)
    coordinates = itertools.product(*(axis.values for axis in axes))
    assert list(zip(*map(result.along, result.axes), strict=True)) == list(coordinates)
    assert result.axis == "pitch_error"
    assert section_variables(result) == ("section_delta_5",)


def test_a_file_gives_back_what_was_saved(result, tmp_path) -> None:
    result.save(tmp_path / "r.h5")
    read = open_result(tmp_path / "r.h5")
    assert (read.axes, read.axis, read.metadata) == (result.axes, result.axis, result.metadata)
    assert list(read) == list(result)
    for name in result:
        np.testing.assert_array_equal(read[name], result[name], strict=True)
        assert read.dims(name) == result.dims(name)
    for name, entry in result.parameters.items():
        again = read.parameters[name]
        np.testing.assert_array_equal(again.values, entry.values)
        assert (again.dims, again.origin) == (entry.dims, entry.origin)
    without = open_result(tmp_path / "r.h5", rows=False)
    assert set(result) - set(without) == {"section_delta_5", "start_state", "end_state"}
    assert without["status"].shape == result["status"].shape


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_a_slice_is_that_of_xarray(engine, result, tmp_path) -> None:
    result.save(tmp_path / "r.h5")
    wanted = {"pitch_error": 1.3, "load": 0.29, "start": 1}
    names = [name for name in result.axes if name in wanted]
    # The places fix one axis, several or all axes, lie beyond the ends, or between two values.
    places = [{name: wanted[name] for name in names[:n]} for n in range(1, len(names) + 1)]
    places += [{"pitch_error": 99.0}, {"pitch_error": -5.0}, {"pitch_error": 0.75}]
    places += [{"pitch_error": -1e308}, {"pitch_error": 1e308}]
    with (
        xr.open_dataset(tmp_path / "r.h5", engine=engine, mask_and_scale=False) as whole,
        xr.open_dataset(tmp_path / "r.h5", engine=engine, group="parameters") as groups,
    ):
        for place in places:
            there, part = whole.sel(place, method="nearest"), result.sel("nearest", **place)
            assert part.axes == tuple(name for name in result.axes if name not in place)
            assert part.fixed == {name: float(there[name]) for name in place}
            for name in part:
                assert part.dims(name) == there[name].dims
                np.testing.assert_array_equal(part[name], there[name].values, strict=True)
            for name, entry in part.parameters.items():
                rest = groups[name].assign_coords(
                    {a: result[a] for a in groups[name].dims if a in result}
                )
                mine = {a: v for a, v in place.items() if a in rest.dims}
                there_too = rest.sel(mine, method="nearest") if mine else rest
                np.testing.assert_array_equal(entry.values, there_too.values)
                assert entry.dims == there_too.dims


def test_a_value_that_is_not_there_names_the_nearest(result) -> None:
    assert result.sel(pitch_error=1.5).fixed == {"pitch_error": 1.5}
    with pytest.raises(ConfigurationError, match=r"pitch_error = 1\.3: is none of the 7 .* 1\.5: "):
        result.sel(pitch_error=1.3)
    with pytest.raises(ConfigurationError, match="torque: is no axis of the result; its axes: "):
        result.sel(torque=1.0)
    with pytest.raises(ConfigurationError, match="must be a number"):
        result.sel("nearest", pitch_error=math.nan)


def test_all_axes_fixed_leave_the_rest_of_the_shape(result, tmp_path) -> None:
    first = {name: result[name][0] for name in result.axes}
    lane = result.sel(**first)
    assert (lane.axes, lane.axis) == ((), "")
    assert lane["status"].shape == ()
    assert lane["section_delta_5"].shape == (POINTS,)
    assert lane.lanes("end_state").shape == (1, 2)
    assert lane.parameters["stiffness_cosine"].dims == ("harmonic",)
    assert np.ndim(lane.parameters["pitch_error"].values) == 0
    with pytest.raises(FileError, match="a single lane is no result file"):
        lane.save(tmp_path / "lane.h5")


def test_what_was_fixed_is_kept_in_the_file_of_a_slice(tmp_path) -> None:
    result = result_over(AXES["two parameters, several starts"])
    part = result.sel(load=LOADS.values[1]).sel(start=1)
    assert part.fixed == {"load": LOADS.values[1], "start": 1.0}
    part.save(tmp_path / "part.h5")
    assert open_result(tmp_path / "part.h5").fixed == part.fixed
    with h5py.File(tmp_path / "part.h5", "r+") as file:
        file.attrs["fixed"] = "load=much"
    with pytest.raises(FileError, match=r"is damaged \(could not convert string to float"):
        open_result(tmp_path / "part.h5")


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.data())
def test_a_range_of_lanes_is_cut_into_boxes(shape: list[int], data: Any) -> None:
    lanes = math.prod(shape)
    first = data.draw(st.integers(0, lanes - 1))
    last = data.draw(st.integers(first + 1, lanes))
    numbers = np.arange(lanes).reshape(shape)
    boxes = list(hyperslabs(first, last, shape))
    together = np.concatenate([numbers[box].ravel() for box in boxes])
    np.testing.assert_array_equal(together, np.arange(first, last))
    assert len(boxes) <= 2 * len(shape) - 1


@pytest.mark.parametrize("size", [1, 5, 13])
def test_flat_blocks_of_any_size_become_the_same_file(axes, size: int, tmp_path: Path) -> None:
    variables = variables_over(axes)
    flat = flat_arrays(variables, axes)
    lanes = flat["status"].size
    blocks = (
        (first, min(first + size, lanes), {k: v[first : first + size] for k, v in flat.items()})
        for first in range(0, lanes, size)
    )
    write_result(tmp_path / "r.h5", variables, blocks, {}, {})
    result = open_result(tmp_path / "r.h5")
    for name, values in flat.items():
        np.testing.assert_array_equal(result.lanes(name), values)


def test_chunks_follow_the_order_of_the_lanes(tmp_path: Path) -> None:
    many = coordinate("load", "1", "load", "", np.arange(700.0))
    more = coordinate("pitch_error", "1", "pitch error", "", np.arange(300.0))
    variables = [v for v in variables_over((many, more)) if not v.name.startswith("section")]
    write_result(tmp_path / "r.h5", variables, [], {}, {})
    with h5py.File(tmp_path / "r.h5") as file:
        assert file["lyapunov_exponent"].chunks == (218, 300)
        assert file["status"].chunks == (700, 300)


@pytest.mark.parametrize(
    ("attribute", "value", "words"),
    [
        ("axes", "", "does not name its axes"),
        ("axes", "load load", "does not name its axes"),
        ("axes", "pitch_error load", r"should be float64 over \(pitch_error, load"),
        ("axes", "load", "float64 over"),
        ("schema_version", "1.0", r"has version '1\.0' .* reads 3\.x; run the sweep again"),
    ],
)
def test_axes_that_contradict_the_arrays_are_refused(attribute, value, words, tmp_path) -> None:
    result_over(AXES["two parameters"]).save(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        file.attrs[attribute] = value
    with pytest.raises(FileError, match=words):
        open_result(tmp_path / "r.h5")


@pytest.mark.parametrize("values", [[0.1, 0.3, 0.3], [0.3, 0.2, 0.1], [0.1, 0.2, np.nan]])
def test_a_coordinate_that_repeats_a_value_is_refused(values, tmp_path) -> None:
    result_over(AXES["two parameters"]).save(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        file["load"][...] = values
    with pytest.raises(FileError, match="values of load that do not ascend"):
        open_result(tmp_path / "r.h5")
