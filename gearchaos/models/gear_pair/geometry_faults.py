"""Faults of the geometry of a gear pair: contradictory or impossible data."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from gearchaos.configuration.messages import Fault

_SAME = 0.005
"""Centre distances, over the normal module, that are equal up to the digits of a drawing."""


def geometry_faults(pair: Any, paths: dict[str, str]) -> Iterator[Fault]:
    """Yield the faults of a `HelicalPair` whose data are numbers.

    ``paths``: path of the keys centre_distance, contact_ratio and tip_diameters in the messages.
    """
    both = pair.contact_ratio is not None and pair.tip_diameters is not None
    if both:
        rule = "is given beside the tip diameters, from which it follows"
        yield Fault(paths["contact_ratio"], rule, "keep one of the two", pair.contact_ratio)
    distance, bases = pair.centre_distance, float(sum(pair.base_radii))
    if distance is not None and distance <= bases:
        rule = f"must exceed the sum of the base radii, {1e3 * bases:.6g} mm"
        yield Fault(
            paths["centre_distance"], rule, "check it, the module and the teeth", _mm(distance)
        )
        return
    yield from _contradictory_shift(pair, paths)
    shortest = [2.0 * float(base) for base in pair.base_radii]
    tips = pair.tip_diameters
    if tips is not None and any(tip <= base for tip, base in zip(tips, shortest, strict=True)):
        rule = f"must exceed the base diameters, {_mm(shortest[0])} and {_mm(shortest[1])} mm"
        yield Fault(
            paths["tip_diameters"], rule, "give the diameters of the tip circles", [*map(_mm, tips)]
        )
        return
    ratio = float(pair.total_contact_ratio)
    if not both and not ratio >= 1.0:
        rule = f"give a total contact ratio of {ratio:.4g}, must be at least 1"
        remedy = "check the centre distance, the tip diameters and the profile shifts"
        yield Fault(paths["contact_ratio"].rpartition(".")[0], f"the data {rule}", remedy)


def _contradictory_shift(pair: Any, paths: dict[str, str]) -> Iterator[Fault]:
    """Yield a centre distance that the sum of the profile shifts does not have."""
    if pair.centre_distance is None:
        return
    if pair.profile_shift is None:
        apart = abs(pair.centre_distance - pair.standard_centre_distance)
        unknown = pair.tip_diameters is None and pair.contact_ratio is None
        if unknown and apart > _SAME * pair.normal_module:
            rule = "does not determine the tip circles of gears with profile shift"
            remedy = "give the profile shifts, the tip diameters or the contact ratio as well"
            yield Fault(paths["centre_distance"], rule, remedy, _mm(pair.centre_distance))
        return
    shifted = replace(pair, centre_distance=None).working_centre_distance
    if not abs(shifted - pair.centre_distance) <= _SAME * pair.normal_module:
        total = float(np.sum(pair.profile_shift))
        rule = f"profile shifts of {total:.6g} in all have {1e3 * shifted:.6g} mm"
        remedy = "correct one of the two, or leave one out"
        yield Fault(paths["centre_distance"], rule, remedy, _mm(pair.centre_distance))


def _mm(length: float) -> float:
    """Return a length in mm, without the digits that the conversion adds."""
    return float(f"{1e3 * length:.9g}")
