"""Results in physical units: factors, labels, and values that cannot be converted."""

import numpy as np
import pytest

import gearchaos
from gearchaos.dynamics.eigenfrequencies import eigenfrequencies
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.run_plan import plan_run
from gearchaos.export import main as export
from gearchaos.figures.labels import unit_of
from gearchaos.plot import main as plot
from gearchaos.sweep import main as sweep

from .commands import small_config
from .short_sweeps import PAN2021, SHORT

ASKED = (
    "outputs.loads=true",
    "outputs.contact=true",
    "outputs.section=['delta_5', 'delta_5_rate']",
    "pitch_error.phase_deg=0.0",
)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("physical")
    config = gearchaos.load_config(small_config(folder), ASKED)
    gearchaos.run(config).save(folder / "pair.h5")
    return folder / "pair.h5"


@pytest.fixture(scope="module")
def result(path):
    return gearchaos.open_result(path)


def test_what_a_mistaken_unit_makes_of_a_pair_is_reported(tmp_path):
    def notes(*overrides: str) -> str:
        given = (*ASKED, "integration.unstable=raise", *overrides)
        return " ".join(plan_run(gearchaos.load_config(small_config(tmp_path), given)).notes)

    assert "unlikely" not in notes()
    told = notes("pair.face_width_mm=0.02", "pitch_error.amplitude_um=8000.0", "sweep.to=1.0")
    assert "pitch error 8000 um, face width 0.02 mm: unlikely at a normal module of" in told
    # The warning begins at a tenth of the module, 216.6 um.
    assert "pitch error 225 um" in notes("pitch_error.amplitude_um=45.0")
    assert "unlikely" not in notes("pitch_error.amplitude_um=43.0")
    assert "static deflection" in notes("mesh.mean_stiffness_N_per_um_mm=0.01")


def test_a_dry_run_reports_frequency_and_deflection_of_the_pair(path, result, capsys):
    assert sweep([str(small_config(path.parent)), "--dry-run"]) == 0
    groups = result.parameters
    found = eigenfrequencies(
        Lanes(gearchaos.load_config(path.parent / "gears.toml")).system_of([0])
    )
    hertz = found[0] * groups["scaling_frequency"].values / (2.0 * np.pi)
    deflection = groups["load"].values * groups["length_scale"].values
    deflection /= np.cos(np.radians(groups["base_helix_angle_deg"].values))
    told = capsys.readouterr().err
    assert f"eigenfrequencies {', '.join(f'{one:.4g}' for one in hertz)} Hz" in told
    assert f"{deflection:.4g} um of the mesh under the static load" in told


def test_a_table_says_its_units(path, tmp_path):
    pandas = pytest.importorskip("pandas")
    target = str(tmp_path / "pair.csv")
    assert export([str(path), target, "--units", "physical"]) == 0
    read, frame = pandas.read_csv(target), gearchaos.open_result(path).physical().to_dataframe()
    name = "mesh_force_largest_tangential"
    np.testing.assert_array_equal(read[f"{name} [N]"], frame[name])
    assert frame.attrs["units"][name] == "N" and "period [1]" in read.columns


def test_lengths_times_and_forces_are_those_of_the_pair(result):
    length, frequency, stiffness = (
        result.parameters[name].values
        for name in ("length_scale", "scaling_frequency", "mean_mesh_stiffness")
    )
    # small_config has 25 um, and 13 N/(um mm) over the face width.
    assert length == 25.0
    found = result.physical()
    for name, factor, units in (
        ("section_delta_5", length, "um"),
        ("section_delta_5_rate", 1e-6 * length * frequency, "m/s"),
        ("transmission_error_rms", length, "um"),
        ("mesh_force_largest_tangential", 1e-6 * length * stiffness, "N"),
        ("lyapunov_exponent", frequency, "s^-1"),
        ("lyapunov_exponent_standard_error", frequency, "s^-1"),
        ("load_factor_largest", 1.0, "1"),
        ("return_distance", 1.0, "1"),
    ):
        assert found[name] == pytest.approx(factor * result[name], nan_ok=True), name
        assert found.attributes(name)["units"] == units
    # The load is 50 Nm at the base radius of the driving gear, 22.5688 mm.
    force = 1e-6 * length * stiffness * result.parameters["load"].values
    assert force == pytest.approx(50.0 / 22.5688e-3, rel=1e-5)
    assert result.parameters["static_load"].values == pytest.approx(force)
    mass, period = (result.parameters[name].values for name in ("equivalent_mass", "mesh_period"))
    assert frequency == pytest.approx(np.sqrt(stiffness / mass))
    assert period == pytest.approx(60.0 / (8000.0 * 21))


def test_a_mesh_frequency_is_in_hertz_and_no_longer_angular(tmp_path):
    swept = "sweep={parameter='mesh_frequency', values=[0.5, 1.0]}"
    result = gearchaos.run(gearchaos.load_config(small_config(tmp_path), [*ASKED, swept]))
    found = result.physical("mesh_frequency")
    assert found["mesh_frequency"] == pytest.approx(1.0 / result.parameters["mesh_period"].values)
    told = found.attributes("mesh_frequency")
    assert (told["units"], told["long_name"]) == ("Hz", "mesh frequency")
    found.save(tmp_path / "converted.h5")
    refused = "mesh_frequency: is in physical units"
    for one in (found, gearchaos.open_result(tmp_path / "converted.h5")):
        with pytest.raises(gearchaos.ConfigurationError, match=refused):
            gearchaos.System.of_lane(one, mesh_frequency=0.0)


def test_accelerations_are_the_rates_of_the_speeds(path):
    config = gearchaos.load_config(small_config(path.parent), ["pitch_error.phase_deg=0.0"])
    motion = gearchaos.respond(config, 1)
    found = motion.physical("delta_5_acceleration", "delta_5_rate")
    acceleration, speed = (found[name][0] for name in ("delta_5_acceleration", "delta_5_rate"))
    assert found.attributes("delta_5_acceleration")["units"] == "m/s^2"
    step = motion.parameters["mesh_period"].values / (speed.size - 1)
    # The error of the trapezoidal rule is of second order in the forty steps.
    gained = np.cumsum(acceleration[1:] + acceleration[:-1]) * step / 2.0
    assert gained == pytest.approx(speed[1:] - speed[0], abs=0.02 * np.ptp(speed))


def test_one_variable_is_enough_and_twice_is_once(result):
    one = result.physical("section_delta_5")
    assert one.attributes("lyapunov_exponent")["units"] == "1"
    assert unit_of(one, "section_delta_5") == "\N{MICRO SIGN}m"
    again = one.physical()
    assert np.array_equal(again["section_delta_5"], one["section_delta_5"])
    assert unit_of(again, "section_delta_5_rate") == "m/s"


def test_lanes_of_a_converted_result_are_computed_where_its_axes_are_as_configured(result):
    lane = {"pitch_error": float(result["pitch_error"][1])}
    one, other = (gearchaos.System.of_lane(given, **lane) for given in (result, result.physical()))
    assert np.array_equal(one.state, other.state)
    assert one.mesh_period == other.mesh_period


def test_a_figure_says_micrometres_and_keeps_the_dimensionless_one(path, capsys):
    assert plot([str(path), "--format=png"]) == 0
    assert plot([str(path), "--format=png", "--units=physical"]) == 0
    assert capsys.readouterr().out.split()[-1].endswith("pair_physical.png")
    assert (path.parent / "pair.png").exists()


def test_what_the_configuration_does_not_give_is_named():
    result = gearchaos.run(gearchaos.load_config(PAN2021, SHORT))
    with pytest.raises(gearchaos.ConfigurationError, match=r"section_delta_5: .*length_scale"):
        result.physical()
    rate = result.physical("lyapunov_exponent")
    assert rate.attributes("lyapunov_exponent")["units"] == "s^-1"


def test_a_scale_that_is_swept_is_that_of_each_lane(tmp_path):
    sweep = 'sweep={parameter="mesh.length_scale_um",values=[20.0,30.0]}'
    result = gearchaos.run(gearchaos.load_config(small_config(tmp_path), [sweep]))
    found = result.physical("section_delta_5", "state")["section_delta_5"]
    assert found == pytest.approx(result["section_delta_5"] * [[20.0], [30.0]])
