"""Random pairs and starts: motions are finite or flagged, bounded by energy, symmetric, scalable.

All examples have a tangent vector and resolved steps. There are few scenes, because each one is
compiled.
"""

import numpy as np
from gearchaos_kernels import Effects, Groups, Status
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from .reference import (
    CLEARANCE,
    COSINE,
    FULL,
    NO_AXIAL,
    NO_BACKLASH,
    SINE,
    assert_same_bits,
    pan2021,
    run,
)

settings.register_profile("bounds", derandomize=True, deadline=None, max_examples=60)
PROPERTY = settings.get_profile("bounds")

PERIODS = 6
LENGTHS = ("load", "half_backlash", "error_mean", "error_amplitude")
BEARINGS = [f"{way}_{{}}_{gear}" for way in ("transverse", "axial") for gear in "pg"]

SMALLEST = 1e-60
"""Smaller numbers are replaced by 0: scaled down, they would lose digits near underflow."""


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda x: x if abs(x) > SMALLEST else 0.0)


groups = st.fixed_dictionaries(
    {
        "mesh_frequency": st.floats(0.4, 3.0),
        "load": numbers(-1.0, 1.0),
        "damping_ratio": numbers(0.0, 1.0),
        "base_helix_angle": st.floats(0.05, 0.7),
        "half_backlash": st.sampled_from([0.0, 1e-9, 1e-3, 0.1, 1.0, 1e9]) | numbers(0.0, 2.0),
        "error_mean": numbers(-0.5, 0.5),
        "error_amplitude": numbers(0.0, 2.0),
        "error_phase": st.floats(0.1, 6.0),
        "stiffness_variation_scale": numbers(0.0, 2.0),
        "mass_ratio_p": st.floats(0.05, 1.0),
        "mass_ratio_g": st.floats(0.05, 1.0),
        **{name.format("stiffness"): numbers(0.0, 60.0) for name in BEARINGS},
        **{name.format("damping"): numbers(0.0, 0.5) for name in BEARINGS},
    }
)
scenes = st.sampled_from([FULL, NO_AXIAL, CLEARANCE, NO_BACKLASH])
starts = st.lists(numbers(-3.0, 3.0), min_size=10, max_size=10).map(np.array)
anything = st.sampled_from([0.0, 1e-300, 1e-9, 1.0, 1e3, 1e9, 1e30, 1e150, np.inf, np.nan])


def pair_of(scene: Effects, given: dict[str, float]) -> Groups:
    """Return the pair of an example; some scenes get no error phase, to compile fewer loops."""
    without = {} if scene.backlash and scene != NO_AXIAL else {"error_phase": 0.0}
    return pan2021(0.0, **{**given, **without})


def value(model: Groups, name: str) -> float:
    return float(getattr(model, name)[0])


def stiffness_wave(model: Groups) -> np.ndarray:
    """Return kappa over one period, eq. 19."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)[:, np.newaxis] * np.arange(1, COSINE.size + 1)
    variation = np.cos(angle) @ COSINE + np.sin(angle) @ SINE
    return 1.0 + value(model, "stiffness_variation_scale") * variation


def relative(model: Groups, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return y_1 and y_2 of eqs 6 and 7 as printed, at the end of a period."""
    beta = value(model, "base_helix_angle")
    phase = value(model, "error_phase")
    error = value(model, "error_mean") + value(model, "error_amplitude") * np.sin(phase)
    along_mesh = states[..., 2] - states[..., 4] + states[..., 0]
    y_1 = along_mesh - error * np.cos(beta)
    y_2 = states[..., 6] - states[..., 8] - np.tan(beta) * along_mesh - error * np.sin(beta)
    return y_1, y_2


def stored_in(y, half_backlash, kappa) -> np.ndarray:
    """Return the energy of the mesh spring, without the cosine or sine of the direction."""
    return 0.5 * kappa * np.maximum(np.abs(y) - half_backlash, 0.0) ** 2


def energies(model: Groups, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the energy of the torsional and transverse motion, and that of the axial motion."""
    beta, half_backlash = value(model, "base_helix_angle"), value(model, "half_backlash")
    kappa = stiffness_wave(model)[0]
    y_1, y_2 = relative(model, states)
    cosine, sine = np.cos(beta), np.sin(beta)
    tangential = 0.5 * states[..., 1] ** 2 + cosine * stored_in(y_1, half_backlash * cosine, kappa)
    axial = sine * stored_in(y_2, half_backlash * sine, kappa)
    for row, way, gear in ((2, "transverse", "p"), (4, "transverse", "g")):
        tangential = tangential + of_gear(model, states, row, way, gear)
    for row, way, gear in ((6, "axial", "p"), (8, "axial", "g")):
        axial = axial + of_gear(model, states, row, way, gear)
    return tangential, axial


def of_gear(model: Groups, states: np.ndarray, row: int, way: str, gear: str) -> np.ndarray:
    """Return the energy of one gear and its bearing in one direction."""
    stiffness = value(model, f"{way}_stiffness_{gear}")
    energy = 0.5 * (states[..., row + 1] ** 2 + stiffness * states[..., row] ** 2)
    return energy / value(model, f"mass_ratio_{gear}")


def bound(before, power, leak, rises, tau) -> np.ndarray:
    """Return the largest energy if E' <= sqrt(2 E) power + leak + E (rise of ln kappa)."""
    root = np.sqrt(before + leak * tau) + power * tau / np.sqrt(2.0)
    return (root * np.exp(0.5 * rises)) ** 2


@PROPERTY
@given(groups, starts)
def test_the_energy_of_a_motion_is_bounded_by_what_load_error_and_stiffness_put_in(given, start):
    model = pair_of(FULL, given)
    outcome = run(model, FULL, start, steps=200, periods=PERIODS, resolved=True)
    assert outcome.status.tolist() == [Status.OK]

    kappa = stiffness_wave(model)
    periods = np.arange(1, PERIODS + 1)
    tau = periods * 2.0 * np.pi / value(model, "mesh_frequency")
    rises = periods * np.maximum(np.diff(np.log(kappa)), 0.0).sum()
    beta, ratio = value(model, "base_helix_angle"), value(model, "damping_ratio")
    cosine, sine = np.cos(beta), np.sin(beta)
    frequency, amplitude = value(model, "mesh_frequency"), value(model, "error_amplitude")
    error_rate = frequency * amplitude
    first, first_axial = energies(model, start)

    # Load and inertial term act on delta_5; the rate of the error acts on the mesh force.
    power = abs(value(model, "load")) + frequency**2 * amplitude
    power += np.sqrt(kappa.max() * cosine) * cosine * error_rate
    leak = 0.5 * ratio * cosine * (cosine * error_rate) ** 2
    largest = bound(first, power, leak, rises, tau)
    tangential, axial = energies(model, outcome.section[0])
    assert (tangential <= 1.01 * largest + 1e-6).all()

    # The approach of the gears drives the axial motion. The energy above bounds its speed.
    mobility = 1.0 + value(model, "mass_ratio_p") + value(model, "mass_ratio_g")
    driven = np.tan(beta) * np.sqrt(2.0 * mobility * largest) + sine * error_rate
    largest_axial = bound(
        first_axial,
        np.sqrt(kappa.max() * sine) * driven,
        0.5 * ratio * sine * driven**2,
        rises,
        tau,
    )
    assert (axial <= 1.01 * largest_axial + 1e-6).all()


@PROPERTY
@given(scenes, groups, starts, st.sampled_from([2, 5, 20, 100]), anything, st.integers(0, 9))
def test_a_motion_is_finite_or_its_lane_says_that_it_is_not(scene, given, start, steps, size, row):
    with np.errstate(invalid="ignore"):
        start[row] *= size
    model = pair_of(scene, given)
    outcome = run(model, scene, start, steps=steps, periods=PERIODS, resolved=True)
    if outcome.status[0] == Status.OK:
        kept = PERIODS
        assert outcome.diverged_period[0] == -1
        assert np.isfinite(outcome.end_state).all()
        assert np.isfinite(outcome.end_tangent).all()
    else:
        kept = outcome.diverged_period[0]
        assert 0 <= kept < PERIODS
        assert np.isnan(outcome.end_state).all()
    for array in (outcome.section[0], outcome.growth[0]):
        assert np.isfinite(array[:kept]).all()
        assert np.isnan(array[kept:]).all()
    assert 0 <= outcome.overflows[0] <= steps * PERIODS
    assert outcome.crossings[0] >= 0


@PROPERTY
@given(scenes, groups, starts, st.sampled_from([7, 50]))
def test_a_motion_turned_around_is_the_motion_of_the_pair_turned_around(scene, given, start, steps):
    # If a clearance is smaller than the rounding error of its gap, rounding decides on which side
    # the gap leaves it.
    assume(given["half_backlash"] == 0.0 or given["half_backlash"] > 1e-12)
    model = pair_of(scene, given)
    turned = {name: -getattr(model, name) for name in LENGTHS if name != "half_backlash"}
    how = {"steps": steps, "periods": PERIODS, "resolved": True}
    one = run(model, scene, start, **how)
    other = run(model._replace(**turned), scene, -start, **how)
    # Only the signs of section and end state differ, including the signs of zeros.
    assert np.array_equal(other.section, -one.section, equal_nan=True)
    assert np.array_equal(other.end_state, -one.end_state, equal_nan=True)
    same = {"section": one.section, "end_state": one.end_state}
    assert_same_bits(other._replace(**same), one)


@PROPERTY
@given(scenes, groups, starts, st.sampled_from([7, 50]), st.integers(-30, 30))
def test_a_motion_scales_with_every_length_of_its_pair(scene, given, start, steps, power):
    factor = 2.0**power
    model = pair_of(scene, given)
    scaled = model._replace(**{name: factor * getattr(model, name) for name in LENGTHS})
    how = {"steps": steps, "periods": 3, "resolved": True}
    one = run(model, scene, start, **how)
    other = run(scaled, scene, factor * start, **how)
    if one.status[0] != Status.OK or other.status[0] != Status.OK:
        # The unit of length decides which numbers are out of range.
        return
    assert np.array_equal(other.section, factor * one.section)
    assert np.array_equal(other.end_state, factor * one.end_state)
    assert np.array_equal(other.growth, one.growth)
    assert other.crossings.tolist() == one.crossings.tolist()
    assert other.slowest_crossing.tolist() == (factor * one.slowest_crossing).tolist()
