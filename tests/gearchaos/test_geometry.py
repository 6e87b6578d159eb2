"""The geometry of Pan 2021's pair, and relations that hold for every pair."""

import numpy as np
import pytest

from gearchaos.models.gear_pair.geometry import HelicalPair, angle_of_involute


def pan_2021_pair(**changes):
    catalogue = {
        "teeth": (21, 38),
        "normal_module": 2.166e-3,
        "normal_pressure_angle": np.radians(20.0),
        "helix_angle": np.radians(20.0),
        "face_width": 15e-3,
        "density": 7850.0,
    }
    return HelicalPair(**(catalogue | changes))


@pytest.mark.parametrize(
    ("quantity", "unit", "expected", "last_digit"),
    [
        ("transverse_pressure_angle", np.pi / 180, 21.1728, 1e-4),
        ("base_helix_angle", np.pi / 180, 18.7472, 1e-4),
        ("reference_radii", 1e-3, (24.2026, 43.7952), 1e-4),
        ("base_radii", 1e-3, (22.5688, 40.8388), 1e-4),
        ("transverse_contact_ratio", 1, 1.5050, 1e-4),
        ("overlap_contact_ratio", 1, 0.7539, 1e-4),
        ("total_contact_ratio", 1, 2.2590, 1e-4),
        ("masses", 1, (0.21669, 0.70952), 1e-5),
        ("inertias", 1, (6.3464e-5, 6.8043e-4), (1e-9, 1e-8)),
        ("equivalent_mass", 1, 0.095448, 1e-6),
    ],
)
def test_pan_2021_table_1_gives_the_published_geometry(quantity, unit, expected, last_digit):
    computed = np.divide(getattr(pan_2021_pair(), quantity), unit)
    assert np.all(np.abs(computed - expected) <= 0.501 * np.array(last_digit))


def test_mass_ratios_of_solid_discs_do_not_depend_on_density():
    for density in (2700.0, 7850.0):
        pair = pan_2021_pair(density=density)
        ratios = pair.equivalent_mass / np.array(pair.masses)
        assert ratios == pytest.approx((0.440487, 0.134525), abs=5e-7)


def test_base_circles_of_a_meshing_pair_share_one_base_pitch():
    pair = pan_2021_pair()
    pitches = 2.0 * np.pi * np.array(pair.base_radii) / pair.teeth
    assert pitches == pytest.approx(pair.transverse_base_pitch, rel=1e-15)


def test_overlap_ratio_equals_its_definition_on_the_reference_cylinder():
    pair = pan_2021_pair()
    expected = pair.face_width * np.sin(pair.helix_angle) / (np.pi * pair.normal_module)
    assert pair.overlap_contact_ratio == pytest.approx(expected, rel=1e-14)


def test_spur_pair_has_no_base_helix_angle_and_no_overlap():
    pair = pan_2021_pair(helix_angle=0.0)
    assert pair.base_helix_angle == 0.0
    assert pair.overlap_contact_ratio == 0.0
    assert pair.transverse_pressure_angle == pytest.approx(np.radians(20.0), rel=1e-15)


def test_equivalent_mass_is_the_inertia_felt_along_the_line_of_action():
    pair = pan_2021_pair(given_inertias=(1e-4, 5e-4))
    base_p, base_g = pair.base_radii
    assert 1.0 / pair.equivalent_mass == pytest.approx(base_p**2 / 1e-4 + base_g**2 / 5e-4)


def test_given_masses_and_inertias_replace_the_solid_discs():
    pair = pan_2021_pair(given_masses=(0.5, 1.0))
    assert pair.masses == (0.5, 1.0)
    assert pair.inertias[0] == pytest.approx(0.5 * pair.reference_radii[0] ** 2 / 2)
    pair = pan_2021_pair(given_masses=(0.5, 1.0), given_inertias=(1e-4, 5e-4))
    assert pair.inertias == (1e-4, 5e-4)


def test_arrays_give_elementwise_what_their_entries_give():
    widths = np.array([10e-3, 15e-3, 20e-3])
    together = pan_2021_pair(face_width=widths)
    for quantity in ("overlap_contact_ratio", "equivalent_mass", "total_contact_ratio"):
        one_by_one = [getattr(pan_2021_pair(face_width=width), quantity) for width in widths]
        assert np.array_equal(getattr(together, quantity), one_by_one)


def involute(angle):
    return np.tan(angle) - angle


def test_angles_are_found_by_their_involute():
    angles = np.radians([0.5, 5.0, 14.5, 20.0, 35.0, 60.0])
    assert angle_of_involute(involute(angles)) == pytest.approx(angles, abs=1e-12)


# Worked examples of KHK Gear Technical Reference, tables of profile shifted spur and helical gears.
@pytest.mark.parametrize(
    ("catalogue", "angle_deg", "distance_mm", "tips_mm"),
    [
        (
            {"teeth": (12, 24), "helix_angle": 0.0, "profile_shift": (0.6, 0.36)},
            26.0886,
            56.4999,
            (44.840, 79.400),
        ),
        (
            {"teeth": (12, 60), "helix_angle": np.pi / 6, "profile_shift": (0.09809, 0.0)},
            23.1126,
            125.000,
            (48.153, 213.842),
        ),
    ],
)
def test_profile_shifted_pairs_of_a_textbook(catalogue, angle_deg, distance_mm, tips_mm):
    pair = pan_2021_pair(normal_module=3e-3, **catalogue)
    assert np.degrees(pair.working_pressure_angle) == pytest.approx(angle_deg, abs=1e-4)
    assert 1e3 * pair.working_centre_distance == pytest.approx(distance_mm, abs=6e-4)
    # The printed values are sums of a diameter and two addenda, each with three decimals.
    assert 2e3 * np.array(pair.tip_radii) == pytest.approx(tips_mm, abs=1.5e-3)


def test_the_sum_of_the_shifts_follows_from_the_working_angle():
    pair = pan_2021_pair(profile_shift=(0.4, 0.15))
    working, alpha = pair.working_pressure_angle, pair.transverse_pressure_angle
    total = involute(working) - involute(alpha)
    total *= sum(pair.teeth) / (2.0 * np.tan(pair.normal_pressure_angle))
    assert total == pytest.approx(0.55, abs=1e-12)
    # The same pair is given by its centre distance and its tip circles.
    tips = tuple(2.0 * radius for radius in pair.tip_radii)
    same = pan_2021_pair(centre_distance=pair.working_centre_distance, tip_diameters=tips)
    assert same.working_pressure_angle == pytest.approx(working, abs=1e-13)
    assert same.transverse_contact_ratio == pytest.approx(pair.transverse_contact_ratio, rel=1e-12)


def test_shifts_that_cancel_keep_the_standard_centre_distance():
    pair, standard = pan_2021_pair(profile_shift=(0.3, -0.3)), pan_2021_pair()
    assert pair.working_pressure_angle == pytest.approx(standard.working_pressure_angle, abs=1e-13)
    assert pair.working_centre_distance == pytest.approx(sum(standard.reference_radii), rel=1e-13)
    longer = np.array(pair.tip_radii) - standard.tip_radii
    assert longer == pytest.approx([0.3 * 2.166e-3, -0.3 * 2.166e-3], rel=1e-9)
    unshifted = pan_2021_pair(profile_shift=(0.0, 0.0))
    assert unshifted.transverse_contact_ratio == pytest.approx(
        standard.transverse_contact_ratio, rel=1e-12
    )


def test_the_path_of_contact_ends_where_the_tip_circles_cut_the_line_of_action():
    pair = pan_2021_pair(profile_shift=(0.4, 0.15))
    distance, working = pair.working_centre_distance, pair.working_pressure_angle
    # The centres are at 0 and `distance`; the line of action touches the first base circle.
    foot = pair.base_radii[0] * np.array([np.cos(working), np.sin(working)])
    along = np.array([np.sin(working), -np.cos(working)])
    ends = []
    for centre, radius in zip((0.0, distance), pair.tip_radii, strict=True):
        apart = foot - [centre, 0.0]
        half = along @ apart
        root = np.sqrt(half**2 - apart @ apart + radius**2)
        ends.append(-half + root if centre == 0.0 else -half - root)
    ratio = (ends[0] - ends[1]) / pair.transverse_base_pitch
    assert pair.transverse_contact_ratio == pytest.approx(ratio, rel=1e-10)
