"""``stages --refine`` names losses of stability: exact folds, steep folds, confirmed losses."""

import json

import pytest

import gearchaos
from gearchaos.dynamics.stability_loss import StabilityLoss

from .commands import run_module
from .short_sweeps import PAN2021
from .test_spur_pair import SPUR_PAIR

FIGURE_7 = PAN2021.with_name("pan2021.toml")

EXACT_FOLDS = {0.02: (0.887204856, 0.926878895), 0.1: (0.585331570, 0.731361127)}
"""Mesh frequencies of the folds of x'' + 0.1 x' + D(x; 1) = 0.1 + F_ah W^2 cos(W tau), by F_ah.

They were computed with event-located matrix exponentials, shooting and arclength continuation. An
adaptive integrator confirmed that the orbits close.
"""

SPUR_PAIR_25_41 = """\
title = "spur pair of 25 and 41 teeth"

[pair]
teeth = [25, 41]
normal_module_mm = 3.5
normal_pressure_angle_deg = 20.0
helix_angle_deg = 0.0
face_width_mm = 32.0

[operation]
torque_Nm = 60.0

[mesh]
mean_stiffness_N_per_um_mm = 14.0
half_backlash_um = 60.0
damping_ratio = 0.05
stiffness = { shape = "trapezoid" }

[pitch_error]
amplitude_um = 8.0

[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]

[sweep]
parameter = "operation.speed_rpm"
values = [11421.666666666666, 11443.333333333334, 11465.0]

[integration]
transient_periods = 500
recorded_periods = 504
"""


def refined(folder, source, overrides, width: str) -> list[dict]:
    """Compute a sweep and return the boundaries that the command prints for it."""
    config = gearchaos.load_config(source, overrides)
    gearchaos.run(config).save(folder / "result.h5")
    ended = run_module("gearchaos.stages", "result.h5", "--refine", width, "--json", cwd=folder)
    assert ended.code == 0, ended.err
    return json.loads(ended.out)["boundaries"]


@pytest.mark.parametrize("forcing", EXACT_FOLDS)
def test_refined_folds_are_the_exact_ones(tmp_path, forcing):
    low, high = EXACT_FOLDS[forcing]
    changes = (
        "groups.stiffness_variation_scale=0.0",
        # At constant stiffness the phase of the error only sets the origin of the time.
        "groups.pitch_error_phase_deg=0.0",
        f"groups.pitch_error_amplitude={forcing}",
        f"sweep={{parameter='mesh_frequency', from={low - 0.02}, to={high + 0.02}, count=13}}",
        "integration={method='flow_map', transient_periods=200, recorded_periods=20}",
        "outputs.section_points=8",
    )
    folds = refined(tmp_path, SPUR_PAIR, changes, "1e-8")
    assert [fold["direction"] for fold in folds] == ["downwards", "upwards"]
    for fold, exact in zip(folds, (low, high), strict=True):
        assert fold["loss"].startswith("fold")
        assert fold["multiplier"] == pytest.approx([1.0, 0.0], rel=0, abs=2e-6)
        assert 0.0 < fold["above"] - fold["below"] <= 1e-8
        # The exact values have nine digits.
        assert (fold["below"], fold["above"]) == pytest.approx((exact, exact), rel=0, abs=1.1e-8)


STEEP = (
    "scene.effects=['pitch_error', 'stiffness_variation', 'backlash']",
    "groups.pitch_error=9.0",
    "start.carry=both",
    "sweep={parameter='mesh_frequency', from=0.506, to=0.526, count=6}",
    "integration.transient_periods=200",
    "integration.recorded_periods=20",
    "outputs.section_points=8",
)


def test_a_steep_fold_is_followed_until_its_multiplier_is_one(tmp_path):
    """Its multipliers are 0.644 +- 0.218i at a distance of 1e-5 from the fold, 0.964 at 1e-7."""
    downwards, *_ = refined(tmp_path, FIGURE_7, STEEP, "0.001")
    assert downwards["direction"] == "downwards"
    assert downwards["loss"].startswith("fold")
    assert downwards["multiplier"] == pytest.approx([1.0, 0.0], rel=0, abs=2e-6)


@pytest.mark.parametrize("width", [1e-2, 1e-5])
def test_a_steep_fold_is_located_whatever_the_width(width):
    result = gearchaos.run(gearchaos.load_config(FIGURE_7, STEEP))
    system = gearchaos.System.of_lane(result, mesh_frequency=0.526, direction=1)
    orbit = system.orbit(guess=system.state)
    branch = system.follow(orbit, "mesh_frequency", 0.526, 0.506, width)
    assert branch.loss is StabilityLoss.FOLD
    assert branch.value == pytest.approx(0.51443036888, rel=0, abs=1e-9)
    assert branch.multiplier == pytest.approx(1.0, rel=0, abs=2e-6)
    before = system.follow(orbit, "mesh_frequency", 0.526, branch.value + 1e-5)
    assert abs(before.orbit.multipliers[0].imag) > 0.2


def test_an_unstable_orbit_of_another_branch_is_no_loss_of_stability(tmp_path):
    """Newton's method finds an orbit with the multiplier 2.69 at the first step downwards."""
    (tmp_path / "pair.toml").write_text(SPUR_PAIR_25_41, encoding="utf-8")
    *_, boundary = refined(tmp_path, tmp_path / "pair.toml", (), "5")
    assert boundary["label_above"] == "period 14"
    assert boundary["loss"].startswith("period doubling")
    assert boundary["multiplier"] == pytest.approx([-1.0, 0.0], rel=0, abs=1e-3)
