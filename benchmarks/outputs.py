"""What do contact, loads, extremes and amplitudes of every lane cost a sweep?

    python benchmarks/outputs.py [--rounds 9]

The lanes of `sweeps/pan2021.toml` in its three scenes, with its transient and its record, with
and without the tangent vector of the exponent, on one core. A round times all of them one after the
other, and every figure is the median of the ratios of processor time within a round.
"""

import argparse
import statistics
import time
from fractions import Fraction
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import GearPairs, Plan, integrate
from machine import print_machine
from throughput import SCENES

from gearchaos import load_config
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "pan2021_full.toml"
OUTPUTS = {
    "contact": {"contact": True},
    "loads": {"loads": True},
    "both": {"contact": True, "loads": True},
    "loads, a state": {"loads": True, "states": ("delta_5",)},
    "loads, 5 orders": {"loads": True, "orders": tuple(Fraction(n, 2) for n in range(1, 6))},
}
LANES, SHARE = 128, 10
"""Lanes, and the part of the configured lengths that they run."""


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    print_machine()
    numba.set_num_threads(1)
    config = load_config(SWEEP, [f"sweep.count={LANES}"])
    plan = plan_of(config, steps_per_period=200, section_points=100)
    plan = plan._replace(
        transient_periods=plan.transient_periods // SHARE,
        recorded_periods=plan.recorded_periods // SHARE,
        section_points=10,
    )
    system = Lanes(config).system_of(np.arange(LANES))
    lengths = f"{plan.transient_periods} periods and a record of {plan.recorded_periods}"
    print(f"in multiples of a sweep without, {lengths}, median of {rounds} rounds\n")
    print(f"{'scene':40}" + "".join(f"{name:>17}" for name in OUTPUTS))
    for name, effects in SCENES.items():
        for tangent in (False, True):
            ratios = costs(system.replace(effects=effects), plan._replace(tangent=tangent), rounds)
            row = f"{name}{', tangent' if tangent else ''}"
            print(f"{row:40}" + "".join(f"{ratio:17.2f}" for ratio in ratios), flush=True)


def costs(system: GearPairs, plan: Plan, rounds: int) -> list[float]:
    """Return the processor time with each of the `OUTPUTS` in that without any."""
    start = np.zeros((LANES, len(system.states)))

    def seconds(what: dict[str, bool]) -> float:
        began = time.process_time()
        integrate(system, start, plan._replace(**what))
        return time.process_time() - began

    plans = [{}, *OUTPUTS.values()]
    for what in plans:
        seconds(what)
    measured = np.array([[seconds(what) for what in plans] for _ in range(rounds)])
    return [statistics.median(column) for column in (measured[:, 1:] / measured[:, :1]).T]


if __name__ == "__main__":
    main()
