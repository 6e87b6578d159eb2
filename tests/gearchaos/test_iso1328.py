"""Limits of pitch deviations by accuracy grade."""

import pytest

import gearchaos
from gearchaos.iso1328 import cumulative_pitch_um, require_gear, single_pitch_um


def test_grade_7_of_1995_has_the_limits_that_pan_2021_takes_from_it():
    assert single_pitch_um(7, 2.166, 48.4) == 11.0
    assert single_pitch_um(7, 2.166, 87.6) == 12.0


@pytest.mark.parametrize(
    ("grade", "single", "cumulative"),
    [
        *((1, 1.5, 4.7), (2, 2.1, 6.5), (3, 2.9, 9.5), (4, 4.1, 13), (5, 6, 19), (6, 8.5, 27)),
        *((8, 17, 53), (9, 23, 76), (10, 33, 107), (11, 47, 151), (12, 66, 214)),
    ],
)
def test_every_grade_is_rounded_as_its_size_asks(grade, single, cumulative):
    assert gearchaos.iso1328.single_pitch_um(grade, 3.0, 100.0) == single
    assert gearchaos.iso1328.cumulative_pitch_um(grade, 3.0, 100.0) == cumulative


def test_the_edition_of_1995_knows_ranges_and_that_of_2013_sizes():
    # A range includes its upper end.
    assert single_pitch_um(7, 3.5, 50.0) == single_pitch_um(7, 2.1, 21.0) == 11.0
    assert single_pitch_um(7, 2.0, 50.0) == 10.0
    assert cumulative_pitch_um(7, 0.5, 5.0) == cumulative_pitch_um(7, 2.0, 20.0)
    assert single_pitch_um(6, 3.0, 120.0, edition=2013) == 9.0  # 8.94
    assert cumulative_pitch_um(6, 3.0, 120.0, edition=2013) == 29.0  # 28.80
    assert (
        cumulative_pitch_um(6, 3.0, 121.0, 2013) == 29.0 != cumulative_pitch_um(6, 3.0, 140.0, 2013)
    )


def test_the_finest_grade_is_0():
    # Table 1 of the edition of 1995 has 0.8 um for modules up to 2 mm and diameters up to 20 mm.
    assert single_pitch_um(0, 1.0, 10.0) == 0.8
    assert single_pitch_um(5, 1.0, 10.0) == 4.7


@pytest.mark.parametrize("grade", [13, -1, 7.5, float("nan")])
def test_other_grades_are_refused(grade):
    with pytest.raises(ValueError, match=r"grade .*: ISO 1328-1:1995 has grades 0 to 12"):
        single_pitch_um(grade, 3.0, 100.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((12, 3.0, 100.0, 2013), "grade 12: ISO 1328-1:2013 has grades 1 to 11"),
        ((7, 0.49, 100.0), "normal module 0.49 mm: ISO 1328-1:1995 goes from 0.5 to 70 mm"),
        ((7, 3.0, 10_001.0), "reference diameter 10001 mm: .* goes from 5 to 10000 mm"),
        ((7, 3.0, float("nan")), "reference diameter nan mm"),
        ((7, 3.0, 100.0, 2008), "edition 2008 of ISO 1328-1: must be 1995 or 2013"),
    ],
)
def test_what_lies_outside_the_standard_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        cumulative_pitch_um(*arguments)


@pytest.mark.parametrize(
    ("gear", "message"),
    [
        ((4, 20.0, 15.0), "number of teeth 4: ISO 1328-1:2013 goes from 5 to 1000"),
        ((1001, 20.0, 15.0), "number of teeth 1001: ISO 1328-1:2013 goes from 5 to 1000"),
        ((21, 45.1, 15.0), "helix angle 45.1 degree: ISO 1328-1:2013 goes from 0 to 45 degree"),
        ((21, float("nan"), 15.0), "helix angle nan degree"),
        ((21, 20.0, 3.9), "face width 3.9 mm: ISO 1328-1:2013 goes from 4 to 1200 mm"),
        ((21, 20.0, 1201.0), "face width 1201 mm"),
    ],
)
def test_a_gear_outside_the_scope_of_2013_is_refused(gear, message):
    with pytest.raises(ValueError, match=message):
        require_gear(*gear, 2013)
    require_gear(*gear, 1995)


@pytest.mark.parametrize("gear", [(5, 45.0, 4.0), (1000, -45.0, 1200.0)])
def test_the_ends_of_the_scope_of_2013_belong_to_it(gear):
    require_gear(*gear, 2013)
