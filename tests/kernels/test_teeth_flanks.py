"""Errors of single teeth in the physical form: their plane, and the damping of their mean.

Each pair in mesh has a constant error, so that the mean of the pairs in mesh acts on the mesh
springs and not on the dampers. If the teeth of a spur pair take their load at once, the mean is a
sequence of steps; between the steps the equation of motion has constant coefficients.
"""

import numpy as np
import pytest
from gearchaos_kernels import GearPairs, Groups, Plan, Teeth, integrate, mesh_motion
from scipy.linalg import expm

from .reference import TORSION, TORSION_ONLY, drawn_teeth, pan2021, system_of
from .test_evaluation import lane
from .test_order import measured_order
from .twin import Twin

ERRORS_ONLY = TORSION._replace(pitch_error=True)
RECORDED = {"contact": True, "loads": True, "history_periods": 1}
"""Records of all tests, so that one loop serves all tests of the physical form."""
FORCE, ERROR = 0, 1
LARGEST, SMALLEST = range(2)
FREQUENCY, DAMPING, LOAD = 0.2, 0.15, 1.0
PERIOD = 2.0 * np.pi / FREQUENCY
TEETH = np.array([0.0, 0.9, -0.7, 0.4, -0.2])
"""Errors of the driven teeth; neighbours differ by more than the static deflection."""


def spur_system(smoothing: float, physical: bool = True) -> GearPairs:
    """Return a spur pair of contact ratio 1.5.

    ``smoothing``: time in which a tooth takes its load, in mesh periods.
    """
    cells = round(6.0 / smoothing)
    assert cells % 2 == 0
    share = np.repeat([0.5, 1.0, 0.5], cells // 2)
    teeth = Teeth(np.zeros((1, 1)), TEETH[np.newaxis], np.zeros(1, np.intp), share, cells, 0.25)
    values = {
        "mesh_frequency": FREQUENCY,
        "load": LOAD,
        "damping_ratio": DAMPING,
        "error_amplitude": 1.0,
        "mass_ratio_p": 1.0,
        "mass_ratio_g": 1.0,
    }
    groups = Groups(*(np.full(1, values.get(name, 0.0)) for name in Groups._fields))
    # Clearance and stiffness variation are zero, so a scene with both effects has the same motion
    # as a scene without them. Other tests of this file have compiled the loop of the physical form.
    scene = TORSION_ONLY if physical else ERRORS_ONLY
    return GearPairs(scene, groups, np.zeros(0), np.zeros(0), physical, teeth)


def extremes(smoothing: float, physical: bool = True) -> np.ndarray:
    """Return the largest and the smallest mesh force of the periodic motion."""
    steps = round(12.0 / smoothing)
    plan = Plan(max(steps, 400), 5 * TEETH.size, TEETH.size, 1, **RECORDED)
    loads = integrate(spur_system(smoothing, physical), np.zeros((1, 2)), plan).loads
    return loads[0, FORCE, [LARGEST, SMALLEST]]


def extremes_of_steps() -> np.ndarray:
    """Return the extremes of F in x'' + F = load, F = x - e + 2 xi x' with piecewise constant e.

    One pair carries the load in one half of each period; two pairs share it in the other half. The
    state follows from matrix exponentials until it repeats.
    """
    parts = 0.5 * (TEETH + np.roll(TEETH, 1)), TEETH
    levels = np.stack(parts, axis=1).ravel()
    matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * DAMPING]])
    fine = 2000
    part = expm(matrix * PERIOD / 2.0 / fine)
    state, forces = np.zeros(2), []
    for turn in range(6):
        for level in levels:
            rest = np.array([LOAD + level, 0.0])
            for _ in range(fine):
                if turn == 5:
                    forces.append(state[0] - level + 2.0 * DAMPING * state[1])
                state = rest + part @ (state - rest)
    return np.array([max(forces), min(forces)])


def test_forces_of_a_spur_pair_tend_to_those_of_teeth_that_take_their_load_at_once():
    limit = extremes_of_steps()
    smoothings = np.array([0.12, 0.06, 0.03, 0.015, 0.01])
    missing = np.array([np.abs(extremes(smoothing) - limit).max() for smoothing in smoothings])
    # While teeth take their load, the pair moves by a distance proportional to this time.
    assert measured_order(missing, 1.0 / smoothings) > 0.9
    assert missing[-1] < smoothings[-1] * PERIOD


def test_the_printed_form_damps_the_rate_of_the_mean_which_has_no_limit():
    printed = [extremes(smoothing, physical=False)[0] for smoothing in (0.06, 0.03, 0.015)]
    first, second = np.diff(printed)
    assert second > 1.5 * first > 0.0


LANES = 3
MODEL = pan2021(
    np.linspace(40.0, 60.0, LANES), error_mean=0.2, load=0.1, half_backlash=0.3, mesh_frequency=2.0
)
MESH = drawn_teeth(3, 2, LANES)
PLAN = Plan(400, 6, 18, 1, **RECORDED)


@pytest.fixture(scope="module")
def recorded():
    system = system_of(MODEL, TORSION_ONLY, physical=True, teeth=MESH)
    start = np.tile([0.5, 0.0], (LANES, 1))
    told = integrate(system, start, PLAN)
    fine = integrate(system, start, PLAN._replace(steps_per_period=6400, history_periods=18))
    return told, fine, mesh_motion(system, fine.history, 6400, 6)


def rates_of_the_error(number: int, phases: np.ndarray) -> np.ndarray:
    """Return the rate of the shared error of the teeth of a lane, per unit of tau."""
    twin = Twin(lane(MODEL, number), TORSION_ONLY, True, MESH)
    twin.groups.profile = MESH.profile[number]
    period = 2.0 * np.pi / twin.groups.mesh_frequency
    return np.array([twin.error(phase * period)[1] for phase in phases])


def test_loads_of_teeth_are_those_of_their_motion_at_sixteen_times_the_steps(recorded):
    told, fine, motion = recorded
    signals = motion.force_tangential, fine.history[..., 0] + motion.pitch_error
    for number, values in zip((FORCE, ERROR), signals, strict=True):
        # The samples of the motion may miss a kink by half their distance.
        missed = np.abs(np.diff(values, axis=1)).max(axis=1)
        found = told.loads[:, number, [LARGEST, SMALLEST]].T
        difference = np.abs(found - [values.max(axis=1), values.min(axis=1)])
        assert (difference <= missed + 1e-4 * np.abs(values).max(axis=1)).all()


def test_teeth_meet_with_the_speed_of_the_gears_and_graze_with_that_of_the_gap(recorded):
    _, told, motion = recorded
    phases = 6.0 + np.arange(told.history.shape[1]) / 6400
    for number in range(LANES):
        # delta_5 is measured from the error of the teeth, so it is the gap if bearings are rigid.
        gap, gap_rate = told.history[number].T
        flank = motion.contact_tangential[number]
        before = np.flatnonzero(np.diff(flank))
        edge = np.where(gap[before] > 0.0, 1.0, -1.0) * MODEL.half_backlash[number]
        edge *= np.cos(MODEL.base_helix_angle[number])
        share = (edge - gap[before]) / (gap[before + 1] - gap[before])
        speeds = gap_rate[before] + share * (gap_rate[before + 1] - gap_rate[before])
        of_gears = speeds + rates_of_the_error(number, phases[before] + share / 6400)
        meets = flank[before] == 0
        assert meets.sum() > 2 and told.crossings[number] == before.size
        assert told.slowest_crossing[number] == pytest.approx(np.abs(speeds).min(), abs=1e-4)
        _, on_driving, _, on_back, total, largest = told.contact[number, 0]
        assert on_driving + on_back == meets.sum()
        assert largest == pytest.approx(np.abs(of_gears[meets]).max(), abs=1e-4)
        assert total == pytest.approx(np.abs(of_gears[meets]).sum(), abs=1e-4 * meets.sum())
        assert np.abs(of_gears - speeds).max() > 0.01
