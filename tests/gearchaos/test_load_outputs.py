"""The loads of a lane in a result: names, factors, and conditions for reporting them."""

import numpy as np
import pytest

import gearchaos
from gearchaos import load_config
from gearchaos.engine.kept import variables_of
from gearchaos.models.gear_pair.loads import load_outputs

from .commands import run_module
from .short_sweeps import PAN2021, SHORT, simulation
from .test_contact_outputs import AXIAL


def test_factors_are_those_of_the_static_force_in_the_direction_of_the_load():
    record = [[3.0, -1.0, 2.0, 5.0], [0.5, -0.5, 0.0, 0.1], [4.0, 1.0, 2.0, 4.25]]
    reported = load_outputs(
        np.array([record] * 3), np.array([2.0, -0.5, 0.0]), ["tangential", "axial"]
    )
    assert len(reported) == 2 * 4 + 5
    assert reported["load_factor_largest"] == pytest.approx([1.5, 2.0, np.nan], nan_ok=True)
    rms = np.sqrt(5.0)
    assert reported["load_factor_rms"] == pytest.approx([rms / 2.0, 2.0 * rms, np.nan], nan_ok=True)
    assert reported["mesh_force_rms_axial"] == pytest.approx([np.sqrt(0.1)] * 3)
    assert reported["transmission_error_peak_to_peak"] == pytest.approx([3.0] * 3)
    assert reported["transmission_error_rms"] == pytest.approx([0.5] * 3)


def test_the_record_is_raised_to_whole_cycles_of_the_orders():
    run = simulation("outputs.orders=['1/3', '1/2', 1, 2]", "integration.recorded_periods=500")
    assert run.plan.recorded_periods == 504
    assert any("recorded_periods raised from 500 to 504: whole" in note for note in run.notes)
    assert simulation("outputs.orders=['1/3', 2]").plan.recorded_periods == 12
    with pytest.raises(gearchaos.GearchaosError, match="orders: 48: must have more than two"):
        simulation("outputs.orders=[1, 48]")
    primes = ["1/41", "1/43", "1/47"]
    with pytest.raises(gearchaos.GearchaosError, match="a record of 82861 mesh periods"):
        simulation(f"outputs.orders={primes}")


def test_a_response_has_the_transmission_error_whose_statistics_a_sweep_reports():
    periods = 20
    lengths = ("integration.transient_periods=60", f"integration.recorded_periods={periods}")
    asked = (*SHORT, "outputs.loads=true", *lengths, "sweep.count=3", *AXIAL)
    result = gearchaos.respond(load_config(PAN2021, asked), periods)
    error = result["transmission_error"]
    assert np.abs(result["mesh_error"]).max() > 0.0
    np.testing.assert_allclose(error, result["delta_5"] + result["mesh_error"], atol=1e-14)
    # Means are trapezoidal sums; extremes include values between the steps.
    mean = np.trapezoid(error) / (error.shape[1] - 1)
    square = np.trapezoid((error - mean[:, np.newaxis]) ** 2) / (error.shape[1] - 1)
    known = {"mean": mean, "rms": np.sqrt(square), "peak_to_peak": np.ptp(error, axis=1)}
    for name, values in known.items():
        reported = result[f"transmission_error_{name}"]
        assert reported == pytest.approx(values, rel=1e-3 if name == "peak_to_peak" else 1e-5), name
    assert result.attributes("transmission_error")["symbol"] == r"$\delta_5 + e$"


def test_a_sweep_reports_them_and_its_file_keeps_them(tmp_path):
    lengths = ("integration.transient_periods=60", "sweep.count=6")
    asked = (*SHORT, "outputs.loads=true", "outputs.contact=true", *lengths, *AXIAL)
    result = gearchaos.run(load_config(PAN2021, asked))
    reported = ("mesh_force", "load_factor", "transmission_error")
    names = [name for name in result.variables if name.startswith(reported)]
    assert len(names) == 2 * 4 + 5
    both = simulation("outputs.loads=true", "outputs.contact=true")
    without = [variable.name for variable in variables_of(both)]
    assert {*without} == {name for name in result.variables if not name.endswith("_axial")}
    # Over a record the mean force balances the load, except for momentum that the mass gains.
    assert result["mesh_force_mean_tangential"] == pytest.approx(
        result["mesh_force_largest_tangential"] / result["load_factor_largest"], rel=0.1
    )
    assert (result["load_factor_largest"] > result["load_factor_rms"]).all()
    assert (result["load_factor_rms"] > 1.0).all()
    settings = [f"--set={one}" for one in asked]
    assert run_module("gearchaos.sweep", str(PAN2021), *settings, cwd=tmp_path).code == 0
    kept = gearchaos.open_result(next(tmp_path.glob("*.h5")))
    for name in names:
        assert np.array_equal(kept[name], result[name], equal_nan=True), name
    # Extremes of a state are recorded because other tests have already compiled this loop.
    more = "integration.method=flow_map", "outputs.states=['delta_5']"
    exact = gearchaos.run(load_config(PAN2021, (*asked, *more)))
    # The last two lanes are chaotic.
    for name in names:
        assert exact[name][:4] == pytest.approx(result[name][:4], rel=1e-4, abs=1e-4), name
