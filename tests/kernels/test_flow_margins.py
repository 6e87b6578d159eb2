"""Margins of cubics find crossings that the ends of a step do not show.

The example is a spur pair at the back flank, without damping or varying stiffness. Between the
flanks, the distance u from the back flank follows these equations, with theta = Omega tau,
a = E Omega^2 and load = -2 a / pi:

    u'' = load + a sin(theta),    u = u_0 + rise theta / pi + E g(theta),

    g = theta - sin(theta) - theta^2 / pi.

g and its slope are 0 at theta = 0 and pi, and g is -0.21 in the middle. Over a step of half a
period the cubic is therefore a straight line, but the gap meets the flank and leaves it again.
"""

import numpy as np
import pytest
from gearchaos_kernels.methods.flow_map.layout import TERMS
from gearchaos_kernels.methods.flow_map.series import _BENDS
from numpy.polynomial import Polynomial

from .reference import FLOW_MAP, TORSION_ONLY, pan2021, run

OMEGA, HALF_BACKLASH, LANES = 8.0, 5.0, 9
PARALLEL = {"base_helix_angle": 0.0, "damping_ratio": 0.0, "stiffness_variation_scale": 0.0}
SPUR = pan2021(
    0.0,
    mesh_frequency=OMEGA,
    error_amplitude=np.ones(LANES),
    load=-2.0 * OMEGA**2 / np.pi,
    half_backlash=HALF_BACKLASH,
    **PARALLEL,
)
RISE = np.linspace(0.15, 0.4, LANES)
"""Rise of the straight line in units of E, small enough that the gap meets the flank."""


@pytest.mark.parametrize("distance", [1e-3, -1e-3], ids=["first", "second"])
def test_a_crossing_that_a_cubic_does_not_see_is_found(distance):
    """The first crossing of a step, and the second one of a step that starts in contact."""
    start = np.zeros((LANES, 10))
    start[:, 0] = distance - HALF_BACKLASH
    start[:, 1] = RISE * OMEGA / np.pi
    coarse, fine = (
        run(SPUR, TORSION_ONLY, start, steps=steps, physical=True, resolved=FLOW_MAP)
        for steps in (2, 64)
    )
    assert coarse.crossings.tolist() == fine.crossings.tolist()
    # A lane that starts in contact leaves the flank. Every lane then meets the flank and leaves it,
    # and meets it again in the second half of the period.
    assert (fine.crossings >= (3 if distance > 0.0 else 4)).all()
    assert coarse.section == pytest.approx(fine.section, rel=0, abs=1e-11)
    assert coarse.growth == pytest.approx(fine.growth, rel=0, abs=1e-9)


@pytest.mark.parametrize("power", range(4, TERMS))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_lowered_cubic_lies_below_each_power_of_a_step(power, sign):
    """A margin lowers both middle Bezier points of a cubic.

    For a piece of a step, the margin is smaller by the fourth power of the piece's share. For -s^4,
    it is exactly as large as necessary.
    """
    for left, right in ((-1.0, 1.0), (-1.0, -0.4), (-0.3, 0.5), (0.6, 1.0)):
        width, t = right - left, np.linspace(0.0, 1.0, 201)
        gap = sign * Polynomial([0.0] * power + [1.0])
        ends = [gap(left), gap(right)]
        slopes = [gap.deriv()(left) * width, gap.deriv()(right) * width]
        margin = _BENDS[power] * (width / 2.0) ** 4
        middle = ends[0] + slopes[0] / 3.0 - margin, ends[1] - slopes[1] / 3.0 - margin
        weights = (1.0 - t) ** 3, 3.0 * t * (1.0 - t) ** 2, 3.0 * t**2 * (1.0 - t), t**3
        lowered = sum(map(np.multiply, weights, (ends[0], *middle, ends[1])))
        room = gap(left + t * width) - lowered
        assert room.min() > -1e-14
        if power == 4 and sign < 0.0:
            assert room[100] == pytest.approx(0.0, abs=1e-14)
