"""Friction between the teeth in a configuration and in its sweep."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import gearchaos
from gearchaos.dynamics.exponents import sum_of_exponents
from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration

SPUR = """
[groups]
mesh_frequency = 0.9
load = 0.3
damping_ratio = 0.05
base_helix_angle_deg = 0.0
friction_coefficient = 0.2
friction_lever = 0.4
[scene]
effects = ["friction"]
[sweep]
parameter = "pitch_point_phase_deg"
values = [0.0, 33.0, 180.0, 301.0]
[integration]
steps_per_period = 100
transient_periods = 80
recorded_periods = 2
[outputs]
section = ["delta_5", "delta_5_rate"]
section_points = 1
lyapunov = false
motion = false
"""
PAN2021 = Path(__file__).resolve().parents[2] / "sweeps" / "pan2021.toml"


def settled(phase_deg: float) -> np.ndarray:
    """Return delta_5 and its rate at mesh phase 0 of the only periodic motion.

    delta_5'' = f_n - (1 - s mu lambda) (delta_5 + 2 xi delta_5') in each half of the period.
    """
    period, pitch_point, flow = 2.0 * np.pi / 0.9, phase_deg / 360.0, np.eye(3)
    changes = np.array([pitch_point, pitch_point + 0.5]) % 1.0
    for begin, end in pairwise(np.unique([0.0, *changes, 1.0])):
        sign = 1.0 if (0.5 * (begin + end) - pitch_point) % 1.0 > 0.5 else -1.0
        share = 1.0 - sign * 0.2 * 0.4
        rates = np.array([[0.0, 1.0, 0.0], [-share, -share * 0.1, 0.3], [0.0, 0.0, 0.0]])
        flow = expm(rates * (end - begin) * period) @ flow
    return np.linalg.solve(np.eye(2) - flow[:2, :2], flow[:2, 2])


def test_a_sweep_settles_on_the_motion_of_the_exact_equations():
    result = gearchaos.run(Configuration.from_toml(SPUR))
    wanted = np.array([settled(phase) for phase in (0.0, 33.0, 180.0, 301.0)])
    for column, name in enumerate(("section_delta_5", "section_delta_5_rate")):
        # The free motion has decayed by exp(-0.05 tau); the method has order 4.
        assert result[name][:, -1] == pytest.approx(wanted[:, column], rel=0, abs=1e-6)
    assert np.ptp(wanted[:, 0]) > 0.01


def test_lanes_have_the_friction_of_the_pair():
    text = PAN2021.read_text(encoding="utf-8")
    config = Configuration.from_toml(
        text,
        overrides=[
            'scene.effects=["friction"]',
            'sweep={parameter="mesh.friction_coefficient", values=[0.02, 0.1]}',
            "groups.pitch_point_phase_deg=90.0",
        ],
    )
    groups = Lanes(config).system_of(np.arange(2)).groups
    assert groups.friction_coefficient == pytest.approx([0.02, 0.1])
    assert groups.friction_lever == pytest.approx(0.40903, abs=1e-5)
    assert groups.pitch_point_phase == pytest.approx(np.pi / 2.0)


@pytest.mark.parametrize(
    ("override", "texts"),
    [
        (
            'integration={method="flow_map"}',
            ('scene.effects = ["friction"]', '"friction" cannot be computed', 'method = "rk4"'),
        ),
        ("groups.friction_coefficient=1.5", ("groups.friction_coefficient = 1.5", "less than 1")),
        ("groups.friction_lever=-0.1", ("groups.friction_lever = -0.1", "must be at least 0")),
        (
            "scene.effects=[]",
            ("pitch_point_phase_deg", "an effect that is off", 'add "friction" to scene.effects'),
        ),
    ],
)
def test_a_fault_of_friction_names_its_remedy(override, texts):
    with pytest.raises(ConfigurationError) as caught:
        Configuration.from_toml(SPUR, overrides=[override])
    (problem,) = caught.value.problems
    for text in texts:
        assert text in problem


def test_friction_without_a_coefficient_names_the_keys_that_give_it():
    text = SPUR.replace("friction_coefficient = 0.2\n", "")
    with pytest.raises(ConfigurationError, match="give friction_coefficient in") as caught:
        Configuration.from_toml(text)
    assert "by giving mesh.friction_coefficient" in str(caught.value)


def test_the_sum_of_exponents_is_not_given_where_it_depends_on_phases_of_contact():
    """The share of a damper that acts in contact only depends on the direction of friction."""
    system = Lanes(Configuration.from_toml(SPUR, "spur.toml")).system_of(np.array([0, 1]))
    assert np.isfinite(sum_of_exponents(system)).all()
    text = SPUR.replace("[scene]", "half_backlash = 1.0\n[scene]")
    text = text.replace('["friction"]', '["friction", "backlash"]')
    text += '[mesh]\ndamping_acts = "in_contact"\n'
    system = Lanes(Configuration.from_toml(text, "spur.toml")).system_of(np.array([0, 1]))
    shares = np.array([[1.0], [0.7]])
    found = sum_of_exponents(system, shares)
    assert np.isfinite(found[0]) and np.isnan(found[1])
