"""Gear pairs drawn at random, and all scenes."""

import itertools

import numpy as np
from gearchaos_kernels import Effects, Groups

from ..kernels.reference import pan2021

EVERY_SCENE = [Effects(*flags) for flags in itertools.product([False, True], repeat=5)]


def name_of(scene: Effects) -> str:
    return "+".join(name for name, on in scene._asdict().items() if on) or "torsion"


def random_pairs(lanes: int, seed: int) -> Groups:
    rng = np.random.default_rng(seed)

    def between(low, high):
        return np.exp(rng.uniform(np.log(low), np.log(high), lanes))

    bearings = {
        f"{direction}_{kind}_{gear}": between(*limits)
        for direction in ("transverse", "axial")
        for kind, limits in (("stiffness", (0.1, 1e3)), ("damping", (1e-3, 5.0)))
        for gear in "pg"
    }
    return pan2021(
        np.ones(lanes),
        load=0.0,
        mesh_frequency=between(0.5, 2.0),
        damping_ratio=between(1e-3, 2.0),
        base_helix_angle=rng.uniform(0.05, 0.8, lanes),
        mass_ratio_p=between(0.1, 1.0),
        mass_ratio_g=between(0.1, 1.0),
        **bearings,
    )


BEARINGS = ((), ("transverse",), ("transverse", "axial"))


def random_configuration(number: int, steps: int | None = None) -> str:
    """Return the TOML of a helical pair with backlash at one speed; its number determines it.

    Bearings are in turn rigid, flexible in the transverse direction, and flexible in both. Mesh
    frequencies range from 0.005 to 10 times the natural frequency. 12 periods from rest are
    recorded.
    """
    rng = np.random.default_rng([29, number])

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    teeth = int(rng.integers(17, 45))
    driven = round(teeth * between(1.0, 4.0))
    module, helix = between(1.0, 6.0), float(rng.uniform(8.0, 30.0))
    width = module * between(5.0, 15.0)
    stiffness, speed = between(8.0, 20.0), between(200.0, 20000.0)
    torque = between(0.3, 5.0) * module**2 * width * teeth / 40
    backlash, damping, error = between(5.0, 100.0), between(0.01, 0.15), between(1.0, 30.0)
    flexible = BEARINGS[number % 3]
    bearings = "".join(
        f"{direction}_stiffness_N_per_m = [{between(3e7, 3e9)}, {between(3e7, 3e9)}]\n"
        f"{direction}_damping_N_s_per_m = [{between(1e2, 1e4)}, {between(1e2, 1e4)}]\n"
        for direction in flexible
    )
    effects = ", ".join(f'"{e}"' for e in ("pitch_error", "stiffness_variation", "backlash"))
    axial = ', "delta_3"' if "axial" in flexible else ""
    return f"""\
[pair]
teeth = [{teeth}, {driven}]
normal_module_mm = {module}
normal_pressure_angle_deg = 20.0
helix_angle_deg = {helix}
face_width_mm = {width}

[operation]
speed_rpm = {speed}
torque_Nm = {torque}

[mesh]
mean_stiffness_N_per_um_mm = {stiffness}
half_backlash_um = {backlash}
damping_ratio = {damping}
stiffness = {{ shape = "trapezoid" }}

[pitch_error]
amplitude_um = {error}

[bearings]
{bearings}
[scene]
effects = [{effects}{"".join(f', "{direction}"' for direction in flexible)}]

[sweep]
parameter = "pitch_error"
values = [1.0]

[integration]
transient_periods = 0
recorded_periods = 12
{"" if steps is None else f"steps_per_period = {steps}"}

[outputs]
section = ["delta_5"{axial}]
section_points = 12
"""
