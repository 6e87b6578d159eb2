"""Limits of the pitch deviations of a gear by its accuracy grade: ISO 1328-1 of 1995 and of 2013.

GB/T 10095.1-2008 is that of 1995. It takes the geometric means of ranges of module and diameter,
that of 2013 the two themselves; both have a factor of sqrt(2) from grade to grade, beginning with
grade 5, and round to 0.1 um below 5 um, to 0.5 um up to 10 um, and to whole ones above.

How sure this is: formulas, ranges and rounding agree with public programs of others (two for each
edition), those of 1995 also with values printed from it (grade 7, module over 2 to 3.5 mm: 11 um
for diameters over 20 to 50 mm, 12 um over 50 to 125 mm). They have not been compared with every
entry of the tables of 1995, which leave out large modules on small diameters.
"""

from __future__ import annotations

import math
from bisect import bisect_left

_MODULES_MM = (0.5, 2.0, 3.5, 6.0, 10.0, 16.0, 25.0, 40.0, 70.0)
_DIAMETERS_MM = (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10_000)
"""Ends of the ranges of 1995; the upper one belongs to its range."""

_LARGEST_DIAMETER_MM = {1995: _DIAMETERS_MM[-1], 2013: 15_000}
_GRADES = {1995: 12, 2013: 11}


def single_pitch_um(
    grade: float, normal_module_mm: float, reference_diameter_mm: float, edition: int = 1995
) -> float:
    """Return the limit f_p of the amount of every single pitch deviation, in um.

    Parameters
    ----------
    grade : int
        1 to 12, or to 11 with the edition of 2013; that of 1995 knows a grade 0, too, which is not
        offered.
    normal_module_mm, reference_diameter_mm : float
        In mm, from 0.5 to 70 and from 5 to 10000, or to 15000 with the edition of 2013.
    edition : {1995, 2013}

    Raises
    ------
    ValueError
        If one of them is outside its range.
    """
    module, diameter = _sizes(grade, normal_module_mm, reference_diameter_mm, edition)
    if edition == 1995:
        return _limit(0.3 * (module + 0.4 * math.sqrt(diameter)) + 4.0, grade)
    return _limit(0.001 * diameter + 0.4 * module + 5.0, grade)


def cumulative_pitch_um(
    grade: float, normal_module_mm: float, reference_diameter_mm: float, edition: int = 1995
) -> float:
    """Return the limit F_p of the range of the cumulative pitch deviations, in um.

    Parameters and errors are those of `single_pitch_um`.
    """
    module, diameter = _sizes(grade, normal_module_mm, reference_diameter_mm, edition)
    root = math.sqrt(diameter)
    if edition == 1995:
        return _limit(0.3 * module + 1.25 * root + 7.0, grade)
    return _limit(0.002 * diameter + 0.55 * root + 0.7 * module + 12.0, grade)


def _sizes(grade: float, module: float, diameter: float, edition: int) -> tuple[float, float]:
    """Return the module and the diameter that the formulas take, in mm."""
    if edition not in _GRADES:
        raise ValueError(f"edition {edition} of ISO 1328-1: must be 1995 or 2013")
    standard = f"ISO 1328-1:{edition}"
    if grade not in range(1, _GRADES[edition] + 1):
        raise ValueError(f"grade {grade:g}: {standard} has grades 1 to {_GRADES[edition]}")
    for value, name, least, most in (
        (module, "normal module", _MODULES_MM[0], _MODULES_MM[-1]),
        (diameter, "reference diameter", _DIAMETERS_MM[0], _LARGEST_DIAMETER_MM[edition]),
    ):
        if not least <= value <= most:
            raise ValueError(f"{name} {value:.6g} mm: {standard} goes from {least:g} to {most:g}")
    if edition == 1995:
        return _mean_of_range(module, _MODULES_MM), _mean_of_range(diameter, _DIAMETERS_MM)
    return module, diameter


def _mean_of_range(value: float, ends: tuple[float, ...]) -> float:
    upper = bisect_left(ends, value, lo=1)
    return math.sqrt(ends[upper - 1] * ends[upper])


def _limit(of_grade_5: float, grade: float) -> float:
    limit = of_grade_5 * math.pow(2.0, (grade - 5.0) / 2.0)
    per_um = 10 if limit < 5.0 else 2 if limit <= 10.0 else 1
    return math.floor(limit * per_um + 0.5) / per_um
