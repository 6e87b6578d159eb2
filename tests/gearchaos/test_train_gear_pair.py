"""A gear pair with bearings has the same motion as a train and as the model of the gear pair."""

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate

import gearchaos
from gearchaos.models.registry import model_of, system_of

STIFFNESS, BEARINGS = 200.0, (300.0, 150.0)
RADII, MASSES, INERTIA = (30.0, 45.0), (0.8, 1.9), 1.5e-3
BACKLASH, TORQUE, RATIO = 20.0, 15.0, 1.6
HARMONICS = 5
SPEEDS = np.array([2600.0, 4500.0, 6000.0, 9000.0])
PERIODS = 20
TEETH = (24, 36)


def train(error):
    """Return the train: the driving shaft turns uniformly, and both shafts move sideways."""
    mobility = RADII[1] ** 2 / (1e6 * INERTIA) + sum(1.0 / mass for mass in MASSES)
    # The damping of the mesh is 2 * 0.04 sqrt(k m_e), with the m_e of the rotation alone.
    ratio = 0.04 * np.sqrt(mobility * 1e6 * INERTIA / RADII[1] ** 2)
    shafts = [{"mass_kg": m, "bearing_N_per_um": k} for m, k in zip(MASSES, BEARINGS, strict=True)]
    shafts[0] |= {"inertia_kg_m2": 1.0, "uniform": True}
    shafts[1] |= {"inertia_kg_m2": INERTIA, "torque_Nm": -TORQUE * RADII[1] / RADII[0]}
    gears = zip(("input", "output"), TEETH, RADII, strict=True)
    return gearchaos.Configuration.from_tables(
        {
            "model": {"kind": "train"},
            "operation": {"speed_rpm": 3000.0},
            "shaft": {"input": shafts[0], "output": shafts[1]},
            "gear": {s: {"shaft": s, "teeth": z, "base_radius_mm": r} for s, z, r in gears},
            "mesh": {
                "teeth": {
                    "gears": ["input", "output"],
                    "stiffness_N_per_um": STIFFNESS,
                    "contact_ratio": RATIO,
                    "harmonics": HARMONICS,
                    "half_backlash_um": BACKLASH,
                    "damping_ratio": float(ratio),
                    "transmission_error_um": error,
                    "line_angle_deg": 0.0,
                }
            },
            "sweep": {"parameter": "operation.speed_rpm", "values": SPEEDS.tolist()},
        }
    )


def pair(error):
    """Return the gear pair; its driving gear is so heavy that its rotation stays uniform."""
    number, normal = np.arange(1, HARMONICS + 1), 20.0
    module = 2.0 * RADII[0] / TEETH[0] / np.cos(np.radians(normal))
    dampers = [2e3 * 0.02 * np.sqrt(k * m) for k, m in zip(BEARINGS, MASSES, strict=True)]
    return gearchaos.Configuration.from_tables(
        {
            "pair": {
                "teeth": TEETH,
                "normal_module_mm": float(module),
                "normal_pressure_angle_deg": normal,
                "face_width_mm": 10.0,
                "masses_kg": MASSES,
                "inertias_kg_m2": [1e18, INERTIA],
            },
            "operation": {"torque_Nm": TORQUE},
            "mesh": {
                "mean_stiffness_N_per_um_mm": STIFFNESS / 10.0,
                "half_backlash_um": BACKLASH,
                "damping_ratio": 0.04,
            },
            "pitch_error": {"amplitude_um": error},
            "bearings": {
                "transverse_stiffness_N_per_m": [1e6 * one for one in BEARINGS],
                "transverse_damping_N_s_per_m": [float(one) for one in dampers],
            },
            "groups": {
                "stiffness_cosine": (2.0 * np.sinc(RATIO * number)).tolist(),
                "stiffness_sine": [0.0],
            },
            "scene": {"effects": ["pitch_error", "stiffness_variation", "backlash", "transverse"]},
            "sweep": {"parameter": "operation.speed_rpm", "values": SPEEDS.tolist()},
        }
    )


def motions(error, steps):
    """Return sections and contact of pair and train from the same start, in units of the pair."""
    values = {"operation.speed_rpm": SPEEDS}
    configs = pair(error), train(error)
    gears, shafts = (system_of(config, values) for config in configs)
    start, of_train = (np.zeros((SPEEDS.size, len(one.states))) for one in (gears, shafts))
    start[:, 0] = 3.0
    # delta_5 = (r_p theta_p - r_g theta_g - e) over half a backlash. At the start e = 0, and the
    # rate of e is the rate of the gears.
    angle = shafts.states.index("output_angle")
    of_train[:, angle] = -3.0 * BACKLASH / RADII[1]
    of_train[:, angle + 1] = -shafts.frequency * error / RADII[1]
    plan = Plan(steps, 0, PERIODS, PERIODS, tangent=True, contact=True)
    expected, found = integrate(gears, start, plan), integrate(shafts, of_train, plan)
    columns = [shafts.states.index(name) for name in ("output_angle", "input_x", "output_x")]
    same = found.section[:, :, columns] * [-RADII[1], 1.0, 1.0] / BACKLASH
    rate = model_of(configs[0]).scales(configs[0], values).frequency * 1e-3
    assert gears.mesh_period == pytest.approx(shafts.mesh_period * rate, rel=1e-12)
    assert (found.crossings == expected.crossings).all() and found.crossings.min() >= 6
    return expected.section[:, :, [0, 2, 4]], same, expected.contact, found.contact


def test_a_gear_pair_with_bearings_moves_as_the_train_of_two_shafts():
    expected, found, contact, shares = motions(error=0.0, steps=200)
    assert np.ptp(expected, axis=1).min() > 0.01
    assert found == pytest.approx(expected, abs=1e-10)
    assert shares[:, 0, :4] == pytest.approx(contact[:, 0, :4], abs=1e-8)


def test_with_an_error_of_the_gears_both_converge_to_the_same_motion():
    # In the pair, the error is an inertia force; in the train, it is a motion of the flanks. The
    # errors of the steps therefore differ.
    apart = [
        np.abs(np.subtract(*motions(error=3.0, steps=steps)[:2])).max(axis=(1, 2))
        for steps in (200, 800)
    ]
    assert np.log2(apart[0] / apart[1]).mean() / 2.0 > 3.8
    assert apart[1].max() < 1e-8
