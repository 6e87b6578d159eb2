"""Do the errors that a sweep reports for its exponents bound the true ones?

    python benchmarks/exponents.py [--output exponents]

Bound: on some lanes of several sweeps, at several numbers of steps, the exponent is compared with a
better one: that of the polished orbit at 3200 steps where the lane is periodic on both grids, or
else the mean over a record twenty times as long at the steps of the sweep, where its own standard
error is below a third of what is judged. The error reported is twice the sum of step error and
standard error.

Coverage: 200 random starts of chaotic lanes, 500 periods each, against their common mean.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from gearchaos_kernels import Plan, integrate
from machine import machine_facts, print_machine

import gearchaos
from gearchaos.engine.run_plan import plan_run
from gearchaos.records.label import CHAOTIC as CHAOTIC_LABEL
from gearchaos.records.lyapunov import largest_exponent

SWEEPS = Path(__file__).parent.parent / "sweeps"
TRUTH_STEPS = 3200
LONGER = 20
STARTS, PERIODS = 200, 500

TORSION = 'scene.effects=["pitch_error", "stiffness_variation", "backlash"]'
BOUNDS = {
    "torsion": ("pan2021_first", [TORSION, "sweep.from=0.11", "sweep.to=14.91", "sweep.count=75"]),
    "six states": ("pan2021_first", ["sweep.from=0.07", "sweep.to=13.77", "sweep.count=75"]),
    "frequency": (
        "mesh_frequency",
        ["groups.pitch_error=4.3", "sweep.from=0.31", "sweep.to=1.93", "sweep.count=75"],
    ),
    "load": (
        "pan2021",
        [
            "groups.pitch_error=7.7",
            'sweep={parameter="load", from=0.05, to=0.9, count=75}',
        ],
    ),
}
STEPS = (25, 50, 100, 200, 400)
CHAOTIC = {
    "six states": ("pan2021_first", [], (12.2, 12.47, 12.7)),
    "torsion": ("pan2021_first", [TORSION], (12.0, 12.6)),
}


def main() -> None:
    """Measure, print, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("exponents"))
    options = parser.parse_args()
    print_machine()
    bounds = {
        f"{name}, {steps} steps": bounded(file, overrides, steps)
        for name, (file, overrides) in BOUNDS.items()
        for steps in STEPS
    }
    covers = {
        f"{name}, {value:g}": coverage(file, overrides, value)
        for name, (file, overrides, values) in CHAOTIC.items()
        for value in values
    }
    facts = {"machine": machine_facts(), "bounds": bounds, "coverage": covers}
    options.output.with_suffix(".json").write_text(json.dumps(facts, indent=1))


def bounded(file: str, overrides: list[str], steps: int) -> dict[str, float]:
    """Count the lanes whose error is bounded by twice the error that is reported."""
    config = gearchaos.load_config(
        SWEEPS / f"{file}.toml",
        [
            *overrides,
            "integration.error_check=1.0",
            "integration.unstable='raise'",
            f"integration.steps_per_period={steps}",
        ],
    )
    coarse = gearchaos.run(config)
    # From the end of each lane, so that it stays on its motion.
    fine = plan_run(config.replace("integration.steps_per_period", TRUTH_STEPS))
    numbers = np.arange(len(fine.lanes))
    system = fine.lanes.system_of(numbers)
    plan = fine.recording._replace(transient_periods=0, recorded_periods=60, section_points=60)
    outcome = integrate(system, coarse["end_state"], plan)
    truth = fine.arrays(numbers, coarse["end_state"], outcome)
    periodic = (coarse["period"] > 0) & (coarse["period"] == truth["period"])
    told = 2.0 * (coarse["exponent_step_error"] + coarse["lyapunov_exponent_standard_error"])
    error = np.abs(coarse["lyapunov_exponent"] - truth["lyapunov_exponent"])
    # Below 1e-9 the truth itself is not better.
    held = error[periodic] <= told[periodic] + 1e-9
    counts = {"periodic": int(periodic.sum()), "periodic_bounded": float(np.mean(held))}
    chaotic = coarse["motion"] == CHAOTIC_LABEL
    record = Plan(steps, 0, LONGER * PERIODS, section_points=0, tangent=True, resolved=True)
    some = np.flatnonzero(chaotic)
    if some.size:
        longer = integrate(system.of(some), coarse["end_state"][some], record)
        mean, own = largest_exponent(longer.growth, system.mesh_period[some])
        judged = own < told[some] / 6.0
        held = np.abs(coarse["lyapunov_exponent"][some] - mean) <= told[some]
        counts |= {"chaotic": int(judged.sum()), "chaotic_bounded": float(np.mean(held[judged]))}
    print(f"{file} {steps} steps: {counts}", flush=True)
    return counts


def coverage(file: str, overrides: list[str], value: float) -> float:
    """Return the share of starts whose exponent lies within two standard errors of the mean."""
    config = gearchaos.load_config(
        SWEEPS / f"{file}.toml",
        [
            *overrides,
            f"sweep={{parameter='pitch_error', values=[{value}, 15.0]}}",
            "start.kind='random'",
            f"start.count={STARTS}",
            "start.spread=0.3",
        ],
    )
    lanes = plan_run(config).lanes
    numbers = np.arange(STARTS)
    plan = Plan(100, 1000, PERIODS, section_points=0, tangent=True, resolved=True)
    system = lanes.system_of(numbers)
    growth = integrate(system, lanes.start_of(numbers), plan).growth
    chaotic = np.mean(growth, axis=1) > 0.0
    exponent, error = largest_exponent(growth[chaotic], system.mesh_period[chaotic])
    share = float(np.mean(np.abs(exponent - np.mean(exponent)) <= 2.0 * error))
    print(f"{file} {value:g}: {chaotic.sum()} of {STARTS} chaotic, two errors cover {share:.3f}")
    return share


if __name__ == "__main__":
    main()
