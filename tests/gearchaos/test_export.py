"""A result as xarray, pandas and MATLAB see it holds what its file holds."""

import sys

import numpy as np
import pytest

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.export import main
from gearchaos.results.reading.result import open_result

from .test_result_axes import AXES, result_over

RESULT = result_over(AXES["two parameters, several starts"])


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
    assert list(read.columns) == list(wanted.columns)
    for name in wanted:
        np.testing.assert_array_equal(read[name].to_numpy(), wanted[name].to_numpy())


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
    assert f"{package} is not installed; pip install gearchaos[export]" in capsys.readouterr().err
    assert [one.name for one in path.parent.iterdir()] == ["r.h5"]
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(FileError, match="xarray is not installed"):
        RESULT.to_xarray()


def test_a_notebook_shows_a_table_of_the_variables():
    shown = RESULT._repr_html_()
    assert shown.count("<tr>") == len(RESULT) and "&lt;Result" in shown
