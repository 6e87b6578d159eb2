"""Taylor series as the method of a machine, from its configuration to results."""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.method_choice import with_method
from gearchaos.errors import ConfigurationError

from .commands import run_module
from .short_sweeps import MASSES, PAN2021

PLANETARY = MASSES.with_name("planetary.toml")
SHORT = (
    "integration.transient_periods=200",
    "integration.recorded_periods=100",
    "sweep.count=21",
    "outputs.section_points=20",
    "outputs.contact=true",
    "outputs.exponents=true",
    "start.carry='none'",
)


def config(method, *overrides):
    return gearchaos.load_config(MASSES, [f"integration.method='{method}'", *SHORT, *overrides])


@pytest.fixture(scope="module")
def by_series(tmp_path_factory):
    """Return the result of the two masses by Taylor series, computed on the command line."""
    folder = tmp_path_factory.mktemp("series")
    overrides = [f"--set={one}" for one in ("integration.method='taylor'", *SHORT)]
    ended = run_module("gearchaos.sweep", str(MASSES), "-o", "out.h5", *overrides, cwd=folder)
    assert ended.code == 0, ended.err
    return gearchaos.open_result(folder / "out.h5")


def test_a_sweep_by_series_is_that_of_flow_maps(by_series):
    maps = gearchaos.run(config("flow_map"))
    assert (maps["motion"] == by_series["motion"]).all()
    periodic = maps["period"] > 0
    assert periodic.sum() > 15
    for name in ("section_x1", "lyapunov_exponents", "time_driving_stop", "approach_largest_stop"):
        one, other = by_series[name][periodic], maps[name][periodic]
        assert one == pytest.approx(other, abs=1e-9, nan_ok=True), name


def test_metadata_name_the_method_in_words(by_series):
    assert by_series.metadata["method"] == "taylor"
    assert by_series.metadata["method_description"] == (
        "Taylor series: series of the motion of a machine, exact between crossings and at them; "
        "4 steps per period, resolved crossings"
    )


def test_auto_takes_series_where_rk4_has_fine_steps_and_every_speed_maps_of_its_own():
    chosen, note = with_method(
        gearchaos.load_config(
            PLANETARY,
            [
                "integration={method='auto', steps_per_period=1600}",
                "sweep.count=40",
                "outputs.loads=false",
            ],
        )
    )
    assert chosen.integration.method == "taylor", note
    assert "flow_map is estimated to take" in note


def test_a_gear_pair_is_refused_with_a_remedy():
    with pytest.raises(ConfigurationError) as refused:
        gearchaos.load_config(PAN2021, ["integration.method='taylor'"])
    assert (
        'integration.method = "taylor": is for machines: model.kind = "linear" or "train"; '
        'set it to "flow_map"'
    ) in str(refused.value)


def test_a_gear_pair_with_friction_is_referred_to_the_method_that_knows_it():
    effects = "scene.effects=['pitch_error', 'friction']"
    with pytest.raises(ConfigurationError) as refused:
        gearchaos.load_config(PAN2021, ["integration.method='taylor'", effects])
    assert 'set it to "rk4"' in str(refused.value)


def test_a_gear_pair_hears_nothing_of_methods_for_machines():
    _, note = with_method(gearchaos.load_config(PAN2021, ["integration.method='auto'"]))
    assert "taylor" not in note


def test_plain_crossings_have_no_meaning():
    with pytest.raises(ConfigurationError, match="which resolves every crossing"):
        config("taylor", "integration.crossings='plain'")


def test_an_orbit_and_its_multipliers_are_those_of_flow_maps():
    one, other = (
        gearchaos.System(config(method), frequency=0.72).orbit()
        for method in ("taylor", "flow_map")
    )
    assert one.point == pytest.approx(other.point, abs=1e-10)
    assert np.sort(np.abs(one.multipliers)) == pytest.approx(
        np.sort(np.abs(other.multipliers)), abs=1e-9
    )


def test_a_spectrum_is_sampled_finely_enough_by_default():
    def amplitudes(*settings):
        system = gearchaos.System(
            gearchaos.load_config(MASSES, ["integration.method='taylor'", *settings]),
            frequency=0.66,
        )
        return system.spectrum("x1", periods=4).amplitude[:21:4]

    fine = amplitudes("integration.steps_per_period=960")
    assert fine[1] > 0.9
    assert amplitudes() == pytest.approx(fine, abs=3e-4)


def test_an_element_that_weakens_another_one_does_not_hide_a_fast_motion():
    # Alone, the first element is much stiffer than with the second, which cancels its stiffness.
    stop = {"gap": {"x": 1.0}, "stiffness": 1000.0, "one_sided": True}
    limited = {"reaction": {"x": -1.0}, "half_clearance": 0.9}
    machine = {
        "model": {
            "kind": "linear",
            "coordinates": ["x"],
            "mass": [1.0],
            "stiffness": [1.0],
            "damping": [0.3],
        },
        "clearance": {"first": stop | {"half_clearance": 0.5}, "second": stop | limited},
        "force": {"drive": {"on": {"x": 1.0}, "amplitude": 30.0}},
        "sweep": {"parameter": "frequency", "values": [0.7, 1.0, 1.6]},
        "outputs": {"section": ["x"], "section_points": 4},
    }
    times = {"transient_periods": 60, "recorded_periods": 16}
    series, maps = (
        gearchaos.run(machine | {"integration": {"method": method, **times}})["section_x"]
        for method in ("taylor", "flow_map")
    )
    assert series == pytest.approx(maps, rel=1e-9)
