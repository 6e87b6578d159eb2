"""Every group may differ between lanes: a batch equals its lanes integrated separately."""

import numpy as np
import pytest
from gearchaos_kernels import Effects, Groups

from .reference import FULL, assert_same_bits, lanes_of, lanes_out_of, pan2021, run, state

LANES = 5
ACTING = {"error_mean": 0.03, "friction_coefficient": 0.2, "pitch_point_phase": 1.0}
BASE = pan2021(np.full(LANES, 5.86), error_phase=0.5, **ACTING)
START = np.tile(state(delta_5=1.1, delta_1_rate=0.02, delta_3=0.01), (LANES, 1))
HOW = {"steps": 96, "transient": 4, "periods": 6}
SWEPT = [(group, True) for group in Groups._fields]
SWEPT += [(group, False) for group in Groups._fields if group != "error_phase"]
"""Groups, and whether steps are resolved; plain steps have no phase, to compile fewer loops."""

OF_FRICTION = {"friction_coefficient", "friction_lever", "pitch_point_phase"}
"""Groups of friction, an effect that Pan 2021 leaves out.

They are tested without phase, because other tests compile this loop.
"""


def effects_of(group: str) -> Effects:
    return FULL._replace(friction=group in OF_FRICTION)


def swept(group: str, resolved: bool = True) -> Groups:
    base = (
        BASE
        if resolved and group not in OF_FRICTION
        else BASE._replace(error_phase=np.zeros(LANES))
    )
    return base._replace(**{group: getattr(BASE, group) * np.linspace(0.8, 1.2, LANES)})


def alone(model: Groups, lane: int, resolved: bool, effects: Effects = FULL):
    return run(lanes_of(model, [lane]), effects, START[[lane]], **HOW, resolved=resolved)


@pytest.mark.parametrize(("group", "resolved"), SWEPT)
def test_a_group_swept_over_the_lanes_gives_the_lanes_integrated_alone(group, resolved):
    model, effects = swept(group, resolved), effects_of(group)
    batch = run(model, effects, START, **HOW, resolved=resolved)
    for lane in range(LANES):
        assert_same_bits(lanes_out_of(batch, [lane]), alone(model, lane, resolved, effects))
    # No group is ignored: each one changes the end state of a scene in which it acts.
    ends = batch.end_state[:, 0::2]
    assert (np.abs(ends[1:] - ends[:-1]).max(axis=1) > 1e-9).all()


def test_a_phase_swept_through_zero_gives_the_lanes_integrated_alone():
    # If the lane with phase zero is integrated alone, its loop is compiled without phase.
    model = BASE._replace(error_phase=np.linspace(-0.4, 0.4, LANES))
    assert model.error_phase[2] == 0.0
    batch = run(model, FULL, START, **HOW, resolved=True)
    for lane in range(LANES):
        assert_same_bits(lanes_out_of(batch, [lane]), alone(model, lane, True))


def test_a_swept_mesh_frequency_keeps_the_number_of_steps_in_each_lanes_own_period():
    model = swept("mesh_frequency")
    batch = run(model, FULL, START, **{**HOW, "steps": 1600}, resolved=True)
    fine = run(model, FULL, START, **{**HOW, "steps": 3200}, resolved=True)
    assert batch.section == pytest.approx(fine.section, rel=0, abs=2e-4)
    assert np.unique(batch.section[:, -1, 0]).size == LANES
