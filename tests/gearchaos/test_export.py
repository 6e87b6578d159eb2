"""A result as xarray, pandas and MATLAB see it holds what its file holds."""

import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

import gearchaos
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.export import main
from gearchaos.figures import amplitude_spectrum, time_history
from gearchaos.figures.response import spectrum_of
from gearchaos.outputs.variable import Variable
from gearchaos.results.reading.result import open_result

from .commands import LINEAR, run_module, small_config
from .test_result_axes import AXES, result_over

SCALED = {
    "section_delta_5": " [b']",
    "lyapunov_exponent": " [per unit of tau]",
    "lyapunov_exponent_standard_error": " [per unit of tau]",
}
RESULT = result_over(AXES["two parameters, several starts"])
SPEEDS = 4000.0, 8000.0


@pytest.fixture
def path(tmp_path):
    RESULT.save(tmp_path / "r.h5")
    return tmp_path / "r.h5"


def test_the_dataset_is_that_which_xarray_makes_of_the_file(path):
    xarray = pytest.importorskip("xarray")
    ours = open_result(path).to_xarray()
    with xarray.open_dataset(path) as theirs:
        assert dict(ours.sizes).items() <= dict(theirs.sizes).items()
        for name in ours.variables:
            assert ours[name].dims == theirs[name].dims
            np.testing.assert_array_equal(ours[name], theirs[name])
            assert ours[name].attrs["long_name"] == theirs[name].attrs["long_name"]


def test_a_table_has_a_row_per_lane_and_words_for_flags():
    pytest.importorskip("pandas")
    table = RESULT.to_dataframe()
    assert table.index.names == ["load", "pitch_error", "start"]
    at = (RESULT["load"][1], 1.5, 1)
    lane = RESULT.sel(load=at[0], pitch_error=1.5, start=1)
    assert table["lyapunov_exponent"].xs(at) == lane["lyapunov_exponent"]
    assert table["motion"].xs(at) == ("periodic", "chaotic")[int(lane["motion"])]
    points = RESULT.to_dataframe("section_point")
    assert list(points.columns) == ["section_delta_5"]
    np.testing.assert_array_equal(points["section_delta_5"], RESULT["section_delta_5"].ravel())
    with pytest.raises(ConfigurationError, match=r"time: no values along it; .*section_p"):
        RESULT.to_dataframe("time")
    one = RESULT.sel(load=0.1, start=0).to_dataframe()
    assert one.index.name == "pitch_error"


def test_a_table_of_lanes_names_the_option_for_amplitudes(path, tmp_path, capsys):
    pytest.importorskip("pandas")
    lanes = RESULT["lyapunov_exponent"].shape
    added = {"order": np.array([0.5, 1.0]), "amplitude_delta_5": np.ones((*lanes, 2))}
    variables = [
        *RESULT.variables.values(),
        Variable("order", ("order",), "float64", "1", "frequency over mesh frequency"),
        Variable("amplitude_delta_5", (*RESULT.axes, "order"), "float64", "1", "amplitude"),
    ]
    data = {name: RESULT[name] for name in RESULT.variables} | added
    other = gearchaos.Result(RESULT.axes, variables, data, RESULT.parameters, RESULT.metadata)
    other.save(tmp_path / "orders.h5")
    for file, names in ((tmp_path / "orders.h5", True), (path, False)):
        assert main([str(file), str(file.with_suffix(".csv"))]) == 0
        assert ("--along order" in capsys.readouterr().err) == names


def test_a_flag_without_a_meaning_is_missing_in_the_table():
    pytest.importorskip("pandas")
    result = result_over(AXES["one start"])
    flags = result["motion"].copy()
    flags[2:4] = 2, 255
    result._data["motion"] = flags
    told = result.to_dataframe()["motion"]
    assert told.isna().tolist() == [False, False, True, True, False, False, False]


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("along", [(), ("section_point",)])
def test_tables_as_files_come_back_as_they_were(path, ending, along, capsys):
    pandas = pytest.importorskip("pandas")
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    target = path.with_suffix(f".{ending}")
    asked = [word for name in along for word in ("--along", name)]
    assert main([str(path), str(target), *asked]) == 0
    assert capsys.readouterr().out == f"{target}\n"
    if ending == "csv":
        # The default of pandas 2 is off in the last digit.
        exact = {"float_precision": "round_trip"} if pandas.__version__ < "3" else {}
        read = pandas.read_csv(target, **exact)
    else:
        read = pandas.read_parquet(target).reset_index()
    wanted = RESULT.to_dataframe(*along).reset_index()
    # In a CSV file every column of numbers has its unit.
    units = {name: "" if RESULT.variables[name].flags else " [1]" for name in wanted}
    units = {
        name: SCALED.get(name, unit) if ending == "csv" else "" for name, unit in units.items()
    }
    assert list(read.columns) == [f"{name}{unit}" for name, unit in units.items()]
    for name, unit in units.items():
        column = read[f"{name}{unit}"].to_numpy()
        np.testing.assert_array_equal(column, wanted[name].to_numpy())


def test_decimal_commas_come_with_semicolons_and_in_csv_only(path, capsys):
    pandas = pytest.importorskip("pandas")
    target = path.with_suffix(".csv")
    assert main([str(path), str(target), "--decimal", ","]) == 0
    read = pandas.read_csv(target, sep=";", decimal=",")
    wanted = RESULT.to_dataframe().reset_index()
    np.testing.assert_allclose(read.iloc[:, 0], wanted["load"], rtol=1e-15)
    assert "," in target.read_text().splitlines()[1] and len(read.columns) == len(wanted.columns)
    assert main([str(path), str(path.with_suffix(".mat")), "--decimal", ","]) == 2
    assert "--decimal ,: is for .csv only" in capsys.readouterr().err


def test_matlab_gets_every_array_by_its_name(path):
    io = pytest.importorskip("scipy.io")
    assert main([str(path), str(path.with_suffix(".mat"))]) == 0
    read = io.loadmat(path.with_suffix(".mat"))
    for name in RESULT:
        np.testing.assert_array_equal(np.squeeze(read[name]), np.squeeze(RESULT[name]))
    assert [str(word[0]) for word in read["motion_meanings"].ravel()] == ["periodic", "chaotic"]


@pytest.mark.parametrize(
    ("target", "code", "message"),
    [("r.xlsx", 2, "must end in .csv"), ("r.h5", 2, "must end in"), ("old.csv", 4, "--overwrite")],
)
def test_what_cannot_be_written_is_reported_and_nothing_is_lost(
    path, target, code, message, capsys
):
    (path.parent / "old.csv").write_text("mine")
    assert main([str(path), str(path.parent / target)]) == code
    assert message in capsys.readouterr().err
    assert (path.parent / "old.csv").read_text() == "mine"


@pytest.mark.parametrize(("ending", "package"), [("csv", "pandas"), ("mat", "scipy")])
def test_a_package_that_is_missing_is_named_with_the_remedy(
    path, ending, package, monkeypatch, capsys
):
    for name in (package, f"{package}.io"):
        monkeypatch.setitem(sys.modules, name, None)
    assert main([str(path), str(path.with_suffix(f".{ending}"))]) == 4
    assert f'{package} is not installed; pip install "gearchaos[export]"' in capsys.readouterr().err
    assert [one.name for one in path.parent.iterdir()] == ["r.h5"]
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(FileError, match="xarray is not installed"):
        RESULT.to_xarray()


def test_a_notebook_shows_a_table_of_the_variables():
    shown = RESULT._repr_html_()
    assert shown.count("<tr>") == len(RESULT) and "&lt;Result" in shown


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    """Compute a response of the small pair as a user does."""
    folder = tmp_path_factory.mktemp("motion")
    small_config(folder)
    given = ("gears.toml", "--at", "2.0", "--periods", "6", *LINEAR)
    assert run_module("gearchaos.response", *given, cwd=folder).code == 0
    return folder / "gears_response.h5"


def exported(motion, capsys, *arguments: str):
    pandas = pytest.importorskip("pandas")
    target = motion.with_name("table.csv")
    assert main([str(motion), str(target), "--overwrite", *arguments]) == 0
    return pandas.read_csv(target), capsys.readouterr().err


def test_a_response_is_exported_over_time_in_seconds(motion, capsys):
    result = open_result(motion)
    table, said = exported(motion, capsys)
    # 8000 rpm and 21 teeth: 2800 mesh periods a second.
    np.testing.assert_allclose(table["time [s]"], result["time"] / 2800.0, rtol=1e-12)
    # The length scale is 25 um.
    np.testing.assert_allclose(table["delta_5 [um]"], 25.0 * result["delta_5"][0], rtol=1e-12)
    assert {"delta_5_rate [m/s]", "mesh_force_tangential [N]", "contact_tangential"} <= {*table}
    assert f"{result['time'].size} rows" in said
    table, _ = exported(motion, capsys, "--units", "dimensionless")
    np.testing.assert_allclose(table["delta_5 [b']"], result["delta_5"][0], rtol=1e-14)
    assert {"time [1]", "delta_5_rate [b' omega_h]", "mesh_force_tangential [k_m b']"} <= {*table}
    lanes, said = exported(motion, capsys, "--along", "lane")
    assert len(lanes) == 1 and "1 row of" in said


def test_spectra_are_exported_over_hertz(motion, capsys):
    table, _ = exported(motion, capsys, "--spectrum")
    lines = table["frequency [Hz]"].to_numpy()
    # Lines are as far apart as six mesh periods are long.
    assert lines[1] == pytest.approx(2800.0 / 6.0) and lines[6] == pytest.approx(2800.0)
    result = open_result(motion)
    order, amplitude, _ = spectrum_of(result, 0, "delta_5")
    # The rounding of a transform is in proportion to its largest line.
    exact = {"rtol": 0.0, "atol": 1e-13 * 25.0 * amplitude.max()}
    np.testing.assert_allclose(table["amplitude_delta_5 [um]"], 25.0 * amplitude, **exact)
    np.testing.assert_allclose(lines, 2800.0 * order, rtol=1e-10)
    assert main([str(motion), str(motion.with_suffix(".mat")), "--spectrum"]) == 2
    assert "--spectrum: writes a table of a response" in capsys.readouterr().err


@pytest.fixture(scope="module")
def speeds(tmp_path_factory):
    """Compute a response of the small pair at two speeds as a user does."""
    folder = tmp_path_factory.mktemp("speeds")
    small_config(folder)
    given = [word for speed in SPEEDS for word in ("--at", f"operation.speed_rpm={speed:g}")]
    ran = run_module(
        "gearchaos.response", "gears.toml", *given, "--periods", "4", *LINEAR, cwd=folder
    )
    assert ran.code == 0, ran.err
    return folder / "gears_response.h5"


def of_speeds(table, name):
    return [table[name][table.iloc[:, 0] == speed].to_numpy() for speed in SPEEDS]


def test_each_speed_has_its_seconds_and_its_hertz(speeds, capsys):
    result, mesh_hertz = open_result(speeds), 21 * np.array(SPEEDS)[:, np.newaxis] / 60.0
    table, _ = exported(speeds, capsys)
    times = of_speeds(table, "time [s]")
    np.testing.assert_allclose(times, result["time"] / mesh_hertz, rtol=1e-12)
    table, _ = exported(speeds, capsys, "--spectrum")
    order, _, _ = spectrum_of(result, 0, "delta_5")
    lines = of_speeds(table, "frequency [Hz]")
    np.testing.assert_allclose(lines, order * mesh_hertz, rtol=1e-12)
    table, _ = exported(speeds, capsys, "--units", "dimensionless")
    assert table["time [1]"].max() == 4.0
    table, _ = exported(speeds, capsys, "--spectrum", "--units", "dimensionless")
    np.testing.assert_array_equal(of_speeds(table, "mesh_order [1]")[1], order)


def test_matlab_gets_the_seconds_of_each_speed(speeds):
    io = pytest.importorskip("scipy.io")
    target = speeds.with_suffix(".mat")
    assert main([str(speeds), str(target), "--overwrite"]) == 0
    read, result = io.loadmat(target), open_result(speeds)
    seconds = result["time"] / (21 * np.array(SPEEDS)[:, np.newaxis] / 60.0)
    np.testing.assert_allclose(read["time_seconds"], seconds, rtol=1e-12)
    np.testing.assert_array_equal(np.squeeze(read["time"]), result["time"])
    assert main([str(speeds), str(target), "--overwrite", "--units", "dimensionless"]) == 0
    assert "time_seconds" not in io.loadmat(target)
    target.unlink()


def test_options_that_do_nothing_are_refused(speeds, capsys):
    for ending, option in ((".mat", []), (".csv", ["--spectrum"])):
        target = speeds.with_suffix(ending)
        assert main([str(speeds), str(target), "--along", "state", *option]) == 2
        assert "--along state: " in capsys.readouterr().err
        assert not target.exists()
    _, said = exported(speeds, capsys, "--along", "state", "--units", "physical")
    assert "states along state are dimensionless" in said


def test_a_history_and_a_spectrum_are_drawn_in_ms_and_khz(motion):
    result = open_result(motion).physical()
    history, spectrum = Figure().subplots(1, 2)
    line = time_history(history, result, 0)
    np.testing.assert_allclose(line.get_xdata(), 1e3 * result["time"], rtol=1e-12)
    assert history.get_xlabel() == "Time, $t$ (ms)"
    amplitude_spectrum(spectrum, result, 0)
    assert spectrum.get_xlabel() == "Frequency, $f$ (kHz)"
    # Eight mesh orders.
    assert spectrum.get_xlim()[1] == pytest.approx(1.02 * 8 * 2.8)
    assert result["mesh_period"] == pytest.approx(1.0 / 2800.0)
    force = time_history(Figure().subplots(), result, 0, "mesh_force_tangential")
    assert force.axes.get_ylabel().endswith("(kN)")
    np.testing.assert_allclose(1e3 * force.get_ydata(), result["mesh_force_tangential"][0])
