"""Every parameter of the model can be swept, both groups and physical quantities."""

import numpy as np
import pytest

import gearchaos
from gearchaos.models.gear_pair.group_table import SWEEPABLE_GROUPS
from gearchaos.models.gear_pair.tables import SWEEPABLE_KEYS

from .commands import SMALL

# Ranges of parameters for which the values of the small sweep are unsuitable.
SPANS = {
    "base_helix_angle_deg": (10.0, 20.0),
    "mesh_frequency": (0.4, 0.6),
    "pair.normal_pressure_angle_deg": (15.0, 25.0),
    "pair.helix_angle_deg": (10.0, 25.0),
    "pair.face_width_mm": (12.0, 18.0),
    "pair.centre_distance_mm": (67.0, 69.0),
    "pair.density_kg_m3": (7000.0, 8000.0),
    "pitch_error.phase_deg": (10.0, 90.0),
    "pitch_error_phase_deg": (10.0, 90.0),
    "pitch_error.grade": (5.0, 9.0),
    "pitch_error.eccentricity": (0.0, 1.0),
    "friction_coefficient": (0.05, 0.2),
    "mesh.friction_coefficient": (0.05, 0.2),
    "pitch_point_phase_deg": (10.0, 90.0),
    "operation.speed_rpm": (8000.0, 9000.0),
    "operation.torque_Nm": (40.0, 60.0),
    "mesh.mean_stiffness_N_per_um_mm": (12.0, 14.0),
    "mesh.length_scale_um": (20.0, 30.0),
    "mesh.half_backlash_um": (15.0, 25.0),
    "mesh.circumferential_backlash_um": (30.0, 50.0),
    "mesh.normal_backlash_um": (30.0, 50.0),
    "mesh.damping_N_s_per_m": (100.0, 500.0),
}

SINE = "amplitude_um = 11.0\nmean_um = 2.0\nphase_deg = 30.0"

SOME_FRICTION = {"[groups]": "[groups]\nfriction_coefficient = 0.1"}
WITH_FRICTION = {'"transverse", "axial"]': '"transverse", "axial", "friction"]'}

# Changes of the small sweep with which a parameter acts, or acts alone.
CHANGES = {
    "mesh.damping_ratio": {"[groups]\ndamping_ratio = 0.05": ""},
    "mesh.damping_N_s_per_m": {
        "[groups]\ndamping_ratio = 0.05": "",
        "damping_ratio = 0.1": "damping_N_s_per_m = 300.0",
    },
    **{
        f"mesh.{name}": {"half_backlash_um = 20.0": f"{name} = 40.0"}
        for name in ("circumferential_backlash_um", "normal_backlash_um")
    },
    "mesh.mean_stiffness_N_per_um_mm": {"[groups]": "[groups]\nstiffness_cosine = [-0.09]"},
    "pitch_error.grade": {SINE: 'kind = "grade"\ngrade = 7'},
    "pitch_error.eccentricity": {SINE: 'kind = "grade"\ngrade = 7'},
    "pair.centre_distance_mm": {**WITH_FRICTION, **SOME_FRICTION},
    "friction_coefficient": WITH_FRICTION,
    "mesh.friction_coefficient": WITH_FRICTION,
    "friction_lever": {**WITH_FRICTION, **SOME_FRICTION},
    "pitch_point_phase_deg": {**WITH_FRICTION, **SOME_FRICTION},
}


def configured(parameter, low, high, count=3):
    text = SMALL
    for old, new in CHANGES.get(parameter, {}).items():
        assert old in text
        text = text.replace(old, new)
    span = f"sweep={{parameter='{parameter}', from={low!r}, to={high!r}, count={count}}}"
    return gearchaos.Configuration.from_toml(text, "gears.toml", [span])


@pytest.mark.parametrize("parameter", [*SWEEPABLE_GROUPS, *SWEEPABLE_KEYS])
def test_a_sweep_moves_the_motion_and_each_lane_is_the_sweep_of_its_value_alone(parameter):
    low, high = SPANS.get(parameter, (0.5, 1.5))
    result = gearchaos.run(configured(parameter, low, high))
    assert result.axis == parameter.replace(".", "_")
    assert np.array_equal(result[result.axis], np.linspace(low, high, 3))
    assert (result["status"] == 0).all()
    ends = result["end_state"]
    assert not np.array_equal(ends[0], ends[2])
    alone = gearchaos.run(configured(parameter, high, high, count=1))
    for name in result:
        if result.dims(name)[0] == result.axis:
            assert np.array_equal(result[name][2:], alone[name]), name


TRAPEZOID = {
    'shape = "fourier"\ncosine_N_per_um_mm = [-1.202, 0.0, -0.1339]\n'
    "sine_N_per_um_mm = [1.203, 0.0, -0.1335]": 'shape = "trapezoid"\nharmonics = 3',
    ', "transverse", "axial"]': "]",
    '"delta_5", "delta_3"': '"delta_5"',
}


@pytest.mark.parametrize("name", ["helix_angle_deg", "face_width_mm", "normal_module_mm"])
def test_with_a_trapezoid_each_lane_has_the_stiffness_of_its_value(name, tmp_path, monkeypatch):
    parameter = f"pair.{name}"
    monkeypatch.setitem(CHANGES, parameter, TRAPEZOID)
    monkeypatch.setitem(SPANS, "pair.normal_module_mm", (2.0, 2.4))
    low, high = SPANS[parameter]
    result = gearchaos.run(configured(parameter, low, high))
    assert (result["status"] == 0).all()
    alone = gearchaos.run(configured(parameter, high, high, count=1))
    for one in result:
        if result.dims(one)[0] == result.axis:
            np.testing.assert_array_equal(result[one][2:], alone[one], err_msg=one)
    result.save(tmp_path / "swept.h5")
    kept = gearchaos.open_result(tmp_path / "swept.h5").parameters["stiffness_cosine"]
    assert kept.dims == (result.axis, "harmonic") and kept.origin == "swept"
    # The same pair without a sweep of its geometry has one table of stiffness for all lanes.
    fixed = configured(parameter, low, high).at({parameter: high})
    fixed = fixed.replace({"sweep": {"parameter": "pitch_error", "values": [1.0]}})
    shared = gearchaos.run(fixed)
    assert kept.values[2] == pytest.approx(shared.parameters["stiffness_cosine"].values, abs=1e-15)
    assert np.ptp(kept.values[:, 0]) > 1e-3
    assert result["end_state"][2] == pytest.approx(shared["end_state"][0], rel=1e-9)


def test_a_sweep_of_two_parameters_is_the_sweep_of_the_first_at_every_value_of_the_second():
    second = "second_sweep={parameter='operation.speed_rpm', values=[9000.0, 8000.0]}"
    text = configured("pitch_error", 0.5, 1.5).resolved_toml()
    config = gearchaos.Configuration.from_toml(text, "gears.toml", [second])
    result = gearchaos.run(config)
    assert list(result.axes) == ["operation_speed_rpm", "pitch_error"]
    assert result["operation_speed_rpm"].tolist() == [8000.0, 9000.0]
    for row, speed in enumerate(result["operation_speed_rpm"]):
        alone = gearchaos.run(config.at({"operation.speed_rpm": speed}))
        for name in alone:
            if alone.dims(name)[0] == "pitch_error" and name != "pitch_error":
                assert np.array_equal(result[name][row], alone[name]), name


def test_a_swept_speed_is_the_sweep_of_the_mesh_frequency_that_it_gives():
    by_speed = gearchaos.run(configured("operation.speed_rpm", 7000.0, 9000.0))
    frequency = by_speed.parameters["mesh_frequency"]
    assert frequency.origin == "swept"
    assert frequency.values == pytest.approx(frequency.values[1] * np.array([7, 8, 9]) / 8)
    low, high = frequency.values[[0, 2]].tolist()
    by_frequency = gearchaos.run(configured("mesh_frequency", low, high))
    assert by_frequency["end_state"] == pytest.approx(by_speed["end_state"], rel=1e-8, abs=1e-10)
