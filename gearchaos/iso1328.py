"""Limits of the pitch deviations of a gear by its accuracy grade: ISO 1328-1 of 1995 and of 2013.

GB/T 10095.1-2008 is that of 1995. It takes the geometric means of ranges of module and diameter,
that of 2013 the two themselves; both have a factor of sqrt(2) from grade to grade, beginning with
grade 5, and round to 0.1 um below 5 um, to 0.5 um up to 10 um, and to whole ones above.

Verification: formulas, ranges and rounding agree with public programs of others (two for each
edition), those of 1995 also with values printed from it (grade 7, module over 2 to 3.5 mm: 11 um
for diameters over 20 to 50 mm, 12 um over 50 to 125 mm). They have not been compared with every
entry of the tables of 1995, which leave out large modules on small diameters.
"""

import math
from bisect import bisect_left

from gearchaos.errors import RangeError

_MODULES_MM = (0.5, 2.0, 3.5, 6.0, 10.0, 16.0, 25.0, 40.0, 70.0)
_DIAMETERS_MM = (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10_000)
_RANGES = {
    1995: (range(13), _MODULES_MM, _DIAMETERS_MM),
    2013: (range(1, 12), (0.5, 70.0), (5, 15_000)),
}
"""Grades, and ends of the ranges of module and diameter; a range includes its upper end."""


_GEARS_OF_2013 = {
    "number of teeth": (5, 1000, ""),
    "helix angle": (0, 45, " degree"),
    "face width": (4, 1200, " mm"),
}
"""Further limits of the edition of 2013: lowest and highest value, and unit."""


def require_gear(teeth: int, helix_angle_deg: float, face_width_mm: float, edition: int) -> None:
    """Check that a gear is within the ranges of an edition.

    Parameters
    ----------
    teeth : int
        Number of teeth.
    helix_angle_deg : float
        Helix angle in degrees.
    face_width_mm : float
        Face width in mm.
    edition : int
        1995 or 2013.

    Raises
    ------
    ValueError
        If the gear is outside the ranges.

    Notes
    -----
    The edition of 2013 is for 5 to 1000 teeth, helix angles up to 45 degrees and face widths of 4
    to 1200 mm. That of 1995 limits only module and diameter for pitch deviations, which
    `single_pitch_um` checks.

    Examples
    --------
    >>> gearchaos.iso1328.require_gear(21, 20.0, 15.0, 2013)
    """
    values = (teeth, abs(helix_angle_deg), face_width_mm)
    for (name, (low, high, unit)), value in zip(_GEARS_OF_2013.items(), values, strict=True):
        if edition == 2013 and not low <= value <= high:
            within = f"{low} to {high}{unit}"
            raise ValueError(f"{name} {value:.6g}{unit}: ISO 1328-1:2013 goes from {within}")


def single_pitch_um(
    grade: float, normal_module_mm: float, reference_diameter_mm: float, edition: int = 1995
) -> float:
    """Return the limit f_p of the amount of every single pitch deviation.

    Parameters
    ----------
    grade : float
        Accuracy grade, 0 to 12; 1 to 11 in the edition of 2013.
    normal_module_mm : float
        Normal module in mm, 0.5 to 70.
    reference_diameter_mm : float
        Reference diameter in mm, 5 to 10000; 5 to 15000 in the edition of 2013.
    edition : int
        1995 or 2013.

    Returns
    -------
    float
        The limit in um.

    Raises
    ------
    RangeError
        If an argument is outside its range. It is a ConfigurationError and a ValueError.

    Notes
    -----
    In grade 5, f_p = 0.3 (m + 0.4 sqrt(d)) + 4 by the edition of 1995, with the geometric means m
    and d of the ranges of module and diameter, and f_p = 0.001 d + 0.4 m + 5 by that of 2013. Each
    grade multiplies it by sqrt(2).

    Examples
    --------
    >>> gearchaos.iso1328.single_pitch_um(7, 2.5, 40.0)
    11.0
    """
    return _limits(grade, normal_module_mm, reference_diameter_mm, edition)[0]


def cumulative_pitch_um(
    grade: float, normal_module_mm: float, reference_diameter_mm: float, edition: int = 1995
) -> float:
    """Return the limit F_p of the range of the cumulative pitch deviations.

    Parameters
    ----------
    grade, normal_module_mm, reference_diameter_mm, edition
        As for `single_pitch_um`.

    Returns
    -------
    float
        The limit in um.

    Raises
    ------
    RangeError
        As for `single_pitch_um`.

    Notes
    -----
    In grade 5, F_p = 0.3 m + 1.25 sqrt(d) + 7 by the edition of 1995, and
    F_p = 0.002 d + 0.55 sqrt(d) + 0.7 m + 12 by that of 2013.

    Examples
    --------
    >>> gearchaos.iso1328.cumulative_pitch_um(7, 2.5, 40.0) > 11.0
    True
    """
    return _limits(grade, normal_module_mm, reference_diameter_mm, edition)[1]


def _limits(grade: float, module: float, diameter: float, edition: int) -> list[float]:
    if edition not in _RANGES:
        raise RangeError(f"edition {edition} of ISO 1328-1: must be 1995 or 2013")
    (grades, *ranges), sizes = _RANGES[edition], []
    if grade not in grades:
        raise RangeError(
            f"grade {grade:g}: ISO 1328-1:{edition} has grades {grades[0]} to {grades[-1]}"
        )
    names = ("normal module", "reference diameter")
    for name, value, ends in zip(names, (module, diameter), ranges, strict=True):
        if not ends[0] <= value <= ends[-1]:
            within = f"{ends[0]:g} to {ends[-1]:g} mm"
            raise RangeError(f"{name} {value:.6g} mm: ISO 1328-1:{edition} goes from {within}")
        upper = bisect_left(ends, value, lo=1)
        sizes.append(math.sqrt(ends[upper - 1] * ends[upper]) if edition == 1995 else value)
    m, d = sizes
    if edition == 1995:
        of_grade_5 = (0.3 * (m + 0.4 * math.sqrt(d)) + 4.0, 0.3 * m + 1.25 * math.sqrt(d) + 7.0)
    else:
        cumulative = 0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12.0
        of_grade_5 = (0.001 * d + 0.4 * m + 5.0, cumulative)
    return [_rounded(limit * math.pow(2.0, (grade - 5.0) / 2.0)) for limit in of_grade_5]


def _rounded(limit: float) -> float:
    per_um = 10 if limit < 5.0 else 2 if limit <= 10.0 else 1
    return math.floor(limit * per_um + 0.5) / per_um
