"""The pair of Pan 2021 in the form of the kernels, and stored solutions of its equations.

``tests/data/pan2021.json`` was computed by an adaptive order-8 method with relative tolerance
1e-13, restarted at every located clearance crossing. The method shares no code with the kernels.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from gearchaos_kernels import STATES, Effects, GearPairs, Groups, Outcome, Plan, Teeth, integrate

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

FLOW_MAP = "flow_map"
"""Value of ``resolved`` that selects flow maps, in place of plain or resolved steps."""

FULL = Effects()
NO_AXIAL = Effects(axial=False)
TORSION_ONLY = Effects(transverse=False, axial=False)
NO_BACKLASH = Effects(backlash=False)
LINEAR = Effects(stiffness_variation=False, backlash=False)
TORSION = Effects(*[False] * len(Effects._fields))
CLEARANCE = TORSION._replace(backlash=True)
"""Only load, mesh and clearance act."""


def from_python(formula: Any) -> Callable[..., Any]:
    """Return a compiled function that calls a formula; only compiled code can call formulas."""
    compiled: Callable[..., Any] = numba.njit(lambda *arguments: formula(*arguments))
    return compiled


def pan2021(pitch_error: Any, **groups: Any) -> Groups:
    """Return the model of Pan 2021 for one or several multiples of the pitch error.

    Every other group may be given as a number or as one value per lane.
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
        "friction_coefficient": 0.0,
        "friction_lever": np.tan(np.radians(21.1728)) / np.cos(BASE_HELIX_ANGLE),
        "pitch_point_phase": 0.0,
    }
    assert groups.keys() <= values.keys()
    values.update(groups)
    lanes = max([np.size(value) for value in values.values()])
    return Groups(**{name: np.full(lanes, value, dtype=float) for name, value in values.items()})


def lanes_of(model: Groups, chosen: Any) -> Groups:
    """Return the model of some lanes, in the order given."""
    return Groups(*(group[chosen] for group in model))


def system_of(
    groups: Groups, effects: Effects = FULL, physical: bool = False, teeth: Teeth | None = None
) -> GearPairs:
    """Return a system with the mesh stiffness of Pan 2021."""
    return GearPairs(effects, groups, COSINE, SINE, physical, teeth)


def swinging() -> tuple[GearPairs, float]:
    """Return an undamped pair that oscillates in contact, and its angular frequency w.

    Without clearance, damping and load, delta_5 = N_y = A cos(w tau) with w^2 = cos(beta_b). A mesh
    period is half an oscillation. The masses in the bearings are a billion times larger.
    """
    absent = "load", "damping_ratio", "half_backlash", "stiffness_variation_scale"
    heavy = {"mass_ratio_p": 1e-9, "mass_ratio_g": 1e-9}
    frequency = float(np.sqrt(np.cos(BASE_HELIX_ANGLE)))
    groups = pan2021(0.0, **dict.fromkeys(absent, 0.0), **heavy, mesh_frequency=2.0 * frequency)
    return system_of(groups), frequency


def drawn_teeth(driving: int, driven: int, lanes: int = 1, contact_ratio: float = 2.26) -> Teeth:
    """Return random tooth errors, different in every lane.

    The shares follow from contact lines whose length is a trapezoid over the mesh phase.
    """
    random = np.random.default_rng(driving + 1000 * driven)
    cells_per_period = 20
    place = (np.arange(round(contact_ratio * cells_per_period)) + 0.5) / cells_per_period
    line = np.minimum(np.minimum(place, 0.86), contact_ratio - place)
    share = [
        line[n] / line[n % cells_per_period :: cells_per_period].sum() for n in range(line.size)
    ]
    return Teeth(
        random.uniform(-1.0, 1.0, (lanes, driving)),
        random.uniform(-1.0, 1.0, (lanes, driven)),
        np.arange(lanes)[::-1].copy(),
        np.array(share),
        cells_per_period,
        0.425,
    )


def columns(effects: Effects) -> list[int]:
    """Return the indices of a scene's states among all ten states."""
    return [STATES.index(name) for name in effects.states]


def state(**values: float) -> np.ndarray:
    """Return one full state with the named components; the others are 0."""
    assert values.keys() <= set(STATES)
    return np.array([values.get(name, 0.0) for name in STATES])


def stored_state(values: list[float]) -> np.ndarray:
    """Return a state of the file, which has the order of the kernels, padded to ten states."""
    return np.pad(np.asarray(values, dtype=float), (0, len(STATES) - len(values)))


def run(
    model: Groups,
    scene: Effects = FULL,
    start: np.ndarray | None = None,
    *,
    steps: int = 100,
    transient: int = 0,
    periods: int = 1,
    points: int | None = None,
    tangent: bool = True,
    physical: bool = False,
    resolved: bool | str = False,
    teeth: Teeth | None = None,
    first_period: int = 0,
    history: int = 0,
    own: np.ndarray | None = None,
) -> Outcome:
    """Integrate a model with the mesh stiffness of Pan 2021; by default keep all section points.

    A start has all ten states, the outcome has those of the scene. The tangent vector is on by
    default, so that one compiled scene serves many tests. ``resolved``: False for plain steps, True
    for resolved steps, or `FLOW_MAP`. ``own``: recorded periods of every lane.
    """
    rest = np.zeros((model.load.size, len(STATES)))
    start = rest if start is None else np.broadcast_to(start, rest.shape)
    points = transient + periods if points is None else points
    method = FLOW_MAP if resolved == FLOW_MAP else "rk4"
    plan = Plan(
        steps, transient, periods, points, tangent, bool(resolved), history, method, first_period
    )
    system = system_of(model, scene, physical, teeth)
    return integrate(system, start[:, columns(scene)], plan, periods=own)


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
