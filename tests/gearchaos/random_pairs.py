"""Gear pairs drawn at random, and every scene there is."""

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
