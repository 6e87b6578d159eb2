"""Gears from drawing data: pairs with profile shift, trains by module, and contradictions."""

from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.models.gear_pair.contact_lines import TrapezoidalStiffness
from gearchaos.models.registry import system_of

from .test_geometry import pan_2021_pair

SWEEPS = Path(__file__).parents[2] / "sweeps"
SPEED = {"operation.speed_rpm": np.array([4000.0])}


def pair(changes=(), **data):
    return gearchaos.Configuration.from_tables(
        {
            "pair": {
                "teeth": [21, 38],
                "normal_module_mm": 2.166,
                "normal_pressure_angle_deg": 20.0,
                "helix_angle_deg": 20.0,
                "face_width_mm": 15.0,
                **data,
            },
            "operation": {"speed_rpm": 4000.0, "torque_Nm": 20.0},
            "mesh": {
                "mean_stiffness_N_per_um_mm": 20.0,
                "half_backlash_um": 20.0,
                "damping_ratio": 0.03,
                "friction_coefficient": 0.05,
                "stiffness": {"shape": "trapezoid"},
            },
            "scene": {"effects": ["stiffness_variation", "backlash", "friction"]},
            "sweep": {"parameter": "operation.speed_rpm", "values": [4000.0, 5000.0]},
            **dict(changes),
        },
        "my.toml",
    )


def harmonics(config):
    found = system_of(config, SPEED)
    return found.stiffness_cosine - 1j * found.stiffness_sine


def test_the_stiffness_of_a_pair_follows_its_profile_shift():
    shifted = pan_2021_pair(profile_shift=(0.4, 0.15))
    ratios = shifted.transverse_contact_ratio, shifted.overlap_contact_ratio
    expected = TrapezoidalStiffness.from_contact_ratios(*ratios).coefficients(6)
    assert harmonics(pair(profile_shift=[0.4, 0.15])) == pytest.approx(expected, abs=1e-12)
    distance = 1e3 * shifted.working_centre_distance
    tips = [2e3 * radius for radius in shifted.tip_radii]
    same = pair(centre_distance_mm=distance, tip_diameters_mm=tips)
    assert harmonics(same) == pytest.approx(expected, abs=1e-12)
    given = pair(centre_distance_mm=distance, contact_ratio=float(ratios[0]))
    assert harmonics(given) == pytest.approx(expected, abs=1e-12)
    # The lever of friction follows from the working pitch circles.
    lever = system_of(given, SPEED).groups.friction_lever
    tangent = np.tan(shifted.working_pressure_angle) / np.cos(shifted.base_helix_angle)
    assert lever == pytest.approx(tangent, rel=1e-12)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            {"profile_shift": [0.4, 0.15], "centre_distance_mm": 68.0},
            "pair.centre_distance_mm = 68.0: profile shifts of 0.55 in all have 69.1294 mm",
        ),
        ({"centre_distance_mm": 60.0}, "must exceed the sum of the base radii, 63.4076 mm"),
        ({"centre_distance_mm": 69.0}, "does not determine the tip circles"),
        ({"tip_diameters_mm": [45.0, 92.0]}, "must exceed the base diameters, 45.1376059"),
        (
            {"tip_diameters_mm": [52.7, 91.9], "contact_ratio": 1.5},
            "pair.contact_ratio = 1.5: is given beside the tip diameters",
        ),
        ({"tip_diameters_mm": [48.0, 88.0], "face_width_mm": 1.0}, "must be at least 1"),
        ({"contact_ratio": -1.5}, "must be greater than 0"),
    ],
)
def test_contradictory_data_of_a_pair_are_refused_in_a_sentence(data, message):
    with pytest.raises(gearchaos.ConfigurationError) as refused:
        pair(**data)
    assert message in str(refused.value)
    assert str(refused.value).startswith("my.toml: pair")
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("name", ["helix_angle_deg", "normal_module_mm", "centre_distance_mm"])
def test_a_sweep_gives_every_value_its_own_harmonics(name):
    data = {"tip_diameters_mm": [52.7, 91.9]} if name.startswith("centre") else {}
    values = [67.5, 68.0] if data else [1.8, 2.2]
    sweep = {"parameter": f"pair.{name}", "values": values}
    speed = {"operation": {"torque_Nm": 50.0, "speed_rpm": 4000.0}}
    swept = {sweep["parameter"]: np.array(values)}
    found = system_of(pair({"sweep": sweep, **speed}, **data), swept)
    for number, value in enumerate(values):
        alone = harmonics(pair(**{**data, name: value}))
        own = found.stiffness_cosine[number] - 1j * found.stiffness_sine[number]
        assert own == pytest.approx(alone, abs=1e-15)


def test_too_many_harmonics_for_lanes_of_their_own_are_refused():
    tables = pair().tables()
    tables["mesh"]["stiffness"]["harmonics"] = 41
    tables["operation"]["speed_rpm"] = 4000.0
    tables["sweep"] = {"parameter": "pair.face_width_mm", "values": [12.0, 18.0]}
    rule = r"mesh.stiffness.harmonics = 41: gives more than 40 .* pair.face_width_mm changes them"
    with pytest.raises(gearchaos.ConfigurationError, match=rule):
        gearchaos.Configuration.from_tables(tables, "my.toml")


SIZES = {"normal_module_mm": 2.166, "helix_angle_deg": 20.0, "face_width_mm": 15.0}


def train(pinion, wheel, mesh=(), sweep=("operation.speed_rpm", [1000.0, 2000.0])):
    """Return a train with the numbers of teeth of the pair of Pan 2021."""
    tables = gearchaos.load_config(SWEEPS / "bearing_clearance.toml").tables()
    tables["gear"] = {
        "pinion": {"shaft": "input", "teeth": 21, **dict(pinion)},
        "wheel": {"shaft": "output", "teeth": 38, **dict(wheel)},
    }
    tables["mesh"]["teeth"].pop("contact_ratio")
    tables["mesh"]["teeth"] |= dict(mesh)
    tables["sweep"] = {"parameter": sweep[0], "values": sweep[1]}
    return gearchaos.Configuration.from_tables(tables, "my.toml")


def test_a_train_by_module_has_the_radii_and_the_contact_ratios_of_the_pair():
    machine = train(SIZES, {}).machine({})
    reference = pan_2021_pair()
    # The input rotates uniformly; the wheel acts on the gap by its base radius, in mm.
    assert machine.gap[0, 0] == pytest.approx(-1e3 * reference.base_radii[1], rel=1e-12)
    waves = machine.contact_stiffness[0, 1:].reshape(-1, 2) / machine.contact_stiffness[0, 0]
    ratios = reference.transverse_contact_ratio, reference.overlap_contact_ratio
    expected = TrapezoidalStiffness.from_contact_ratios(*ratios).coefficients(5)
    assert np.hypot(*waves.T) == pytest.approx(np.abs(expected), abs=1e-12)


def test_every_value_of_a_swept_tooth_has_its_own_harmonics():
    config = train(SIZES, {}, sweep=("gear.pinion.helix_angle_deg", [0.0, 20.0]))
    values = {"gear.pinion.helix_angle_deg": np.array([0.0, 20.0])}
    waves = system_of(config, values).stiffness[:, 0, 1:]
    for lane, helix in enumerate((0.0, 20.0)):
        alone = train({**SIZES, "helix_angle_deg": helix}, {}).machine({})
        assert waves[lane] == pytest.approx(alone.contact_stiffness[0, 1:], rel=1e-12)
    assert np.abs(waves[0]).max() > 2.0 * np.abs(waves[1]).max()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([{}, {}], "gear.pinion.base_radius_mm: is missing; give it, or normal_module_mm"),
        ([{**SIZES, "base_radius_mm": 20.0}, {}], "is given beside normal_module_mm"),
        (
            [SIZES, {**SIZES, "normal_module_mm": 2.0}],
            "gear.wheel.normal_module_mm = 2.0: must equal that of pinion, 2.166",
        ),
        (
            [{"base_radius_mm": 22.5}, {"base_radius_mm": 56.4}],
            "pinion has the base pitch 6.732 mm and wheel 9.3256 mm, must be equal",
        ),
        (
            [{**SIZES, "profile_shift": 0.55}, {}, {"centre_distance_mm": 68.0}],
            "mesh.teeth.centre_distance_mm = 68.0: profile shifts of 0.55 in all have 69.1294 mm",
        ),
        (
            [{"base_radius_mm": 22.5}, {"base_radius_mm": 40.7}, {"centre_distance_mm": 68.0}],
            "needs the modules of both gears",
        ),
        ([{**SIZES, "tip_diameter_mm": 52.7}, {}], "gear.wheel.tip_diameter_mm: is missing"),
        (
            [SIZES, SIZES, {}, ("gear.pinion.helix_angle_deg", [10.0, 20.0])],
            "leave out normal_module_mm of gear.wheel",
        ),
    ],
)
def test_gears_that_do_not_fit_each_other_are_refused_in_a_sentence(arguments, message):
    with pytest.raises(gearchaos.ConfigurationError) as refused:
        train(*arguments)
    assert message in str(refused.value)
    lines = str(refused.value).splitlines()
    # Each of two gears without a size has its own message.
    assert len(lines) == (2 if arguments == [{}, {}] else 1)


def test_a_swept_centre_distance_and_a_profile_shift_contradict_each_other():
    sweep = {"parameter": "pair.centre_distance_mm", "values": [69.0, 69.2]}
    with pytest.raises(gearchaos.ConfigurationError, match=r"pair\.profile_shift.*leave it out"):
        pair({"sweep": sweep}, profile_shift=[0.4, 0.15])
