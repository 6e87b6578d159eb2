"""A result file keeps the saved data, and any program for HDF5 or netCDF can read it."""

import math
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr

from gearchaos.models.gear_pair.outputs import CATALOGUE, STATE_SUBJECTS
from gearchaos.outputs.catalogue import CONTROL_PART, DIMENSION_PART
from gearchaos.outputs.names import axis_name
from gearchaos.outputs.variable import Variable, coordinate
from gearchaos.results.reading.result import Result, open_result

from .listed_variables import parameter, sweep_variables

LANES = 300
POINTS = 1000
STATES = ("delta_5", "delta_5_rate")
SIZES = {"section_point": POINTS, "state": len(STATES), "exponent": len(STATES), "order": 2}


def swept(parameter: str = "pitch_error", count: int = LANES) -> Variable:
    values = np.linspace(-1.0, 4.0, count)
    return coordinate(axis_name(parameter), "1", "pitch error", "$P$", values)


def make_result(*axes: Variable, **metadata: Any) -> Result:
    axes = axes or (swept(),)
    variables = sweep_variables(
        axes,
        states=STATES,
        section=["delta_5"],
        section_points=POINTS,
        lyapunov=True,
        status_meanings=["ok", "diverged"],
        crossings=True,
        contact=["tangential"],
        loads=["tangential"],
        chosen=["delta_1"],
        orders=[Fraction(1, 2), Fraction(1)],
        exponents=True,
        check_meanings=["not_checked", "same", "changed"],
        motion_meanings=["periodic", "chaotic"],
        record_meanings=["uniform", "mixed"],
    )
    random = np.random.default_rng(1)
    lanes = math.prod(axis.values.size for axis in axes)
    data: dict[str, Any] = {
        v.name: random.normal(size=(lanes, *(SIZES[dim] for dim in v.dims[len(axes) :])))
        for v in variables
        if v.values is None
    }
    data["unsplit_steps"] = np.zeros(lanes)
    data["motion_changed"] = np.arange(lanes) % 3
    data["contact_state_tangential"] = np.arange(lanes) % 4
    data["motion"] = data["period"] = data["record"] = np.arange(lanes) % 2
    data["status"] = (np.arange(lanes) == 7).astype(np.uint8)
    data["diverged_period"] = np.where(data["status"], 12, -1)
    data["section_delta_5"][7] = data["lyapunov_exponent"][7] = np.nan
    parameters = {
        "load": parameter("load", 0.1, "given", "1", "static load", "$f_n$"),
        "pitch_error": parameter(
            "pitch_error", axes[-1].values, "swept", "1", "pitch error", "$P$", (axes[-1].name,)
        ),
        "stiffness_cosine": parameter(
            "stiffness_cosine",
            np.array([0.3, 0.2, 0.1]),
            "derived",
            "1",
            "cosine",
            "$a$",
            ("harmonic",),
        ),
    }
    texts = {
        "title": "Δ sweep",
        "effects": "pitch_error backlash",
        "threads": 2,
        "wall_time_seconds": 1.5,
        "configuration": "# every line counts\n" * 10_000,
        "configuration_resolved": "[scene]\n",
    }
    names = [axis.name for axis in axes]
    return Result(names, variables, data, parameters, texts | metadata)


@pytest.fixture(scope="module")
def result() -> Result:
    return make_result()


@pytest.fixture(scope="module")
def path(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("result") / "sweep.h5"
    result.save(path)
    return path


def assert_same(one: Result, other: Result) -> None:
    assert list(one) == list(other)
    assert one.metadata == other.metadata
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], strict=True)
        assert one.dims(name) == other.dims(name)
        np.testing.assert_equal(one.attributes(name), other.attributes(name))
    assert list(one.parameters) == list(other.parameters)
    for name, entry in one.parameters.items():
        np.testing.assert_equal(vars(entry), vars(other.parameters[name]))


def test_what_is_read_is_what_was_saved(result: Result, path: Path) -> None:
    assert_same(open_result(path), result)


def test_what_was_read_can_be_saved_again(path: Path, tmp_path: Path) -> None:
    first = open_result(path)
    first.save(tmp_path / "again.h5")
    assert_same(open_result(tmp_path / "again.h5"), first)


def test_a_dotted_parameter_gives_its_axis_underscores(tmp_path: Path) -> None:
    make_result(swept("operation.speed_rpm")).save(tmp_path / "speed.h5")
    speed = open_result(tmp_path / "speed.h5")
    assert speed.axis == "operation_speed_rpm"
    assert speed.dims("status") == ("operation_speed_rpm",)


def test_a_name_that_is_not_there_is_reported_with_those_that_are(result: Result) -> None:
    with pytest.raises(KeyError, match=r"'delta'.*pitch_error, section_point"):
        result["delta"]


def test_texts_that_hdf5_cannot_hold_lose_nothing_else(tmp_path: Path) -> None:
    odd = make_result(title="a\0b\udc80c", note="x" * 70_000)
    long_name = replace(odd.variables["status"], long_name="a\0b\udc80c")
    odd.variables["status"] = long_name
    odd.save(tmp_path / "odd.h5")
    assert open_result(tmp_path / "odd.h5").attributes("status")["long_name"] == "a\ufffdb?c"
    metadata = open_result(tmp_path / "odd.h5").metadata
    assert metadata["title"] == "a\ufffdb?c"
    assert metadata["note"] == "x" * 70_000


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_xarray_reads_it_as_the_same_labelled_arrays(
    engine: Any, path: Path, result: Result
) -> None:
    with xr.open_dataset(path, engine=engine, mask_and_scale=False) as dataset:
        assert set(dataset.variables) == {*result, "harmonic", "configuration"}
        assert set(dataset.coords) == {
            "pitch_error",
            "section_point",
            "state",
            "exponent",
            "order",
            "harmonic",
        }
        assert dataset.attrs["title"] == "Δ sweep"
        assert dataset.attrs["threads"] == 2
        assert dataset.attrs["configuration_resolved"] == result.metadata["configuration_resolved"]
        # The text is too long for an attribute; h5netcdf returns it as bytes.
        text = dataset["configuration"].item()
        text = text.decode() if engine == "h5netcdf" else text
        assert text == result.metadata["configuration"]
        for name in result:
            np.testing.assert_array_equal(dataset[name].values, result[name])
            assert dataset[name].dims == result.dims(name)
            assert dataset[name].attrs["units"] == "1"
        named = dataset.assign_coords(state=dataset.state.flag_meanings.split())
        middle = named["end_state"].sel(state="delta_5_rate").isel(pitch_error=4)
        assert middle.item() == result["end_state"][4, 1]


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_xarray_masks_what_is_not_there(engine: Any, path: Path) -> None:
    with xr.open_dataset(path, engine=engine) as dataset:
        assert np.flatnonzero(dataset["diverged_period"].notnull()).tolist() == [7]
        assert dataset["diverged_period"][7] == 12
    with xr.open_dataset(path, engine=engine, group="parameters") as parameters:
        assert parameters["load"].attrs == {
            "units": "1",
            "long_name": "static load",
            "symbol": "$f_n$",
            "origin": "given",
        }
        assert parameters["stiffness_cosine"].dims == ("harmonic",)
        assert parameters["pitch_error"].dims == ("pitch_error",)


def test_netcdf_finds_real_dimensions_only(path: Path, result: Result) -> None:
    with netCDF4.Dataset(path) as file:
        sizes = {name: dimension.size for name, dimension in file.dimensions.items()}
        assert sizes == {
            "pitch_error": LANES,
            "section_point": POINTS,
            "state": len(STATES),
            "harmonic": 3,
            "exponent": len(STATES),
            "order": 2,
        }
        assert not file.groups["parameters"].dimensions
        assert [name for name in file.variables if name in result] == list(result)
        status = file.variables["status"]
        assert status.flag_meanings.split() == ["ok", "diverged"]
        assert status.flag_values.dtype == status.dtype == np.uint8


def test_every_dataset_follows_the_rules_of_the_format(path: Path) -> None:
    with h5py.File(path) as file:
        assert (file.attrs["axes"], file.attrs["axis"]) == (b"pitch_error", b"pitch_error")
        assert file.libver[0] == "earliest"
        assert file.attrs["Conventions"] == b"CF-1.9"
        assert (file.attrs["schema"], file.attrs["schema_version"]) == (b"gearchaos-sweep", b"3.2")
        datasets: list[h5py.Dataset] = []
        file.visititems(lambda _, item: datasets.append(item) if hasattr(item, "shape") else None)
        assert len(datasets) == 53
        for dataset in datasets:
            assert {"units", "long_name"} <= set(dataset.attrs)
            assert dataset.dtype.kind == "S" or dataset.dtype.str in {"<f8", "<i4", "|u1"}
            texts = [dataset.attrs.get_id(name).dtype for name in {"units", "long_name"}]
            assert {text.kind for text in texts} == {"S"}
            if "_FillValue" in dataset.attrs:
                assert dataset.attrs["_FillValue"].dtype == dataset.dtype
                np.testing.assert_equal(dataset.attrs["_FillValue"][0], dataset.fillvalue)
            if dataset.ndim and not dataset.is_scale:
                names = [dim[0].name.lstrip("/") for dim in dataset.dims]
                assert dataset.attrs["dims"].decode().split() == names
            if dataset.is_scale:
                assert dataset.attrs["NAME"].decode() == dataset.name.lstrip("/")
            else:
                assert [len(dim) for dim in dataset.dims] == [1] * dataset.ndim
            if dataset.chunks:
                assert (dataset.compression, dataset.compression_opts) == ("gzip", 4)
                assert dataset.shuffle
                assert dataset.fletcher32


def test_chunks_hold_whole_rows_and_are_neither_small_nor_large(path: Path) -> None:
    with h5py.File(path) as file:
        lanes, points = file["section_delta_5"].chunks
        assert points == POINTS
        assert 2**18 <= lanes * points * 8 <= 2**20
        assert file["status"].chunks == (LANES,)


def run(program: str, *arguments: str | Path) -> str:
    if shutil.which(program) is None:
        pytest.skip(f"the program {program} is not installed")
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_h5dump_shows_a_variable_with_its_filters(path: Path) -> None:
    text = run("h5dump", "-p", "-d", "/status", path)
    assert "H5T_STD_U8LE" in text
    assert "CHECKSUM FLETCHER32" in text
    assert '"diverged_period"' not in text
    assert '"ok diverged"' in text
    run("h5dump", path)


def test_ncdump_shows_the_dimensions(path: Path) -> None:
    text = run("ncdump", "-h", path)
    assert f"pitch_error = {LANES} ;" in text
    assert "double section_delta_5(pitch_error, section_point) ;" in text
    run("ncdump", path)


def test_octave_loads_all_of_it(path: Path, result: Result) -> None:
    # If Octave cannot load a dataset, it prints an error on stderr and its exit code is 0.
    program = (
        f"s = load('{path}'); printf('%.17g %.17g ', s.section_delta_5(3, 5), s.parameters.load);"
        "printf('%d ', size(s.end_state), s.state, s.status(8), columns(s.configuration));"
        "printf('%s', s.configuration(1:18))"
    )
    text = run("octave-cli", "--norc", "--no-history", "--eval", program)
    configuration = result.metadata["configuration"]
    expected = [result["section_delta_5"][4, 2], 0.1, 2, LANES, 0, 1, 1, len(str(configuration))]
    *numbers, comment = text.split(maxsplit=len(expected))
    assert [float(number) for number in numbers] == expected
    assert str(configuration).startswith(comment)


def test_the_last_line_is_a_checksum_that_standard_tools_confirm(path: Path) -> None:
    if not all(map(shutil.which, ("sh", "head", "tail", "sha256sum"))):
        pytest.skip("sh, head, tail and sha256sum are not all installed")
    line = run("tail", "-c", "82", path)
    command = 'head -c "-82" "$1" | sha256sum'
    assert run("sh", "-c", command, "sh", path).split()[0] == line.split()[-1]


def test_another_program_may_change_the_file(path: Path, tmp_path: Path) -> None:
    changed = tmp_path / "changed.h5"
    shutil.copy(path, changed)
    with h5py.File(changed, "r+") as file:
        file["parameters/load"][()] = 0.2
    assert open_result(changed).parameters["load"].values == 0.2
    with h5py.File(changed, "r+") as file:
        file.attrs["note"] = "seen by a referee"
        file.create_dataset("reference", data=np.arange(3.0))
        file["reference"].make_scale("reference")
    again = open_result(changed)
    assert again.metadata["note"] == "seen by a referee"
    assert again["reference"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("length", [1, 10_000])
@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_xarray_may_write_the_file_anew(engine: Any, length: int, tmp_path: Path) -> None:
    # Both engines store some texts with a variable length, netcdf4 only texts beyond ASCII.
    small = make_result(swept(count=8), configuration="# é\n" * length)
    small.save(tmp_path / "sweep.h5")
    with xr.open_datatree(tmp_path / "sweep.h5", engine=engine) as tree:
        tree.load().to_netcdf(tmp_path / "tree.h5", engine=engine)
    with xr.open_dataset(tmp_path / "sweep.h5", engine=engine) as root:
        root.load().to_netcdf(tmp_path / "root.h5", engine=engine)
    small.to_xarray().to_netcdf(tmp_path / "made.h5", engine=engine)
    # In a tree, the swept parameter is a coordinate of the whole; the parameters lack it.
    left = {"tree": small.parameters.keys() - {"pitch_error"}}
    for name in ("tree", "root", "made"):
        anew = open_result(tmp_path / f"{name}.h5")
        assert anew.metadata.items() >= small.metadata.items()
        assert anew.parameters.keys() == left.get(name, set())
        assert set(anew) == set(small)
        for name in small:
            np.testing.assert_array_equal(anew[name], small[name], strict=True)
            assert anew.dims(name) == small.dims(name)
            np.testing.assert_equal(anew.attributes(name), small.attributes(name))


def test_what_has_an_error_names_where_it_is_reported(path: Path) -> None:
    with xr.open_dataset(path) as dataset:
        named = {
            name: variable.attrs["ancillary_variables"].split()
            for name, variable in dataset.items()
            if "ancillary_variables" in variable.attrs
        }
    assert named == {
        "section_delta_5": ["section_error"],
        "lyapunov_exponent": ["lyapunov_exponent_standard_error", "exponent_step_error"],
        "lyapunov_exponents": ["lyapunov_exponents_standard_error"],
    }


def test_every_state_has_a_wording_of_its_own() -> None:
    assert len({(one.long_name, one.symbol) for one in STATE_SUBJECTS}) == len(STATE_SUBJECTS) == 10


def test_the_documented_variables_are_those_that_are_written() -> None:
    page = (Path(__file__).parents[2] / "docs" / "file-format.md").read_text(encoding="utf-8")
    page, _, _ = page.partition("## The file of branches")
    lines = re.findall(r"^\| `\w+` \| \(.*$", page, re.M)
    rows = [[cell.strip(" `") for cell in line.split("|")[1:5]] for line in lines]
    documented = {name: (dims.strip("()"), dtype, fill) for name, dims, dtype, fill in rows}
    repeats = [CATALOGUE.axis(name, np.arange(2)) for name in ("realisation", "start", "direction")]
    result = make_result(swept("load", 3), swept(count=4), *repeats)
    short = {"load": "B", "pitch_error": "A", "section_delta_5": "section_STATE"}
    ends = "delta_1_smallest", "delta_1_largest", "delta_1_peak_to_peak", "amplitude_delta_1"
    short |= {name: name.replace("delta_1", "STATE") for name in ends}
    for name, variable in result.variables.items():
        dims = ", ".join(variable.dims).replace(", ".join(result.axes), "axes")
        fill = "" if variable.fill_value is None else str(variable.fill_value)
        described = (short.get(dims, dims), variable.dtype, fill.replace("nan", "NaN"))
        assert documented.pop(short.get(name, name)) == described
    # The result above lacks the outputs of these parts: compare them with the catalogue.
    for output in (*DIMENSION_PART.outputs, *CONTROL_PART.outputs):
        fill = "" if output.fill_value is None else "NaN"
        assert documented.pop(output.name) == ("axes", output.dtype, fill)
    assert set(documented) == {"harmonic"}
