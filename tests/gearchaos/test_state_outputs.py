"""Extremes and amplitudes of a lane: names, files, units, the waterfall, and refusals."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import gearchaos
from gearchaos import load_config
from gearchaos.figures import waterfall
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.plot import main as plot

from .commands import run_module
from .short_sweeps import PAN2021, SHORT
from .test_contact_outputs import AXIAL

ASKED = (
    *SHORT,
    *AXIAL,
    "outputs.states=['delta_5','delta_1_rate']",
    "outputs.orders=[1,'1/2','2/4','3/2',2]",
    "outputs.loads=true",
    "outputs.contact=true",
    "integration.transient_periods=200",
    'sweep={parameter="pitch_error",values=[0.3,5.86,9.0,10.75]}',
)
SIGNALS = ("delta_5", "delta_1_rate", "transmission_error")


@pytest.fixture(scope="module")
def result():
    return gearchaos.run(load_config(PAN2021, ASKED))


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("states")
    settings = [f"--set={one}" for one in ASKED]
    assert run_module("gearchaos.sweep", str(PAN2021), *settings, cwd=folder).code == 0
    return next(folder.glob("*.h5"))


def test_a_file_keeps_what_is_reported(result, path):
    kept = gearchaos.open_result(path)
    assert kept["order"].tolist() == [0.5, 1.0, 1.5, 2.0]
    names = [f"amplitude_{name}" for name in SIGNALS]
    assert all(kept.dims(name) == ("pitch_error", "order") for name in names)
    ends = ("smallest", "largest", "peak_to_peak")
    names += [f"{state}_{end}" for state in SIGNALS[:2] for end in ends]
    for name in names:
        assert np.isfinite(result[name]).all()
        assert np.array_equal(kept[name], result[name]), name
    smallest, largest, height = (result[f"delta_5_{end}"] for end in ends)
    section = result["section_delta_5"]
    assert (smallest <= section.min(axis=1)).all()
    assert (largest >= section.max(axis=1)).all()
    assert height == pytest.approx(largest - smallest)
    error = result["amplitude_transmission_error"]
    # The lines of a motion have at most the mean square of the whole motion.
    squares = (error**2).sum(axis=1) / 2.0
    assert (squares <= result["transmission_error_rms"] ** 2 * (1.0 + 1e-6)).all()
    assert squares == pytest.approx(result["transmission_error_rms"] ** 2, rel=0.05)


def test_a_dry_run_needs_no_whole_cycles(tmp_path):
    settings = [f"--set={one}" for one in ASKED]
    ended = run_module("gearchaos.sweep", str(PAN2021), *settings, "--dry-run", cwd=tmp_path)
    assert (ended.code, ended.out) == (0, "")
    assert "time:       about" in ended.err


def test_half_an_order_rises_where_the_period_doubles(result):
    assert result["period"].tolist() == [1, 1, 1, 2]
    half = result["amplitude_transmission_error"][:, 0]
    assert (half[:3] < 1e-3).all()
    assert half[3] > 0.1


def test_a_lane_that_diverged_has_none():
    far = 'start={kind="given",state={delta_5=1e150}}'
    result = gearchaos.run(load_config(PAN2021, (*ASKED, far)))
    assert (result["status"] == 1).all()
    assert np.isnan(result["delta_5_largest"]).all()
    assert np.isnan(result["amplitude_delta_5"]).all()
    drawn = waterfall(Figure().add_subplot(), result, "amplitude_delta_5").get_array()
    assert np.ma.getmaskarray(drawn).all()


def test_they_are_in_physical_units():
    for name, units in (
        ("delta_5_peak_to_peak", "um"),
        ("delta_1_rate_largest", "m/s"),
        ("amplitude_delta_1_rate", "m/s"),
        ("amplitude_transmission_error", "um"),
    ):
        assert CATALOGUE.scale_of(name).units == units


def test_the_waterfall_has_a_row_for_each_order(result, path, capsys):
    axes = Figure().add_subplot()
    image = waterfall(axes, result, "amplitude_delta_5")
    assert image.get_array().shape == (4, 4)
    assert [label.get_text() for label in axes.get_yticklabels()] == ["1/2", "1", "3/2", "2"]
    # Values more than five decades below the largest one are not drawn.
    most = result["amplitude_delta_5"].max()
    assert image.get_array().min() == pytest.approx(max(1e-5 * most, image.norm.vmin))
    assert image.get_array().max() == most == image.norm.vmax
    with pytest.raises(gearchaos.FigureError, match=r"'nothing'.*amplitude_transmission_error"):
        waterfall(axes, result, "nothing")
    with pytest.raises(gearchaos.FigureError, match=r"drawn of one result.*--at"):
        waterfall(axes, result, "amplitude_delta_5")
    assert plot([str(path), "--variable=amplitude_transmission_error", "--format=png"]) == 0
    assert capsys.readouterr().out.strip().endswith("amplitude_transmission_error.png")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            ["outputs.orders=['1/0']"],
            r"orders\[0\] = \"1/0\": has .* fractions of two",
        ),
        (["outputs.orders=[0.5]"], r"orders\[0\] = \"0.5\": has .*such as \[\"1/3\""),
        (["outputs.states=['delta_3']"], r'outputs\.states.*no state `delta_3`; add "axial"'),
    ],
)
def test_what_cannot_be_reported_is_refused(settings, message):
    with pytest.raises(gearchaos.ConfigurationError, match=message):
        load_config(PAN2021, settings)


def test_too_few_steps_for_an_order_are_refused_with_a_remedy():
    config = load_config(PAN2021, (*SHORT, "outputs.orders=[48,'1/2',1]"))
    with pytest.raises(gearchaos.ConfigurationError, match=r"orders: 48: .* orders below 48"):
        gearchaos.run(config)
