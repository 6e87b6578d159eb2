"""Corners of a branch: an orbit begins or ends a contact at mesh phase 0.

Where a force jumps with the contact, as a damper that acts in contact only does, the state at
mesh phase 0 has a derivative by the parameter that jumps with it. The orbit itself changes
smoothly, and so do its multipliers.
"""

import numpy as np
from gearchaos_kernels import gaps_along

from gearchaos.arrays import Integers
from gearchaos.dynamics.arclength import Curve, CurvePoint, along_the_way
from gearchaos.dynamics.curve_defects import Finding

BEYOND = 1e-7, 1e-6, 1e-5, 1e-4
"""Distances at which a point beyond a corner is searched, one after the other."""

REACH = 10.0
"""Largest distance of this point from its prediction, relative to the distance."""


def beyond_corner(curve: Curve, here: CurvePoint) -> Finding[CurvePoint | None]:
    """Search a point of a curve beyond a corner.

    Parameters
    ----------
    curve : Curve
        The curve.
    here : CurvePoint
        Its last point before the corner, next to it.

    Returns
    -------
    CurvePoint or None
        The point; None where the contact at mesh phase 0 does not change next to ``here``.
    """
    fixed = along_the_way(curve.scale.size)
    for distance in BEYOND:
        guess = here.place + distance * here.tangent
        if not 0.0 <= guess[-1] <= 1.0:
            return None
        found = yield from curve.correcting(guess, here.tangent, fixed, reach=REACH * distance)
        if found is not None and _contact_changes(curve, here, found):
            # The parameter keeps its direction; the state may turn by any angle.
            onward = np.sign(found.tangent[-1] * here.tangent[-1]) or 1.0
            return found._replace(tangent=onward * found.tangent)
    return None


def _contact_changes(curve: Curve, one: CurvePoint, other: CurvePoint) -> bool:
    """Whether two orbits touch different flanks at mesh phase 0."""
    return bool(np.any(_flanks(curve, one) != _flanks(curve, other)))


def _flanks(curve: Curve, point: CurvePoint) -> Integers:
    """Return the flanks that an orbit touches at its section points, (periods, elements)."""
    system = curve.systems_at(
        np.full(curve.periods, curve.number), np.full(curve.periods, point.share)
    )
    gaps = gaps_along(system, point.section[:, np.newaxis], curve.plan.steps_per_period)
    return gaps.flank[:, 0].astype(np.intp)
