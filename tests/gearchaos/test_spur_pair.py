"""The spur pair of Kahraman and Singh: equation, linear response and softening jumps."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gearchaos.engine.lanes import Lanes
from gearchaos.engine.run_plan import plan_run
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration, axis_values, load_config
from gearchaos.models.gear_pair.tables import groups_at
from gearchaos.records.label import GROWS, PERIODIC

from .short_sweeps import computed, values_of

SPUR_PAIR = Path(__file__).resolve().parents[2] / "sweeps" / "spur_pair.toml"
CONSTANT_STIFFNESS = ("groups.stiffness_variation_scale=0.0", "groups.pitch_error_amplitude=0.05")
SETTLED = (
    "integration.transient_periods=120",
    "integration.recorded_periods=20",
    "outputs.section_points=8",
)
RUN_UP = ("sweep.from=0.5", "sweep.to=1.6", "sweep.count=111", *SETTLED)
APART = 1e-6
SAMPLES = 512


@dataclass
class Oscillator:
    """x'' + 2 zeta x' + kappa f(x) = F_m + F_ah Omega^2 cos(Omega tau)."""

    zeta: float
    load: float
    forcing: float
    variation: list[float]
    """Harmonics k_n of kappa = 1 + k_1 cos(Omega tau) + k_2 cos(2 Omega tau) + ..."""

    def rates(self, time, state, frequency):
        x, rate = state
        turn = np.cos(frequency * time)
        spring = x - 1.0 if x > 1.0 else x + 1.0 if x < -1.0 else 0.0
        force = self.load + self.forcing * frequency**2 * turn
        harmonics = enumerate(self.variation, start=1)
        stiffness = 1.0 + sum(k * np.cos(n * frequency * time) for n, k in harmonics)
        return rate, force - 2.0 * self.zeta * rate - stiffness * spring

    def run(self, start, frequency, periods):
        """Integrate whole mesh periods; return x at equal intervals of time, and the end state."""
        times = np.linspace(0.0, 2.0 * np.pi * periods / frequency, SAMPLES * periods + 1)
        tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 10.0 * times[1]}
        motion = solve_ivp(
            self.rates, (0.0, times[-1]), start, t_eval=times, args=(frequency,), **tight
        )
        return motion.y[0, :-1], motion.y[:, -1]

    def linear_response(self, frequency):
        """Return the complex amplitude at constant stiffness while the teeth stay in contact."""
        forcing = self.forcing * frequency**2
        return forcing / (1.0 - frequency**2 + 2j * self.zeta * frequency)


def simulation(*overrides):
    return plan_run(load_config(SPUR_PAIR, overrides))


def oscillator(sweep):
    groups = {name: found.values for name, found in sweep.lanes.parameters.items()}
    return Oscillator(
        zeta=groups["damping_ratio"],
        load=groups["load"],
        forcing=groups["pitch_error"] * groups["pitch_error_amplitude"],
        variation=[groups["stiffness_variation_scale"] * k for k in groups["stiffness_cosine"]],
    )


@dataclass
class Branches:
    """The upward and the downward sweep over the same mesh frequencies."""

    pair: Oscillator
    frequency: np.ndarray
    up: dict
    down: dict

    @property
    def apart(self):
        distance = np.abs(self.up["end_state"] - self.down["end_state"])
        return distance.max(axis=1) > APART


def branches(*overrides):
    both = simulation(*RUN_UP, "start.carry=both", *overrides)
    arrays = computed(both, 111)
    up, down = ({name: array[way::2] for name, array in arrays.items()} for way in (0, 1))
    return Branches(oscillator(both), values_of(both)[::2], up, down)


@pytest.fixture(scope="module")
def constant():
    return branches(*CONSTANT_STIFFNESS)


@pytest.fixture(scope="module")
def shipped():
    return branches()


def test_the_model_is_the_classical_equation():
    # With a light load and a strong forcing, contact is lost and made on both flanks.
    periods = 6
    sweep = simulation(
        "sweep={parameter='mesh_frequency', values=[0.6, 0.9, 1.4]}",
        "start.carry=none",
        "groups.load=0.03",
        "groups.pitch_error_amplitude=0.9",
        "integration.steps_per_period=1600",
        "integration.transient_periods=0",
        f"integration.recorded_periods={periods}",
        f"outputs.section_points={periods}",
    )
    ends = computed(sweep)["end_state"]
    pair = oscillator(sweep)
    for frequency, end in zip(values_of(sweep), ends, strict=True):
        x, expected = pair.run([1.0 + pair.load, 0.0], frequency, periods)
        assert x.min() < -1.0 < 1.0 < x.max()
        assert end == pytest.approx(expected, abs=1e-8)


def test_response_is_linear_while_the_teeth_stay_together():
    # The largest linear amplitude is F_ah / (2 zeta sqrt(1 - zeta^2)) = 0.5006.
    sweep = simulation(*RUN_UP, *CONSTANT_STIFFNESS, "groups.load=0.51", "start.carry=upwards")
    pair, arrays = oscillator(sweep), computed(sweep, 111)
    assert not arrays["crossings_per_period"].any()
    response = pair.linear_response(values_of(sweep))
    # The section is taken at phase 0: x gives the real part and x' the imaginary part.
    x, rate = arrays["end_state"].T
    found = x - (1.0 + pair.load) - 1j * rate / values_of(sweep)
    assert np.abs(found - response).max() < 1e-6
    assert arrays["lyapunov_exponent"] == pytest.approx(-pair.zeta, abs=1e-3)


def test_contact_is_lost_where_the_linear_amplitude_exceeds_the_load(constant):
    amplitude = np.abs(constant.pair.linear_response(constant.frequency))
    lost = constant.up["crossings_per_period"] > 0.0
    assert np.array_equal(lost, amplitude > constant.pair.load)


@pytest.mark.parametrize(
    ("scene", "first", "last"), [("constant", 0.71, 0.82), ("shipped", 0.63, 0.83)]
)
def test_sweeps_differ_in_one_interval_below_resonance(scene, first, last, request):
    both = request.getfixturevalue(scene)
    apart = np.flatnonzero(both.apart)
    assert both.frequency[apart[[0, -1]]] == pytest.approx([first, last])
    assert np.array_equal(apart, np.arange(apart[0], apart[-1] + 1))
    # The lower branch keeps contact except shortly before its jump.
    assert not both.up["crossings_per_period"][apart[: apart.size // 2]].any()
    assert (both.down["crossings_per_period"][apart] == 2.0).all()


@pytest.mark.parametrize("scene", ["constant", "shipped"])
def test_every_motion_of_the_run_up_repeats_each_mesh_period(scene, request):
    both = request.getfixturevalue(scene)
    for arrays in (both.up, both.down):
        assert np.ptp(arrays["section_delta_5"], axis=1).max() < APART
        assert arrays["lyapunov_exponent"].max() < 0.0


def amplitude_of(both, arrays, index):
    """Return the amplitude of the first harmonic of an orbit, integrated with `Oscillator`."""
    start = arrays["end_state"][index]
    x, end = both.pair.run(start, both.frequency[index], 1)
    assert end == pytest.approx(start, abs=1e-5)
    return np.abs(np.fft.rfft(x)[1]) * 2.0 / SAMPLES


def test_the_peak_leans_to_lower_frequencies(constant):
    first, last = np.flatnonzero(constant.apart)[[0, -1]]
    resonance = np.argmin(np.abs(constant.frequency - 1.0))
    peak = amplitude_of(constant, constant.down, first)
    assert peak > 4.0 * amplitude_of(constant, constant.up, first)
    assert peak > amplitude_of(constant, constant.down, last)
    assert peak > 1.5 * amplitude_of(constant, constant.down, resonance)
    # The clearance removes the resonance at 1.
    without_clearance = constant.pair.forcing / (2.0 * constant.pair.zeta)
    assert amplitude_of(constant, constant.down, resonance) < 0.5 * without_clearance


def harmonic_balance(pair, amplitude):
    """Return the frequencies at which mean and first harmonic balance, in contact on one flank."""
    angle = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES

    def spring(mean):
        return np.maximum(mean + amplitude * np.cos(angle) - 1.0, 0.0)

    mean = brentq(lambda mean: spring(mean).mean() - pair.load, 1.0 - amplitude, 1.0 + pair.load)
    stiffness = 2.0 * np.mean(spring(mean) * np.cos(angle)) / amplitude
    squares = np.roots(
        [
            1.0 - (pair.forcing / amplitude) ** 2,
            4.0 * pair.zeta**2 - 2.0 * stiffness,
            stiffness**2,
        ]
    )
    return np.sqrt(squares)


@pytest.mark.parametrize(("frequency", "share"), [(0.75, 0.02), (0.82, 0.02), (1.3, 0.002)])
def test_harmonic_balance_finds_the_branch_that_loses_contact(constant, frequency, share):
    # With one harmonic, the error shrinks with the part of the period without contact.
    index = np.argmin(np.abs(constant.frequency - frequency))
    amplitude = amplitude_of(constant, constant.down, index)
    found = harmonic_balance(constant.pair, amplitude)
    assert np.abs(found / constant.frequency[index] - 1.0).min() < share


def test_harmonics_of_the_stiffness_drive_resonances_at_fractions_of_the_first():
    sweep = simulation(*SETTLED, "sweep.from=0.25", "sweep.to=0.6", "sweep.count=71")
    lost = values_of(sweep)[computed(sweep, 71)["crossings_per_period"] > 0.0]
    third, half = lost[lost < 0.4], lost[lost > 0.4]
    assert [third.min(), third.max()] == pytest.approx([0.325, 0.34])
    assert [half.min(), half.max()] == pytest.approx([0.465, 0.525])


def test_at_twice_the_resonance_the_stiffness_drives_a_motion_of_two_periods():
    sweep = simulation(
        *SETTLED,
        "integration.transient_periods=400",
        "groups.mesh_frequency=2.0",
        "groups.stiffness_cosine=[-0.1]",
        "start.carry=none",
        "sweep={parameter='stiffness_variation_scale', values=[0.5, 1.0, 1.5, 2.1]}",
    )
    arrays = computed(sweep)
    # To first order, the principal parametric resonance grows at the rate k_1/4 - zeta.
    growth = 0.1 * values_of(sweep) / 4.0 - sweep.lanes.parameters["damping_ratio"].values
    assert arrays["lyapunov_exponent"][:3] == pytest.approx(growth[:3], abs=1e-4)
    assert not arrays["crossings_per_period"][:3].any()
    assert growth[3] > 0.0 > arrays["lyapunov_exponent"][3]
    points = arrays["section_delta_5"][3]
    assert np.ptp(points[::2]) < APART < 0.05 < abs(points[1] - points[0])


def test_a_resonance_that_outgrows_the_clearance_is_distinguished_from_chaos():
    frequency, stiffness, damping = 1.9, 0.6, 0.02

    def linear(time, flow):
        spring = 1.0 - stiffness * np.cos(frequency * time)
        x, rate = flow.reshape(2, 2)
        return np.concatenate([rate, -2.0 * damping * rate - spring * x])

    period = 2.0 * np.pi / frequency
    flow = solve_ivp(linear, (0.0, period), np.eye(2).ravel(), rtol=1e-12, atol=1e-13).y[:, -1]
    multiplier = np.abs(np.linalg.eigvals(flow.reshape(2, 2))).max()
    changes = (
        "start.carry=none",
        f"sweep={{parameter='mesh_frequency', values=[{frequency}, 2.25]}}",
        f"groups.stiffness_cosine=[{-stiffness}]",
        f"groups.damping_ratio={damping}",
        "groups.half_backlash=0.02",
    )
    lanes = computed(plan_run(load_config(SPUR_PAIR, changes)))
    assert lanes["motion"].tolist() == [GROWS, PERIODIC]
    # A motion much larger than the clearance grows as in the linear equation.
    assert lanes["lyapunov_exponent"][0] == pytest.approx(np.log(multiplier) / period, rel=1e-6)


TRAPEZOID = """
[pair]
teeth = [21, 38]
normal_module_mm = 2.0
normal_pressure_angle_deg = 20.0
face_width_mm = 15.0
[operation]
speed_rpm = 8000.0
torque_Nm = 50.0
[mesh]
mean_stiffness_N_per_um_mm = 13.0
half_backlash_um = 20.0
damping_ratio = 0.1
stiffness = { shape = "trapezoid" }
[pitch_error]
amplitude_um = 5.0
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
[sweep]
parameter = "pair.normal_module_mm"
from = 1.0
to = 7.3
count = 50
"""


def test_a_sweep_of_the_module_of_a_spur_pair_keeps_its_stiffness():
    config = Configuration.from_toml(TRAPEZOID)
    swept = groups_at(config, axis_values(config))
    assert np.ptp(swept.mesh_frequency) > 0.0
    # Tooth heights are multiples of the module: the contact ratio does not depend on the module.
    one = groups_at(config.at({"pair.normal_module_mm": 2.0}), {})
    cosine, sine = (np.tile(wave, (50, 1)) for wave in (one.stiffness_cosine, one.stiffness_sine))
    np.testing.assert_allclose(swept.stiffness_cosine, cosine, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(swept.stiffness_sine, sine, rtol=0.0, atol=1e-13)


def test_a_sweep_of_the_module_of_a_spur_pair_with_teeth_of_their_own_has_one_table_of_lines():
    teeth = 'kind = "teeth"\nsmoothing = 0.1\ndriving = { cumulative_um = [FP] }'
    text = TRAPEZOID.replace("amplitude_um = 5.0", teeth.replace("[FP]", str([0.0] * 20 + [3.0])))
    lanes = Lanes(Configuration.from_toml(text))
    assert lanes.system_of(np.arange(len(lanes))).teeth is not None


@pytest.mark.parametrize(
    "other",
    [
        "sweep={parameter='pair.normal_pressure_angle_deg', values=[20.0, 20.00000001]}",
        "pair.helix_angle_deg=1e-6",
    ],
)
def test_a_contact_ratio_that_differs_is_refused_with_teeth_of_their_own(other):
    teeth = 'kind = "teeth"\nsmoothing = 0.1\ndriving = { cumulative_um = [FP] }'
    text = TRAPEZOID.replace("amplitude_um = 5.0", teeth.replace("[FP]", str([0.0] * 20 + [3.0])))
    lanes = Lanes(Configuration.from_toml(text, overrides=[other]))
    with pytest.raises(ConfigurationError, match="would differ between the swept values"):
        lanes.system_of(np.arange(len(lanes)))
