"""Eigenfrequencies, their resonances with mesh orders, and the static deflection, before a run."""

import json

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

import gearchaos
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.resonances import resonances
from gearchaos.models import load_config

from .commands import run_module, small_config
from .short_sweeps import PAN2021

LINEAR = ("integration.method=flow_map", "integration.steps_per_period=24")
UNDAMPED = (
    "groups.damping_ratio=0.0",
    "bearings.transverse_damping_N_s_per_m=[0.0, 0.0]",
    "bearings.axial_damping_N_s_per_m=[0.0, 0.0]",
)


def known(path, *overrides):
    return resonances(Lanes(load_config(path, overrides)))


def natural_hertz(pair, transverse, axial, per_width) -> np.ndarray:
    """Return the natural frequencies of eqs 1 to 5 in physical units, undamped and in contact.

    The coordinates are y_p, y_g, theta_p, theta_g, z_p, z_g.
    """
    tilt = np.arctan(np.tan(pair["helix"]) * np.cos(pair["pressure"]))
    r_p, r_g = pair["base_radii"]
    gap = np.array([1.0, -1.0, r_p, -r_g, 0.0, 0.0])
    axial_gap = np.array([0.0, 0.0, 0.0, 0.0, 1.0, -1.0]) - np.tan(tilt) * gap
    react = np.array([0.0, 0.0, 0.0, 0.0, 1.0, -1.0])
    mesh = per_width * pair["width"]
    stiffness = np.diag([*transverse, 0.0, 0.0, *axial])
    stiffness = stiffness + np.cos(tilt) * mesh * np.outer(gap, gap)
    stiffness = stiffness + np.sin(tilt) * mesh * np.outer(react, axial_gap)
    m_p, m_g, i_p, i_g = pair["inertias"]
    squares = np.linalg.eigvals(stiffness / np.array([m_p, m_g, i_p, i_g, m_p, m_g])[:, None])
    # The lowest eigenvalue is left out: the gears can turn freely together.
    # Rounding may make a zero negative.
    return np.sort(np.sqrt(np.maximum(np.sort(squares.real)[1:], 0.0))) / (2.0 * np.pi)


def test_a_pair_with_rigid_bearings_has_one_frequency_in_closed_form():
    found = known(PAN2021, 'scene.effects=["pitch_error"]', "groups.damping_ratio=0.2")
    # delta_5'' + 2 xi cos(beta_b) delta_5' + cos(beta_b) delta_5 = ...
    cosine = np.cos(np.arctan(np.tan(np.radians(20.0)) * np.cos(np.radians(21.1728))))
    wanted = np.sqrt(cosine - (0.2 * cosine) ** 2)
    assert found.frequencies == pytest.approx(np.full((1, 2), wanted), rel=1e-6)


def test_what_does_not_oscillate_is_no_eigenfrequency():
    found = known(PAN2021, 'scene.effects=["pitch_error"]', "groups.damping_ratio=2.0")
    assert found.frequencies.shape == (0, 2)
    assert found.texts["modes"].startswith("none that oscillates")
    assert "orders" not in found.texts


@pytest.mark.parametrize("scene", [("transverse",), ("transverse", "axial")])
def test_a_pair_on_bearings_has_the_natural_frequencies_of_its_masses_and_springs(tmp_path, scene):
    effects = f"scene.effects={['pitch_error', *scene]}"
    found = known(small_config(tmp_path), *UNDAMPED, effects, 'outputs.section=["delta_5"]')
    helix, normal = np.radians(20.0), np.radians(20.0)
    pressure = np.arctan(np.tan(normal) / np.cos(helix))
    reference = np.array([21, 38]) * 2.166e-3 / (2.0 * np.cos(helix))
    masses = 7850.0 * np.pi * 15e-3 * reference**2
    pair = {
        "helix": helix,
        "pressure": pressure,
        "base_radii": reference * np.cos(pressure),
        "width": 15e-3,
        "inertias": [*masses, *(masses * reference**2 / 2.0)],
    }
    axial = (3e7, 4e7) if "axial" in scene else (0.0, 0.0)
    wanted = natural_hertz(pair, (1e8, 2e8), axial, 13.3548e9)
    if "axial" not in scene:
        # Without axial bearings both gears slide: only the mesh holds them to each other.
        tilt = np.arctan(np.tan(helix) * np.cos(pressure))
        held = np.sin(tilt) * 13.3548e9 * 15e-3 * np.sum(1.0 / masses)
        sliding = [0.0, np.sqrt(held) / (2.0 * np.pi)]
        wanted = [f for f in wanted if np.min(np.abs(f - np.array(sliding))) > 1.0]
    assert found.hertz[:, 0] == pytest.approx(np.array(wanted), rel=1e-6)
    assert found.rpm == pytest.approx(60.0 * found.hertz / 21)


def test_a_slow_sweep_of_a_linear_pair_peaks_where_the_first_order_meets_its_modes():
    spacing = 0.05
    overrides = (
        *LINEAR,
        'scene.effects=["pitch_error", "transverse"]',
        f"sweep={{parameter='mesh_frequency', from=0.3, to={0.3 + 164 * spacing}, count=165}}",
        "groups.pitch_error=1.0",
        "integration.transient_periods=400",
        "integration.recorded_periods=48",
        "outputs.section_points=1",
    )
    config = gearchaos.load_config(PAN2021, overrides)
    (modes,) = known(PAN2021, *overrides).frequencies.T[:1]
    response = gearchaos.respond(config, periods=1)
    amplitudes = np.stack([np.ptp(response[f"delta_{n}"], axis=-1) for n in (5, 1, 2)])
    values = response["mesh_frequency"]
    # A peak is the largest value within half a unit on both sides: 24 samples per period miss a
    # crest by 1 %.
    around = sliding_window_view(amplitudes, 21, axis=1).max(axis=2)
    peaks = [values[10:-10][row] for row in amplitudes[:, 10:-10] == around]
    assert len(modes) == 3
    # Every mode has a peak in some coordinate. A peak is not farther from a mode than the width
    # 2 eta_11 of the most strongly damped mode, because the other modes shift it.
    for mode in modes:
        assert min(np.min(np.abs(row - mode)) for row in peaks if row.size) <= spacing
    for peak in np.concatenate(peaks):
        assert np.min(np.abs(modes - peak)) <= spacing + 2.0 * 0.084


def test_the_static_deflection_is_where_a_loaded_pair_comes_to_rest():
    overrides = (
        # The load acts alone: every effect has the value at which it vanishes.
        "groups.pitch_error=0.0",
        "groups.stiffness_variation_scale=0.0",
        "groups.half_backlash=0.0",
        'scene.effects=["pitch_error", "stiffness_variation", "backlash", "transverse"]',
        "sweep={parameter='load', values=[0.3]}",
        "groups.damping_ratio=0.5",
        "groups.transverse_damping_p=2.0",
        "groups.transverse_damping_g=2.0",
    )
    system = gearchaos.System(gearchaos.load_config(PAN2021, overrides))
    state = dict(zip(system.states, system.integrate(1, transient=60).states[-1], strict=True))
    gap = state["delta_1"] - state["delta_2"] + state["delta_5"]
    found = known(PAN2021, *overrides)
    assert found.deflection == pytest.approx([gap, gap], rel=1e-9)
    assert gap > 0.3 * 1.05


def test_a_static_deflection_in_micrometres_is_load_over_stiffness_along_the_line_of_action(
    tmp_path,
):
    found = known(small_config(tmp_path))
    # The torque is 50 Nm, the base radius 22.5688 mm, the tangential force k cos(beta_b) q.
    force, stiffness = 50.0 / 22.5688e-3, 13.3548e9 * 15e-3
    wanted = 1e6 * force / (stiffness * np.cos(np.radians(18.7472)))
    assert found.micrometres == pytest.approx([wanted, wanted], rel=1e-5)
    assert "along the transverse line of action" in found.texts["deflection"]


def test_what_varies_over_the_sweep_is_reported_from_the_smallest_to_the_largest():
    swept = "sweep={parameter='transverse_stiffness_g', from=1.0, to=4.0, count=31}"
    found = known(PAN2021, swept, "groups.pitch_error=1.0")
    ends = [
        known(PAN2021, f"groups.transverse_stiffness_g={value}").frequencies[:, 0]
        for value in (1.0, 4.0)
    ]
    assert found.frequencies == pytest.approx(np.stack(ends, axis=1), rel=1e-12)
    low, high = found.hertz[0]
    assert f"{low:.4g} to {high:.4g}" in found.texts["modes"]


def test_a_dry_run_prints_modes_orders_and_deflection_for_people_and_programs(tmp_path):
    found = known(small_config(tmp_path))
    dry = ("gears.toml", "--dry-run")
    said = run_module("gearchaos.sweep", *dry, cwd=tmp_path).err
    for topic, text in found.texts.items():
        assert f"\n{topic + ':':12}{text}\n" in said
    assert len(found.hertz) == 5 and found.hertz[0, 0] == pytest.approx(1358, rel=1e-3)
    facts = json.loads(run_module("gearchaos.sweep", *dry, "--json", cwd=tmp_path).out)
    assert facts["eigenfrequencies_Hz"] == found.hertz.tolist()
    assert facts["resonant_speeds_rpm"]["2"] == (found.rpm / 2).tolist()
    assert facts["static_deflection_um"] == found.micrometres.tolist()
    assert facts["steps_per_period"] == 40


def test_a_dimensionless_scene_is_reported_in_mesh_frequencies():
    found = known(PAN2021.with_name("spur_pair.toml"))
    assert found.hertz is None and found.rpm is None and found.micrometres is None
    assert found.facts["resonant_mesh_frequencies"]["3"] == (found.frequencies / 3).tolist()
    first = f"{found.frequencies[0, 0]:.4g}"
    assert f"{first} per unit of tau" in found.texts["modes"]
    assert f"order 1 at {first} (mesh frequency); order 2" in found.texts["orders"]
    assert found.texts["deflection"].startswith("0.1 b' of the mesh")


@pytest.mark.parametrize("name", ["transverse_stiffness_p", "damping_ratio", "load"])
def test_groups_beyond_all_measure_have_no_eigenfrequencies_and_no_traceback(name):
    found = known(PAN2021, f"groups.{name}=1e300")
    assert np.isfinite(found.frequencies).all()
    assert found.texts


def test_a_machine_without_gears_has_an_excitation_and_no_mesh():
    found = known(PAN2021.with_name("two_masses.toml"))
    assert found.texts["orders"].startswith("resonances with the excitation: order 1 at 1.41, ")
    assert "(excitation frequency)" in found.texts["orders"]
    # JSON has no NaN; a machine has no static deflection of its own.
    assert "static_deflection" not in found.facts
    assert "NaN" not in json.dumps(found.facts)


def test_a_machine_has_eigenfrequencies_without_contact_too():
    found = known(PAN2021.parent / "two_masses.toml")
    # The masses are 1, the springs between them and to the ground are 1, the damping is small.
    wanted = np.sqrt((3.0 + np.array([-1.0, 1.0]) * np.sqrt(5.0)) / 2.0)
    assert found.free[:, 0] == pytest.approx(wanted, rel=1e-3)
    assert found.texts["free"] == (
        "eigenfrequencies 0.618, 1.618 rad per unit of time (no element in contact)"
    )
    assert "free" not in known(PAN2021).texts
