"""Sweeps of Pan 2021 short enough for a test, computed block by block and by hand."""

from pathlib import Path

import numpy as np
from gearchaos_kernels import STATE_ROWS, Scene, integrate

from gearchaos.configuration import load_config
from gearchaos.engine.lanes import model, select, start_states
from gearchaos.engine.simulation import Simulation, compute_all

PAN2021 = Path(__file__).resolve().parents[2] / "sweeps" / "pan2021.toml"
SPEEDS = PAN2021.with_name("mesh_frequency.toml")
SOFT_BEARINGS = (
    "groups.pitch_error=2.3",
    "groups.damping_ratio=0.0013",
    "groups.transverse_stiffness_p=0.112",
    "groups.transverse_stiffness_g=0.033",
    "groups.transverse_damping_p=0.00087",
    "groups.transverse_damping_g=0.00148",
    "integration.transient_periods=4000",
)
"""A pair with many tori over its speeds, which are slow to settle."""
SHORT = (
    "integration.steps_per_period=96",
    "integration.transient_periods=6",
    "integration.recorded_periods=12",
    "outputs.section_points=8",
    "sweep.count=13",
)
STATES = ("delta_5", "delta_5_rate", "delta_1", "delta_1_rate", "delta_2", "delta_2_rate")
COLUMNS = [STATE_ROWS[name] for name in STATES]
RANDOM = ("start.kind=random", "start.seed=5", "start.count=3", "start.spread=0.7")


def simulation(*overrides: str) -> Simulation:
    return Simulation(load_config(PAN2021, (*SHORT, *overrides)))


def blocks(sweep: Simulation, values: int) -> list[tuple[int, int]]:
    """Return the bounds of blocks of so many swept values, in the order of computation."""
    size = values * sweep.starts
    bounds = ((first, min(first + size, sweep.lanes)) for first in range(0, sweep.lanes, size))
    return sweep.in_order(bounds)


def computed(sweep: Simulation, values: int = 13) -> dict[str, np.ndarray]:
    """Compute a whole sweep in blocks and join their arrays in the order of the lanes."""
    return joined(dict(compute_all(sweep, blocks(sweep, values))))


def joined(parts: dict) -> dict[str, np.ndarray]:
    in_order = [parts[bounds] for bounds in sorted(parts)]
    return {name: np.concatenate([part[name] for part in in_order]) for name in in_order[0]}


def assert_same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> None:
    assert one.keys() == other.keys()
    for name, array in one.items():
        assert np.array_equal(array, other[name], equal_nan=True), name


def starts_of(sweep: Simulation, first: int = 0, last: int | None = None) -> np.ndarray:
    numbers = np.arange(first, sweep.lanes if last is None else last)
    lane_model = model(select(sweep.groups, numbers // sweep.starts), numbers.size)
    return start_states(sweep.config, lane_model, numbers)


def kernel(sweep: Simulation, value: int, start: np.ndarray) -> np.ndarray:
    """Integrate one value of the sweep by hand and return its end state."""
    outcome = integrate(
        Scene(axial=False),
        model(select(sweep.groups, np.array([value])), 1),
        np.asarray(sweep.groups.stiffness_cosine),
        np.asarray(sweep.groups.stiffness_sine),
        start[np.newaxis],
        sweep.plan,
    )
    return outcome.end_state[0]


def listing(folder: Path, parameter: str, values: list[float], *overrides: str) -> Simulation:
    """Sweep listed values of another parameter of the same pair."""
    head, tail = PAN2021.read_text().split("[sweep]")
    rest = tail[tail.index("[integration]") :]
    sweep = f'[sweep]\nparameter = "{parameter}"\nvalues = {values}\n'
    file = folder / "listing.toml"
    file.write_text(head + sweep + rest)
    without_count = [override for override in SHORT if not override.startswith("sweep.")]
    return Simulation(load_config(file, (*without_count, *overrides)))
