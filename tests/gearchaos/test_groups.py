"""Dimensionless groups are derived, given, or set by default."""

import pickle

import numpy as np
import pytest

from gearchaos.models.gear_pair.derivation import derive_groups
from gearchaos.models.gear_pair.group_table import GROUP_TABLE, GROUPS_BY_NAME
from gearchaos.models.gear_pair.groups import resolve_groups
from gearchaos.models.gear_pair.tables import PHYSICAL_KEYS

MEAN_STIFFNESS = 13.3548 * 15 * 1e6  # N/m
EQUIVALENT_MASS = 0.095448  # kg, with the digits of the test of the geometry
ALL_EFFECTS = ("pitch_error", "stiffness_variation", "backlash", "transverse", "axial", "friction")


PHYSICAL = {
    "pair.teeth": (21, 38),
    "pair.normal_module_mm": 2.166,
    "pair.normal_pressure_angle_deg": 20.0,
    "pair.helix_angle_deg": 20.0,
    "pair.face_width_mm": 15.0,
    "pair.profile_shift": None,
    "pair.centre_distance_mm": None,
    "pair.tip_diameters_mm": None,
    "pair.contact_ratio": None,
    "pair.density_kg_m3": 7850.0,
    "pair.masses_kg": None,
    "pair.inertias_kg_m2": None,
    "operation.speed_rpm": 2000.0,
    "operation.torque_Nm": 50.0,
    "mesh.mean_stiffness_N_per_um_mm": 13.3548,
    "mesh.length_scale_um": None,
    "mesh.half_backlash_um": 25.0,
    "mesh.circumferential_backlash_um": None,
    "mesh.normal_backlash_um": None,
    "mesh.damping_ratio": 0.1,
    "mesh.damping_N_s_per_m": None,
    "mesh.damping_acts": "always",
    "mesh.friction_coefficient": 0.06,
    "mesh.stiffness.shape": "fourier",
    "mesh.stiffness.cosine_N_per_um_mm": (-1.202, 0.0, -0.1339),
    "mesh.stiffness.sine_N_per_um_mm": (1.203, 0.0, -0.1335),
    "mesh.stiffness.harmonics": None,
    **{
        f"mesh.stiffness.{key}": None
        for key in (
            *("file", "phase_column", "column", "period", "unit"),
            *("fit_error", "most_harmonics", "phase", "values"),
        )
    },
    "pitch_error.kind": "sine",
    "pitch_error.amplitude_um": 11.0,
    "pitch_error.mean_um": 2.0,
    "pitch_error.phase_deg": 30.0,
    "pitch_error.smoothing": None,
    **{
        f"pitch_error.{gear}.{key}": None
        for gear in ("driving", "driven")
        for key in (
            *("cumulative_um", "single_um", "file", "column", "tooth_column"),
            *("holds", "counted", "flank"),
        )
    },
    "pitch_error.grade": None,
    "pitch_error.edition": None,
    "pitch_error.seed": None,
    "pitch_error.realisations": None,
    "pitch_error.first_realisation": None,
    "pitch_error.eccentricity": None,
    "bearings.transverse_stiffness_N_per_m": (1e8, 2e8),
    "bearings.transverse_damping_N_s_per_m": (100.0, 300.0),
    "bearings.axial_stiffness_N_per_m": (3e7, 4e7),
    "bearings.axial_damping_N_s_per_m": (50.0, 60.0),
}
"""A Pan 2021 pair with invented load, backlash and bearings."""


def physical(**changes):
    """Return the physical data with changes; a key has __ in place of a dot."""
    by_path = {path.replace("__", "."): value for path, value in changes.items()}
    assert by_path.keys() <= PHYSICAL.keys()
    return PHYSICAL | by_path


def trapezoid(**parts):
    parts = {"shape": "trapezoid", "harmonics": 6, **parts}
    return {f"mesh__stiffness__{name}": value for name, value in parts.items()}


def test_groups_are_known_by_the_names_of_the_table_and_no_others():
    assert len(GROUPS_BY_NAME) == len(GROUP_TABLE)
    groups = resolve_groups(physical(), {"load": 0.3})
    assert groups.load == 0.3
    assert list(groups.values) == list(groups.origin) == list(GROUPS_BY_NAME)
    assert resolve_groups(dict.fromkeys(PHYSICAL), {}).load is None
    with pytest.raises(AttributeError, match="'laod' is not a group"):
        _ = groups.laod
    copy = pickle.loads(pickle.dumps(groups))
    assert copy.origin == groups.origin


def test_a_path_that_the_physical_data_lack_is_an_error():
    lacking = {path: value for path, value in PHYSICAL.items() if path != "pair.density_kg_m3"}
    with pytest.raises(KeyError, match=r"pair\.density_kg_m3"):
        derive_groups(lacking)


def test_the_physical_data_have_the_paths_of_the_configuration():
    assert list(PHYSICAL_KEYS) == list(PHYSICAL)


def test_complete_physical_data_give_every_group_without_a_default_of_its_own():
    derived = derive_groups(physical())
    free = {"pitch_error", "stiffness_variation_scale", "pitch_point_phase_deg"}
    assert derived.keys() == {row.name for row in GROUP_TABLE} - free
    assert all(GROUPS_BY_NAME[name].valid.admits(value) for name, value in derived.items())


def test_derived_groups_follow_their_definitions():
    groups = resolve_groups(physical(), {})
    omega_h = np.sqrt(MEAN_STIFFNESS / EQUIVALENT_MASS)
    expected = {
        "mesh_frequency": 2 * np.pi * 700.0 / omega_h,
        "load": 50.0 / (EQUIVALENT_MASS * 25e-6 * 22.5688e-3 * omega_h**2),
        "damping_ratio": 0.1,
        "base_helix_angle_deg": 18.7472,
        "half_backlash": 1.0,
        "pitch_error": 1.0,
        "pitch_error_amplitude": 11 / 25,
        "pitch_error_mean": 2 / 25,
        "pitch_error_phase_deg": 30.0,
        "stiffness_variation_scale": 1.0,
        "mass_ratio_p": 0.440487,
        "mass_ratio_g": 0.134525,
        "transverse_stiffness_p": 1e8 / (0.21669 * omega_h**2),
        "transverse_damping_p": 100.0 / (2 * 0.21669 * omega_h),
        "transverse_stiffness_g": 2e8 / (0.70952 * omega_h**2),
        "transverse_damping_g": 300.0 / (2 * 0.70952 * omega_h),
        "axial_stiffness_p": 3e7 / (0.21669 * omega_h**2),
        "axial_damping_p": 50.0 / (2 * 0.21669 * omega_h),
        "axial_stiffness_g": 4e7 / (0.70952 * omega_h**2),
        "axial_damping_g": 60.0 / (2 * 0.70952 * omega_h),
        "friction_coefficient": 0.06,
        # tan(21.1728 deg) / cos(18.7472 deg)
        "friction_lever": 0.409030,
        "pitch_point_phase_deg": 0.0,
    }
    computed = {name: getattr(groups, name) for name in expected}
    assert computed == pytest.approx(expected, rel=2e-5)
    assert groups.stiffness_cosine == pytest.approx(np.array([-1.202, 0, -0.1339]) / 13.3548)
    assert groups.stiffness_sine == pytest.approx(np.array([1.203, 0, -0.1335]) / 13.3548)


def test_length_scale_defaults_to_the_half_backlash_and_cancels_where_it_must():
    scaled = resolve_groups(physical(mesh__length_scale_um=50.0), {})
    plain = resolve_groups(physical(), {})
    assert scaled.half_backlash == pytest.approx(0.5)
    for name in ("load", "pitch_error_amplitude", "pitch_error_mean", "half_backlash"):
        assert getattr(scaled, name) == pytest.approx(getattr(plain, name) / 2)
    assert scaled.mesh_frequency == plain.mesh_frequency


def test_damping_of_the_mesh_becomes_a_ratio_by_eq_20():
    tables = physical(mesh__damping_ratio=None, mesh__damping_N_s_per_m=247.331)
    critical = 2 * np.sqrt(MEAN_STIFFNESS * EQUIVALENT_MASS)
    assert derive_groups(tables)["damping_ratio"] == pytest.approx(247.331 / critical, rel=1e-5)


def test_a_given_group_wins_over_a_derived_one_and_a_derived_one_over_the_default():
    groups = resolve_groups(physical(), {"damping_ratio": 0.02, "pitch_error": 5.86})
    assert (groups.damping_ratio, groups.origin["damping_ratio"]) == (0.02, "given")
    assert (groups.pitch_error, groups.origin["pitch_error"]) == (5.86, "given")
    assert groups.origin["load"] == groups.origin["pitch_error_mean"] == "derived"
    assert groups.origin["stiffness_variation_scale"] == "default"
    assert groups.missing(ALL_EFFECTS) == []


def test_groups_alone_need_no_physical_data():
    nothing = dict.fromkeys(PHYSICAL)
    assert derive_groups(nothing) == {}
    groups = resolve_groups(nothing, {"mesh_frequency": 0.876, "load": 0.268})
    assert [row.name for row in groups.missing(())] == ["damping_ratio", "base_helix_angle_deg"]
    assert groups.origin == {
        "mesh_frequency": "given",
        "load": "given",
        "pitch_error": "default",
        "pitch_error_mean": "default",
        "pitch_error_phase_deg": "default",
        "stiffness_variation_scale": "default",
        "pitch_point_phase_deg": "default",
    }


@pytest.mark.parametrize(
    ("absent", "lost"),
    [
        ("operation__torque_Nm", {"load"}),
        ("operation__speed_rpm", {"mesh_frequency"}),
        (
            "mesh__half_backlash_um",
            {"half_backlash", "load", "pitch_error_amplitude", "pitch_error_mean"},
        ),
        ("mesh__stiffness__shape", {"stiffness_cosine", "stiffness_sine"}),
        ("bearings__axial_damping_N_s_per_m", {"axial_damping_p", "axial_damping_g"}),
        ("mesh__friction_coefficient", {"friction_coefficient"}),
    ],
)
def test_a_missing_quantity_loses_exactly_the_groups_that_need_it(absent, lost):
    assert (
        derive_groups(physical()).keys() - derive_groups(physical(**{absent: None})).keys() == lost
    )


@pytest.mark.parametrize("helix_angle", [0.0, 15.0, 20.0, 30.0])
def test_a_backlash_is_the_same_in_whatever_plane_it_is_measured(helix_angle):
    alpha_n, beta = np.radians(20.0), np.radians(helix_angle)
    # Cosine of the base helix angle; j_bn = j_t cos(alpha_n) cos(beta) according to ISO 21771.
    cosine = np.sqrt(1.0 - (np.sin(beta) * np.cos(alpha_n)) ** 2)
    circumferential = 100.0
    normal = circumferential * np.cos(alpha_n) * np.cos(beta)
    # Along the transverse line of action: 2 half cosine = j_t cos(alpha_t) = j_bn / cosine.
    half = 0.5 * normal / cosine / cosine
    given = {"mesh__length_scale_um": 40.0, "pair__helix_angle_deg": helix_angle}
    for name, value in {
        "mesh__half_backlash_um": half,
        "mesh__circumferential_backlash_um": circumferential,
        "mesh__normal_backlash_um": normal,
    }.items():
        groups = resolve_groups(
            physical(**given, **{"mesh__half_backlash_um": None, name: value}), {}
        )
        assert groups.half_backlash == pytest.approx(half / 40.0, rel=1e-14), name
        assert groups.origin["half_backlash"] == "derived"


def test_a_spur_pair_has_the_backlash_of_its_base_circle():
    spur = {"pair__helix_angle_deg": 0.0, "mesh__half_backlash_um": None}
    groups = resolve_groups(physical(**spur, mesh__normal_backlash_um=50.0), {})
    # Half of the backlash is the length scale, which also scales the load.
    assert groups.half_backlash == 1.0
    half = resolve_groups(physical(pair__helix_angle_deg=0.0, mesh__half_backlash_um=25.0), {})
    assert groups.load == pytest.approx(half.load, rel=1e-15)


def test_a_trapezoid_comes_from_the_contact_ratios_of_the_pair():
    groups = resolve_groups(physical(**trapezoid()), {})
    # The exact contact ratios are 1.5050 and 0.7539; Table 2 is based on 1.5 and 0.75.
    assert groups.stiffness_cosine.size == 6
    assert groups.stiffness_cosine[0] * 13.3548 == pytest.approx(-1.202, rel=0.05)


def test_given_harmonics_replace_the_derived_ones_as_a_whole():
    groups = resolve_groups(physical(), {"stiffness_cosine": [-0.09, 0.0, -0.01]})
    assert np.array_equal(groups.stiffness_cosine, [-0.09, 0.0, -0.01])
    assert np.array_equal(groups.stiffness_sine, [0.0, 0.0, 0.0])
    assert groups.origin["stiffness_cosine"] == "given"
    assert groups.origin["stiffness_sine"] == "default"


def test_swept_physical_quantity_gives_one_value_per_lane():
    speeds = np.linspace(1000.0, 3000.0, 5)
    groups = resolve_groups(physical(operation__speed_rpm=speeds), {})
    one_by_one = [
        resolve_groups(physical(operation__speed_rpm=speed), {}).mesh_frequency for speed in speeds
    ]
    assert np.array_equal(groups.mesh_frequency, one_by_one)
    assert isinstance(groups.load, float)


def test_swept_data_of_the_pair_give_the_harmonics_of_each_lane():
    angles = np.array([15.0, 20.0, 25.0])
    tables = physical(**trapezoid(), pair__helix_angle_deg=angles)
    swept = resolve_groups(tables, {})
    for number, angle in enumerate(angles):
        alone = resolve_groups(physical(**trapezoid(), pair__helix_angle_deg=angle), {})
        assert np.array_equal(swept.stiffness_cosine[number], alone.stiffness_cosine)
        assert np.array_equal(swept.stiffness_sine[number], alone.stiffness_sine)
    given = {"stiffness_cosine": [-0.09], "stiffness_sine": [0.09]}
    assert resolve_groups(tables, given).base_helix_angle_deg.shape == (3,)


def test_a_name_that_is_no_group_is_refused():
    with pytest.raises(KeyError, match="helix"):
        resolve_groups(physical(), {"helix": 1.0})


@pytest.mark.parametrize(
    ("name", "valid", "invalid", "rule"),
    [
        ("mesh_frequency", 0.1, 0.0, "finite and > 0"),
        ("load", -3.0, np.nan, "finite"),
        ("damping_ratio", 0.0, -0.1, "finite and >= 0"),
        ("base_helix_angle_deg", 89.9, 90.0, "finite and >= 0 and < 90"),
        ("half_backlash", 0.0, -1.0, "finite and >= 0"),
        ("pitch_error_amplitude", -1.0, np.inf, "finite"),
        ("mass_ratio_p", 0.5, 0.0, "finite and > 0"),
        ("axial_stiffness_g", 0.0, -1.0, "finite and >= 0"),
    ],
)
def test_valid_ranges(name, valid, invalid, rule):
    row = GROUPS_BY_NAME[name]
    assert row.valid.admits(valid)
    assert not row.valid.admits(invalid)
    assert not row.valid.admits([valid, invalid])
    assert row.valid.rule == rule


def test_a_scene_needs_the_groups_of_its_effects_only():
    needed = {row.name for row in GROUP_TABLE if row.needed_by(["axial"])}
    assert needed == {
        "mesh_frequency",
        "load",
        "damping_ratio",
        "base_helix_angle_deg",
        "mass_ratio_p",
        "mass_ratio_g",
        "axial_stiffness_p",
        "axial_damping_p",
        "axial_stiffness_g",
        "axial_damping_g",
    }
