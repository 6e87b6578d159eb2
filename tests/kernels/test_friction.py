"""Friction between the teeth dissipates, and steps keep their order where its sign changes."""

from itertools import pairwise

import numpy as np
import pytest
from gearchaos_kernels import Outcome, Plan, integrate, mesh_motion
from scipy.linalg import expm

from .exact import Exact
from .reference import TORSION, assert_same_bits, lanes_out_of, pan2021, run, state, system_of
from .test_evaluation import lane
from .test_order import CLASSICAL, STEPS, measured_order
from .test_twin import FRICTION
from .twin import Twin

PERIODS = 3
LINEAR_FRICTION = TORSION._replace(friction=True)
PHASE = np.array([0.0, 0.7, np.pi / 2.0, 3.3, -0.4])
"""Phase of the pitch point; in lane 0, and in lane 2 with 4 n steps, it is on the grid of steps."""

MODEL = pan2021(
    5.86,
    damping_ratio=0.04,
    friction_coefficient=0.3,
    pitch_point_phase=PHASE,
    # The bearings are soft, because the free oscillation on stiff ones would dominate the error.
    transverse_stiffness_p=2.0,
    transverse_stiffness_g=1.0,
    axial_stiffness_p=1.5,
    axial_stiffness_g=2.5,
)
START = state(delta_5=2.0, delta_5_rate=0.1)


def follow(steps: int) -> Outcome:
    """Integrate the torsional scene with all records that depend on every step."""
    plan = Plan(steps, 0, PERIODS, PERIODS, tangent=True, loads=True, history_periods=PERIODS)
    system = system_of(MODEL, LINEAR_FRICTION)
    return integrate(system, np.tile(START[:2], (PHASE.size, 1)), plan)


def exact_flow(number: int, begin: float, end: float) -> np.ndarray:
    """Return the map of (state, 1, integral of N_y) between two mesh phases, in periods.

    On each side of the pitch point delta_5'' = f_n - (1 - s mu lambda) cos(beta_b) N_y, with N_y =
    delta_5 + 2 xi delta_5', is linear with constant coefficients.
    """
    groups = lane(MODEL, number)
    period, pitch_point = 2.0 * np.pi / groups.mesh_frequency, groups.pitch_point_phase
    changes = (pitch_point / (2.0 * np.pi) + np.arange(-12, 12) / 2.0) % 12.0
    stops = np.sort([begin, *changes[(changes > begin) & (changes < end)], end])
    flow = np.eye(4)
    for first, last in pairwise(stops):
        behind = (0.5 * (first + last) - pitch_point / (2.0 * np.pi)) % 1.0
        s = 1.0 if behind > 0.5 else -1.0
        share = 1.0 - s * groups.friction_coefficient * groups.friction_lever
        pull = share * np.cos(groups.base_helix_angle)
        damping = 2.0 * groups.damping_ratio
        rates = np.zeros((4, 4))
        rates[0, 1] = 1.0
        rates[1, :3] = -pull, -pull * damping, groups.load
        rates[3, :2] = 1.0, damping
        flow = expm(rates * (last - first) * period) @ flow
    return flow


def exact_motion(number: int, steps: int) -> np.ndarray:
    """Return the state at every step, (samples, 2)."""
    values = [np.array([*START[:2], 1.0, 0.0])]
    for sample in range(PERIODS * steps):
        values.append(exact_flow(number, sample / steps, (sample + 1) / steps) @ values[-1])
    return np.array(values)[:, :2]


def test_a_pair_without_clearance_converges_with_order_four_wherever_the_pitch_point_lies():
    followed = [follow(int(steps)) for steps in STEPS]
    flows = [[exact_flow(n, 0.0, turns + 1.0) for turns in range(PERIODS)] for n in range(5)]
    start = np.array([*START[:2], 1.0, 0.0])
    for number, of_periods in enumerate(flows):
        states = np.array([(flow @ start)[:2] for flow in of_periods])
        lengths = [np.linalg.norm(flow[:2, :2] @ np.ones(2)) for flow in of_periods]
        growth = np.log(np.divide(lengths, np.sqrt(2.0)))
        errors = [np.abs(one.section[number] - states).max() for one in followed]
        assert measured_order(errors) == CLASSICAL
        errors = [np.abs(one.growth[number].cumsum() - growth).max() for one in followed]
        assert measured_order(errors) == CLASSICAL


def test_the_history_has_the_state_at_every_step():
    steps = np.array([50, 100])
    followed = [follow(int(count)) for count in steps]
    for number in (0, 3):
        exact = [exact_motion(number, int(count)) for count in steps]
        errors = [
            np.abs(one.history[number] - wanted).max()
            for one, wanted in zip(followed, exact, strict=True)
        ]
        assert measured_order(errors, steps) > 3.8


def test_the_mean_mesh_force_is_that_of_the_exact_motion():
    period, start = 2.0 * np.pi / MODEL.mesh_frequency[0], np.array([*START[:2], 1.0, 0.0])
    wanted = [(exact_flow(n, 0.0, PERIODS) @ start)[3] / (PERIODS * period) for n in range(5)]
    errors = [np.abs(follow(int(steps)).loads[:, 0, 2] - wanted) for steps in STEPS]
    # In a step with a change of the sign, loads take the state in the middle from the cubic through
    # both ends. The force of the damper is therefore accurate to order 3 only.
    assert measured_order(np.mean(errors, axis=1)) > 2.7
    assert measured_order([of_lanes[0] for of_lanes in errors]) > 3.7


@pytest.mark.parametrize("steps", [1, 2, 3, 5])
def test_a_step_may_hold_every_change_of_the_sign(steps):
    followed = follow(steps)
    for number in range(PHASE.size):
        twin = Twin(lane(MODEL, number), LINEAR_FRICTION).integrate(START, steps, PERIODS)
        assert followed.section[number] == pytest.approx(twin.states[:, :2], rel=1e-11, abs=0)


def test_a_lane_switches_at_its_own_phase_whatever_its_neighbours_do():
    together = follow(50)
    plan = Plan(50, 0, PERIODS, PERIODS, tangent=True, loads=True, history_periods=PERIODS)
    for number in range(5):
        alone = system_of(MODEL, LINEAR_FRICTION).of([number])
        assert_same_bits(
            integrate(alone, START[np.newaxis, :2], plan), lanes_out_of(together, [number])
        )


@pytest.mark.parametrize("physical", [False, True])
def test_motions_with_crossings_converge_with_order_four(physical):
    # The place of a crossing within its step changes the error, but not its order.
    steps = np.array([200, 240, 283, 340, 400, 480, 566, 680, 800])
    exact = [
        Exact(lane(MODEL, number), FRICTION, physical, None, PERIODS).follow(START, PERIODS)
        for number in range(5)
    ]
    wanted, crossings = np.stack([one.states for one in exact]), [one.crossings for one in exact]
    assert min(crossings) > 0
    errors, growths = [], []
    for count in steps:
        how = {"periods": PERIODS, "physical": physical, "resolved": True}
        outcome = run(MODEL, FRICTION, START, steps=int(count), **how)
        assert outcome.crossings.tolist() == crossings
        errors.append(np.abs(outcome.section - wanted).max(axis=(1, 2)))
        growths.append(outcome.growth.cumsum(axis=1))
    assert min(measured_order(one, steps) for one in np.transpose(errors)) > 3.8
    fine = run(MODEL, FRICTION, START, steps=6400, **how).growth.cumsum(axis=1)
    errors = np.abs(np.array(growths) - fine).max(axis=2).T
    assert min(measured_order(one, steps) for one in errors) > 3.8


def test_steps_that_cross_and_change_the_sign_keep_the_order():
    # With 192 phases, some lanes cross a flank in a step in which the sign changes.
    phases = np.linspace(0.0, 2.0 * np.pi, 192, endpoint=False)
    chosen = {name: values[0] for name, values in MODEL._asdict().items()}
    chosen["pitch_point_phase"] = phases
    model = type(MODEL)(*(np.full(phases.size, value) for value in chosen.values()))

    def section(steps):
        outcome = run(model, FRICTION, START, steps=steps, periods=PERIODS, resolved=True)
        return outcome.section, outcome.growth

    steps, fine = np.array([100, 200, 400, 800]), section(6400)
    for found, wanted in zip(zip(*map(section, steps), strict=True), fine, strict=True):
        worst = [np.abs(one - wanted).max() for one in found]
        assert measured_order(worst, steps) > 3.8


def test_friction_takes_energy_from_sliding_on_both_flanks():
    # Samples on the driving and on the back flank. With 90 steps, those of lane 2 are half a step
    # away from the changes of the sign.
    steps, flanks = 90, (1.0, -1.0)
    system = system_of(MODEL, LINEAR_FRICTION)
    for flank in flanks:
        states = np.tile([flank, 0.0], (PHASE.size, 2 * steps, 1))
        motion = mesh_motion(system, states, steps)
        force = motion.force_tangential
        assert (np.sign(force) == flank).all()
        cosine = np.cos(MODEL.base_helix_angle[0])
        share = 1.0 - (MODEL.load[0] - motion.accelerations[:, :, 0]) / (cosine * force)
        size = MODEL.friction_coefficient * MODEL.friction_lever
        assert np.abs(share) == pytest.approx(np.tile(size[:, np.newaxis], (1, 2 * steps)))
        # The moment of friction on the driving gear is share * force in units of the base radius;
        # the moment on the driven gear is opposite. x is the distance of the contact beyond the
        # pitch point, in base pitches; there the flank of the driving gear is faster. Teeth are
        # half a pitch thick: a contact of back flanks passes the pitch point half a period later.
        turns = np.arange(2 * steps) / steps - PHASE[:, np.newaxis] / (2.0 * np.pi)
        x = (turns + (0.0 if flank > 0.0 else 0.5) + 0.5) % 1.0 - 0.5
        moved = (np.abs(x) > 1e-9) & (np.abs(x) < 0.5 - 1e-9)
        power = share * force * x
        assert (power[moved] < 0.0).all()


def test_flow_maps_refuse_friction():
    system = system_of(MODEL, LINEAR_FRICTION)
    plan = Plan(24, 0, 1, 1, method="flow_map")
    with pytest.raises(ValueError, match="flow maps cannot integrate friction"):
        integrate(system, np.zeros((PHASE.size, 2)), plan)
