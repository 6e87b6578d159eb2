"""What do pitch errors tooth by tooth cost, in multiples of a sine at mesh frequency?

    python benchmarks/teeth.py [--rounds 15]

Drawn pairs of `sweeps/grades.toml`, settled in contact, with errors so small that no tooth parts:
crossings would differ. On one core; a round times both kinds one after the other, and every figure
is the median of the ratios of processor time within a round.
"""

import argparse
import statistics
import time
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import GearPairs, Plan, integrate
from machine import print_machine
from throughput import SCENES

from gearchaos import load_config
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "grades.toml"
MODES = {"plain": {}, "plain, tangent": {"tangent": True}} | {
    "resolved": {"resolved": True},
    "resolved, tangent": {"tangent": True, "resolved": True},
}
LANES = 512


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    print_machine()
    numba.set_num_threads(1)
    pairs = ["groups.pitch_error=0.01", "groups.axial_stiffness_p=1", "groups.axial_stiffness_g=1"]
    damping = [f"groups.axial_damping_{gear}=0.1" for gear in "pg"]
    lanes = Lanes(load_config(SWEEP, [*pairs, *damping, 'scene.effects=["pitch_error"]']))
    teeth = lanes.system_of(np.arange(LANES))
    print(f"teeth over sine, median of {rounds} rounds\n")
    print(f"{'scene':34}" + "".join(f"{mode:>20}" for mode in MODES))
    for name, effects in SCENES.items():
        system = teeth.replace(effects=effects)
        start = np.zeros((LANES, len(system.states)))
        start[:, 0] = system.groups.half_backlash + system.groups.load
        settled = integrate(system, start, Plan(200, 300, 0, 0)).end_state
        ratios = [cost(system, settled, mode, rounds) for mode in MODES.values()]
        print(f"{name:34}" + "".join(f"{ratio:20.2f}" for ratio in ratios), flush=True)


def cost(system: GearPairs, start, mode, rounds: int) -> float:
    """Return the processor time of one in that of the other."""
    plan = Plan(200, 0, 20, 1, **{"resolved": False, **mode})
    sine = system.replace(teeth=None)

    def seconds(one: GearPairs) -> float:
        began = time.process_time()
        integrate(one, start, plan)
        return time.process_time() - began

    seconds(system), seconds(sine)
    return statistics.median(seconds(system) / seconds(sine) for _ in range(rounds))


if __name__ == "__main__":
    main()
