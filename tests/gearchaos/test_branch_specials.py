"""Special points of a curve whose orbits and multipliers are known in closed form."""

from itertools import pairwise

import numpy as np
import pytest
from gearchaos_kernels import Plan

from gearchaos.dynamics.arclength import Curve
from gearchaos.dynamics.branch_specials import LOCATED, specials_between, with_pairs_parted
from gearchaos.dynamics.curve_defects import Defect
from gearchaos.dynamics.side_by_side import run
from gearchaos.records.branch import FOLD, GRAZING

IMPACTS_DRIVING = 1

CURVE = Curve(None, 0, Plan(12, 0, 1, 1, method="flow_map"), 1, np.ones(1))


def cubic_curve(bend, touches=False, gap=0.0):
    """Return the defects of the map x + share - 0.5 - x^3 + bend x, of one state.

    Its orbits lie at the share 0.5 + x^3 - bend x, with the multiplier 1 - 3 x^2 + bend. With
    ``touches``, an impact on the driving flank appears where x passes 0. No orbit is closer to
    x = 0 than half of ``gap``.
    """

    def defects(requests):
        found = []
        for request in requests:
            x, share = request.place
            distance = np.array([share - 0.5 - x**3 + bend * x])
            slopes = np.array([[bend - 3.0 * x**2, 1.0]])
            bordered = np.vstack([slopes, request.normal])
            step = np.linalg.solve(bordered, np.append(distance, 0.0))
            along = np.linalg.solve(bordered, np.array([0.0, 1.0]))
            size = float(np.abs(distance[0])) if abs(x) > gap / 2.0 else np.nan
            section = np.array([[x]])
            contact = np.zeros((1 if touches else 0, 4))
            contact[:, IMPACTS_DRIVING] = x > 0.0
            found.append(Defect(distance, size, slopes, step, along, section, contact))
        return found

    return defects


def points_at(bend, states):
    """Search for the points of the cubic curve near these states."""
    points = []
    for x in states:
        place = np.array([x, 0.5 + x**3 - bend * x])
        direction = np.array([1.0, 3.0 * x**2 - bend])
        points.append((yield from CURVE.correcting(place, direction)))
    return points


def special_points(bend, states):
    """Return the special points found between the points of the cubic curve at these states."""

    def search():
        points = yield from points_at(bend, states)
        points = yield from with_pairs_parted(CURVE, points)
        found = []
        for one, other in pairwise(points):
            found += yield from specials_between(CURVE, one, other, LOCATED)
        return found

    return run(search(), cubic_curve(bend))


COARSE = (-0.8, -0.5, -0.21, 0.2, 0.5, 0.8)


@pytest.mark.parametrize("bend", (0.09, 0.05, 0.02, 1e-3))
def test_two_folds_between_the_same_points_are_both_found(bend):
    x = np.sqrt(bend / 3.0)
    assert -COARSE[2] > x
    found = special_points(bend, COARSE)
    assert [kind for kind, _, _ in found] == [FOLD, FOLD]
    for (_, point, _), state in zip(found, (-x, x), strict=True):
        assert point.share == pytest.approx(0.5 + state**3 - bend * state, abs=1e-9)
        assert point.place[0] == pytest.approx(state, abs=1e-6)


def test_a_curve_that_nearly_folds_has_no_special_point():
    assert special_points(-1e-3, COARSE) == []


def test_two_folds_on_both_sides_of_a_grazing_are_found():
    def search():
        one, other = yield from points_at(0.01, (-0.21, 0.2))
        return (yield from specials_between(CURVE, one, other, LOCATED))

    found = run(search(), cubic_curve(0.01, touches=True))
    found.sort(key=lambda special: special[1].place[0])
    assert [kind for kind, _, _ in found] == [FOLD, GRAZING, FOLD]
    x = np.sqrt(0.01 / 3.0)
    states = [point.place[0] for _, point, _ in found]
    np.testing.assert_allclose(states, [-x, 0.0, x], rtol=0, atol=1e-6)


@pytest.mark.parametrize(("method", "found"), [("rk4", True), ("flow_map", False)])
def test_a_grazing_at_which_the_curve_of_rk4_jumps_is_located(method, found):
    plan = CURVE.plan._replace(method=method)
    curve = CURVE._replace(plan=plan)

    def search():
        one, other = yield from points_at(-0.1, (-0.21, 0.13))
        return (yield from specials_between(curve, one, other, LOCATED))

    specials = run(search(), cubic_curve(-0.1, touches=True, gap=4e-7))
    assert [kind for kind, _, _ in specials] == ([GRAZING] if found else [])
    if found:
        assert abs(specials[0][1].place[0]) < 1e-5
