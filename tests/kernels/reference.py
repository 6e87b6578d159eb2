"""The pair of Pan 2021 as the kernels take it, and stored solutions of its equations.

``tests/data/pan2021.json`` was computed by an adaptive order-8 method with relative tolerance
1e-13, restarted at every located clearance crossing: it shares nothing with the kernels.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from gearchaos_kernels import STATE_ROWS, Model, Outcome, Plan, Scene, integrate

SOLUTIONS = json.loads((Path(__file__).parents[1] / "data" / "pan2021.json").read_text())

_PRINTED = SOLUTIONS["groups"]
OMEGA = _PRINTED["Omega"]
PERIOD = 2.0 * np.pi / OMEGA
BASE_HELIX_ANGLE = np.radians(SOLUTIONS["beta_b_deg"])

# Table 2, relative to the mean stiffness.
COSINE = np.array([-1.202, -5.79e-5, -0.1339, -5.784e-5, -0.04809, -5.79e-5])
COSINE /= SOLUTIONS["mean_stiffness"]
SINE = np.array([1.203, -1.15e-4, -0.1335, 9.478e-8, 0.04819, -3.819e-5])
SINE /= SOLUTIONS["mean_stiffness"]

STATES = tuple(STATE_ROWS)
ROWS_IN_FILE = [
    STATE_ROWS[name]
    for pair in ("5", "1", "2", "3", "4")
    for name in (f"delta_{pair}", f"delta_{pair}_rate")
]
"""Column of the kernels for each column of the stored states."""

FULL = Scene()
NO_AXIAL = Scene(axial=False)
TORSION_ONLY = Scene(transverse=False, axial=False)
NO_BACKLASH = Scene(backlash=False)
LINEAR = Scene(stiffness_variation=False, backlash=False)


def pan2021(pitch_error: Any, **groups: Any) -> Model:
    """Return the model of Pan 2021 for one or several multiples of the pitch error.

    Every other group may be given as a number or with one value per lane.
    """
    multiple = np.atleast_1d(np.asarray(pitch_error, dtype=float))
    values: dict[str, Any] = {
        "mesh_frequency": OMEGA,
        "load": _PRINTED["f_n"],
        "damping_ratio": _PRINTED["xi"],
        "base_helix_angle": BASE_HELIX_ANGLE,
        "half_backlash": _PRINTED["half_backlash"],
        "error_mean": 0.0,
        "error_amplitude": multiple * _PRINTED["e_r"],
        "error_phase": 0.0,
        "stiffness_variation_scale": _PRINTED["stiffness_variation_scale"],
        "mass_ratio_p": _PRINTED["mass_ratio_p"],
        "mass_ratio_g": _PRINTED["mass_ratio_g"],
        "transverse_stiffness_p": _PRINTED["k_11"],
        "transverse_damping_p": _PRINTED["eta_11"],
        "transverse_stiffness_g": _PRINTED["k_21"],
        "transverse_damping_g": _PRINTED["eta_21"],
        "axial_stiffness_p": _PRINTED["k_12"],
        "axial_damping_p": _PRINTED["eta_12"],
        "axial_stiffness_g": _PRINTED["k_22"],
        "axial_damping_g": _PRINTED["eta_22"],
    }
    assert groups.keys() <= values.keys()
    values.update(groups)
    lanes = max([np.size(value) for value in values.values()])
    return Model(**{name: np.full(lanes, value, dtype=float) for name, value in values.items()})


def lanes_of(model: Model, chosen: Any) -> Model:
    """Return the model of some lanes, in the order given."""
    return Model(*(group[chosen] for group in model))


def state(**values: float) -> np.ndarray:
    """Return one full state by the names of its components; the others are 0."""
    full = np.zeros(len(STATE_ROWS))
    for name, value in values.items():
        full[STATE_ROWS[name]] = value
    return full


def stored_state(values: list[float]) -> np.ndarray:
    """Return a state of the file in the columns of the kernels."""
    full = np.zeros(len(STATE_ROWS))
    full[ROWS_IN_FILE[: len(values)]] = values
    return full


def run(
    model: Model,
    scene: Scene = FULL,
    start: np.ndarray | None = None,
    *,
    steps: int = 100,
    transient: int = 0,
    periods: int = 1,
    points: int | None = None,
    section: tuple[str, ...] = STATES,
    tangent: bool = True,
    rederived: bool = False,
    resolved: bool = False,
) -> Outcome:
    """Integrate Pan 2021's mesh stiffness, by default keeping every state after every period.

    The tangent vector is on unless a test is about the plain loop: one compiled scene then serves
    many tests. Steps are plain ones unless ``resolved`` splits those that cross a clearance.
    """
    lanes = model.load.size
    rest = np.zeros((lanes, len(STATE_ROWS)))
    start = rest if start is None else np.broadcast_to(start, rest.shape)
    points = transient + periods if points is None else points
    plan = Plan(steps, transient, periods, points, section, tangent, resolved)
    return integrate(scene, model, COSINE, SINE, start, plan, rederived=rederived)


def assert_same_bits(one: Outcome, other: Outcome) -> None:
    """Compare every array of two outcomes bit for bit, NaN included."""
    for name, array, twin in zip(Outcome._fields, one, other, strict=True):
        assert (array is None) == (twin is None), name
        if array is not None:
            assert np.array_equal(array.view(np.uint8), twin.view(np.uint8)), name


def lanes_out_of(outcome: Outcome, chosen: Any) -> Outcome:
    """Return the outcome of some lanes, in the order given."""
    return Outcome(
        *(None if array is None else np.ascontiguousarray(array[chosen]) for array in outcome)
    )
