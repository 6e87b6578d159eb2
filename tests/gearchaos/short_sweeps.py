"""Short sweeps, most of the pair of Pan 2021, computed in blocks or lane by lane."""

from pathlib import Path

import numpy as np
from gearchaos_kernels import integrate

from gearchaos.engine.computing import EndStates
from gearchaos.engine.computing import blocks as blocks_of
from gearchaos.engine.executors import LocalExecutor, compute_blocks
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.models import load_config

PAN2021 = Path(__file__).resolve().parents[2] / "sweeps" / "pan2021_first.toml"
"""The pair with the groups of the stored reference solutions; its motions are well known."""

SPEEDS = PAN2021.with_name("mesh_frequency.toml")
MASSES = PAN2021.with_name("two_masses.toml")
SOFT_BEARINGS = (
    "groups.load=0.26762",
    "groups.half_backlash=0.94518",
    "groups.pitch_error_amplitude=0.022749",
    "groups.stiffness_variation_scale=0.6666666666666666",
    "groups.pitch_error=2.3",
    "groups.damping_ratio=0.0013",
    "groups.transverse_stiffness_p=0.112",
    "groups.transverse_stiffness_g=0.033",
    "groups.transverse_damping_p=0.00087",
    "groups.transverse_damping_g=0.00148",
    "integration.transient_periods=4000",
)
"""A pair with tori at many speeds; its motions settle slowly."""
SHORT = (
    "integration.steps_per_period=96",
    "integration.transient_periods=6",
    "integration.recorded_periods=12",
    "outputs.section_points=8",
    "sweep.count=13",
)
PUMP = """
[pair]
teeth = [17, 53]
normal_module_mm = 3.0
normal_pressure_angle_deg = 20.0
helix_angle_deg = 12.0
face_width_mm = 25.0

[operation]
torque_Nm = 60.0
speed_rpm = 9000.0

[mesh]
mean_stiffness_N_per_um_mm = 14.0
circumferential_backlash_um = 120.0
damping_ratio = 0.05
stiffness = { shape = "trapezoid" }

[pitch_error]
amplitude_um = 8.0

[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
"""
"""A helical pair whose motions jump and double their period; the text has no [sweep]."""

METHODS = ("rk4", "flow_map")
RANDOM = ("start.kind=random", "start.seed=5", "start.count=3", "start.spread=0.7")


def simulation(*overrides: str) -> RunPlan:
    return plan_run(load_config(PAN2021, (*SHORT, *overrides)))


def unlabelled(*overrides: str) -> RunPlan:
    """Return a short sweep without labels of motions: no lane is computed beyond its record."""
    return simulation("outputs.motion=false", *overrides)


def blocks(sweep: RunPlan, values: int) -> list[tuple[int, int]]:
    """Return the bounds of blocks, each with the lanes of the given number of swept values."""
    return blocks_of(sweep, values * sweep.lanes.repeats)


def computed(sweep: RunPlan, values: int = 13) -> dict[str, np.ndarray]:
    """Compute a whole sweep in blocks and join their arrays in the order of the lanes."""
    return joined(sweep, computed_blocks(sweep, blocks(sweep, values)))


def computed_blocks(sweep: RunPlan, bounds: list, ends: EndStates | None = None) -> dict:
    """Compute some blocks; a carried sweep continues from the given end states."""
    kept: dict = {}
    with LocalExecutor(sweep, ends) as executor:
        compute_blocks(executor, bounds, kept.__setitem__)
    return kept


def joined(sweep: RunPlan, found: dict) -> dict[str, np.ndarray]:
    """Join the blocks of a whole sweep in the order of its lanes."""
    blocks = [found[bounds] for bounds in sorted(found)]
    order = np.argsort(sweep.lanes.computed_at(np.arange(len(sweep.lanes))))
    return {name: np.concatenate([block[name] for block in blocks])[order] for name in blocks[0]}


def assert_same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> None:
    assert one.keys() == other.keys()
    for name, array in one.items():
        assert np.array_equal(array, other[name], equal_nan=True), name


def starts_of(sweep: RunPlan, first: int = 0, last: int | None = None) -> np.ndarray:
    return sweep.lanes.start_of(np.arange(first, len(sweep.lanes) if last is None else last))


def kernel(sweep: RunPlan, lane: int, start: np.ndarray) -> np.ndarray:
    """Integrate one lane of the sweep directly and return its end state."""
    system = sweep.lanes.system_of(np.array([lane]))
    return integrate(system, start[np.newaxis], sweep.plan).end_state[0]


def values_of(sweep: RunPlan) -> np.ndarray:
    """Return the value of the swept parameter in every lane."""
    return sweep.lanes.values_of(np.arange(len(sweep.lanes)))[sweep.config.sweep.parameter]


def listing(folder: Path, parameter: str, values: list[float], *overrides: str) -> RunPlan:
    """Return a sweep of listed values of another parameter of the same pair."""
    head, tail = PAN2021.read_text().split("[sweep]")
    rest = tail[tail.index("[integration]") :]
    sweep = f'[sweep]\nparameter = "{parameter}"\nvalues = {values}\n'
    file = folder / "listing.toml"
    file.write_text(head + sweep + rest)
    without_count = [override for override in SHORT if not override.startswith("sweep.")]
    return plan_run(load_config(file, (*without_count, *overrides)))
