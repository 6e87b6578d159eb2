"""Integrations of arrays and plans that do not fit are refused before compiled code runs."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate

from .reference import NO_AXIAL, pan2021, system_of

PLAN = Plan(200, 30, 10, 10)


@pytest.fixture(scope="module")
def pairs():
    """Three pairs with six states."""
    return system_of(pan2021(np.array([4.0, 5.0, 6.0])), NO_AXIAL)


@pytest.mark.parametrize("shape", [(3, 7), (3, 5), (2, 6), (4, 6), (18,), (3, 6, 1), ()])
def test_states_of_another_shape_are_refused(pairs, shape):
    with pytest.raises(ValueError, match=r"start has the shape .*3 lanes of 6 states need"):
        integrate(pairs, np.zeros(shape), PLAN)
    with pytest.raises(ValueError, match="tangent_start has the shape"):
        integrate(pairs, np.zeros((3, 6)), PLAN, tangent_start=np.zeros(shape))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"steps_per_period": 0}, "steps_per_period = 0: must be at least 1"),
        ({"transient_periods": -30}, "transient_periods = -30: must be at least 0"),
        ({"section_points": -1}, "section_points = -1: must be at least 0"),
        ({"section_points": 41}, r"section_points = 41: must be at most .* recorded_periods, 40"),
        ({"history_periods": 41}, r"history_periods = 41: must be at most .* recorded_periods, 40"),
    ],
)
def test_plans_that_cannot_be_are_refused(pairs, changes, words):
    with pytest.raises(ValueError, match=words):
        integrate(pairs, np.zeros((3, 6)), PLAN._replace(**changes))


@pytest.mark.parametrize("periods", [[1, 2], [1, 2, 11], [1, -1, 3]])
def test_periods_of_lanes_that_do_not_fit_are_refused(pairs, periods):
    with pytest.raises(ValueError, match="periods"):
        integrate(pairs, np.zeros((3, 6)), PLAN, periods=np.array(periods))
