"""The kernels against their slow twin: all combinations of any two effects, in both forms."""

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from gearchaos_kernels import Effects, Groups

from .reference import (
    FLOW_MAP,
    FULL,
    LINEAR,
    NO_AXIAL,
    NO_BACKLASH,
    TORSION,
    TORSION_ONLY,
    columns,
    drawn_teeth,
    pan2021,
    run,
    state,
)
from .twin import Twin

STEPS = 60
PERIODS = 3
ROUNDING = 2e-11

NO_TRANSVERSE = TORSION._replace(backlash=True, axial=True, friction=True)
FRICTION = FULL._replace(friction=True)
SCENES = [FULL, TORSION_ONLY, NO_BACKLASH, LINEAR, TORSION, NO_TRANSVERSE]
SCENES += [TORSION._replace(stiffness_variation=True, transverse=True, friction=True), FRICTION]
"""No formula depends on more than two effects; any two occur together, each alone, and neither.

Most of these scenes are compiled for other tests anyway.
"""

# The groups differ enough from Pan 2021 that a test would detect any two that are mixed up.
MODEL = pan2021(
    [5.0, 11.0],
    error_mean=[0.21, -0.13],
    error_phase=[0.7, -2.1],
    load=[0.25, -0.31],
    damping_ratio=[0.03, 0.05],
    half_backlash=[0.7, 0.4],
    base_helix_angle=[0.33, 0.4],
    mesh_frequency=[0.9, 1.3],
    axial_stiffness_p=[22.0, 17.0],
    axial_damping_p=[0.11, 0.07],
    axial_stiffness_g=[9.0, 5.0],
    axial_damping_g=[0.02, 0.03],
    friction_coefficient=[0.2, 0.4],
    friction_lever=[0.41, 0.36],
    # One pitch point lies within a step, the other one at the end of a step.
    pitch_point_phase=[1.3, -1.5 * np.pi],
)
IN_PHASE = MODEL._replace(error_phase=np.zeros(2))
"""The phase of the pitch error is a separate effect; only one scene has it."""
START = np.stack(
    [
        state(delta_5=1.0, delta_1=0.02, delta_2_rate=-0.05, delta_3=0.3, delta_4_rate=0.1),
        state(delta_5=-0.8, delta_5_rate=0.3, delta_2=0.04, delta_3_rate=0.2, delta_4=-0.2),
    ]
)


def lane(number: int, model: Groups = MODEL) -> SimpleNamespace:
    groups = zip(Groups._fields, model, strict=True)
    return SimpleNamespace(**{name: float(values[number]) for name, values in groups})


def named(scene: Effects) -> str:
    effects = [name for name, present in scene._asdict().items() if present]
    return "+".join(effects) or "torsion"


def test_every_two_effects_are_there_in_all_four_combinations():
    assert all(
        np.unique(pair, axis=1).shape[1] == 4 for pair in combinations(np.transpose(SCENES), 2)
    )


@pytest.mark.parametrize("physical", [False, True])
def test_kernels_share_the_errors_of_the_teeth_in_mesh(physical):
    teeth = drawn_teeth(3, 2, lanes=2)
    how = {"steps": STEPS, "periods": PERIODS, "physical": physical, "teeth": teeth}
    # The history has no effect here; other tests have compiled this loop with a history.
    outcome = run(MODEL, NO_BACKLASH, START, **how, history=1)
    for number in range(2):
        groups = lane(number)
        groups.profile = teeth.profile[number]
        twin = Twin(groups, NO_BACKLASH, physical, teeth).integrate(START[number], STEPS, PERIODS)
        assert outcome.section[number] == pytest.approx(twin.states, rel=0, abs=ROUNDING)
        assert outcome.growth[number] == pytest.approx(twin.growth, rel=0, abs=ROUNDING)


@pytest.mark.parametrize("scene", SCENES, ids=named)
def test_kernels_follow_the_printed_equations(scene):
    model = MODEL if scene == NO_BACKLASH else IN_PHASE
    for physical in (False, True):
        outcome = run(model, scene, START, steps=STEPS, periods=PERIODS, physical=physical)
        for number in range(2):
            groups = lane(number, model)
            twin = Twin(groups, scene, physical).integrate(START[number], STEPS, PERIODS)
            assert outcome.section[number] == pytest.approx(
                twin.states[:, columns(scene)], rel=0, abs=ROUNDING
            )
            assert outcome.growth[number] == pytest.approx(twin.growth, rel=0, abs=ROUNDING)


def test_the_lanes_of_the_twin_test_visit_every_branch_of_the_clearance():
    class Watched(Twin):
        def clearance(self, y, half_backlash):
            elastic, slope = super().clearance(y, half_backlash)
            direction = "y" if half_backlash == self.half_backlash_y else "z"
            visited.add((direction, int(np.sign(elastic))))
            return elastic, slope

    visited: set[tuple[str, int]] = set()
    for number in range(2):
        groups = lane(number)
        twin = Watched(groups, Effects())
        twin.half_backlash_y = groups.half_backlash * np.cos(groups.base_helix_angle)
        twin.integrate(START[number], STEPS, PERIODS)
    assert visited == {(direction, branch) for direction in "yz" for branch in (-1, 0, 1)}


@pytest.mark.parametrize("physical", [False, True])
def test_a_spur_pair_has_an_axial_motion_of_its_bearings_alone(physical):
    spur = IN_PHASE._replace(base_helix_angle=np.zeros(2))
    outcome = run(spur, Effects(), START, steps=STEPS, periods=PERIODS, physical=physical)
    for number in range(2):
        groups = lane(number, spur)
        twin = Twin(groups, Effects(), physical).integrate(START[number], STEPS, PERIODS)
        assert outcome.section[number] == pytest.approx(twin.states, rel=0, abs=ROUNDING)
        assert outcome.growth[number] == pytest.approx(twin.growth, rel=0, abs=ROUNDING)


def test_a_scene_has_its_own_states_in_the_one_order():
    outcome = run(IN_PHASE, NO_TRANSVERSE, START, steps=STEPS, periods=PERIODS)
    assert NO_TRANSVERSE.states == (
        "delta_5",
        "delta_5_rate",
        "delta_3",
        "delta_3_rate",
        "delta_4",
        "delta_4_rate",
    )
    assert outcome.section.shape == (2, PERIODS, 6)
    assert outcome.end_state.shape == outcome.end_tangent.shape == (2, 6)


def test_axial_motion_acts_on_nothing_else():
    # Flow maps, because Runge-Kutta steps are also split where the axial gap crosses.
    how = {"steps": STEPS, "periods": PERIODS, "resolved": FLOW_MAP}
    full = run(IN_PHASE, FULL, START, **how)
    without = run(IN_PHASE, NO_AXIAL, START, **how)
    assert full.section[:, :, :6] == pytest.approx(without.section, abs=ROUNDING)
