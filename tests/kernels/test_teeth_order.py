"""Pitch errors of single teeth against exact motions: the method keeps its order."""

import numpy as np
import pytest
from gearchaos_kernels import Effects, Teeth

from .exact import Exact
from .reference import (
    FULL,
    NO_BACKLASH,
    columns,
    drawn_teeth,
    pan2021,
    run,
    state,
)
from .test_evaluation import lane
from .test_order import measured_order
from .test_twin import named

# The place of a spline knot within its step changes the error, but not its order. In the first row
# knots lie at the ends of steps. In the second row they lie all over the steps. Within a row, the
# places are the same for all step counts.
STEPS = 20 * np.array([10, 12, 14, 17, 20, 24, 28, 34, 40]) + np.array([[0], [11]])
PERIODS = 3
START = np.stack(
    [
        state(delta_5=2.0, delta_5_rate=0.1),
        state(delta_5=-1.2, delta_5_rate=-0.3),
        state(delta_5=0.3, delta_5_rate=0.6),
    ]
)
LANES = len(START)
# The bearings are soft, because the free oscillation on stiff ones would dominate the error.
MODEL = pan2021(
    5.86,
    error_mean=np.linspace(-0.1, 0.1, LANES),
    transverse_stiffness_p=2.0,
    transverse_stiffness_g=1.0,
    axial_stiffness_p=1.5,
    axial_stiffness_g=2.5,
)
SCENES = [NO_BACKLASH, FULL]


def spur_teeth(driving: int, driven: int, lanes: int) -> Teeth:
    """Return tooth errors of spur gears of contact ratio 1.5; a pair has the share 1/2 or 1."""
    helical = drawn_teeth(driving, driven, lanes)
    return helical._replace(share=np.repeat([0.5, 1.0, 0.5], helical.cells_per_period // 2))


def assert_order(scene: Effects, physical: bool, teeth: Teeth) -> None:
    """Compare with exact motions: the order of every lane, and the numbers of crossings."""
    exact = []
    for number, start in enumerate(START):
        groups = lane(MODEL, number)
        groups.profile = teeth.profile[number]
        exact.append(Exact(groups, scene, physical, teeth, PERIODS).follow(start, PERIODS))
    wanted = np.stack([motion.states[:, columns(scene)] for motion in exact])
    crossings = [motion.crossings for motion in exact]
    assert min(crossings) > 0 or not scene.backlash
    for row in STEPS:
        errors = []
        for steps in row:
            # The history has no effect here; other tests have compiled this loop with a history.
            how = {"periods": PERIODS, "physical": physical, "history": 1}
            how["resolved"] = scene.backlash
            outcome = run(MODEL, scene, START, steps=int(steps), **how, teeth=teeth)
            errors.append(np.abs(outcome.section - wanted).max(axis=(1, 2)))
            assert outcome.crossings.tolist() == crossings
        orders = [measured_order(of_lane, row) for of_lane in np.transpose(errors)]
        assert min(orders) > 3.8


@pytest.mark.parametrize("scene", SCENES, ids=named)
@pytest.mark.parametrize("physical", [False, True])
def test_motions_of_helical_teeth_converge_with_order_four(scene, physical):
    assert_order(scene, physical, drawn_teeth(3, 2, LANES))


@pytest.mark.parametrize("scene", SCENES, ids=named)
def test_motions_of_spur_teeth_converge_with_order_four(scene):
    assert_order(scene, False, spur_teeth(3, 2, LANES))
