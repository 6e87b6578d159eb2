"""What do resolved steps cost, in multiples of plain ones at the same number of steps?

    python benchmarks/resolved_cost.py [--rounds 9]

The sweep of Pan 2021 from rest, on one core. A round times plain and resolved steps of one scene
one after the other; every figure is the median of the ratios within a round.
"""

import argparse
import statistics

from machine import print_machine
from throughput import SCENES, engine, nanoseconds_per_step

COUNTS = (100, 200, 288)


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    print_machine()
    print(f"resolved over plain, median of {rounds} rounds\n")
    print(f"{'steps per period':34}" + "".join(f"{count:8d}" for count in COUNTS))
    for name, scene in SCENES.items():
        for tangent in (False, True):
            ratios = [cost(scene, tangent, count, rounds) for count in COUNTS]
            kind = f"{name}, tangent" if tangent else name
            print(f"{kind:34}" + "".join(f"{ratio:8.2f}" for ratio in ratios), flush=True)


def cost(scene, tangent: bool, steps: int, rounds: int) -> float:
    """Return the time of resolved steps over that of plain ones."""
    plain, resolved = (engine(scene, tangent, mode, 1, steps) for mode in (False, True))
    plain(), resolved()
    return statistics.median(
        1.0 / (nanoseconds_per_step(plain) / nanoseconds_per_step(resolved)) for _ in range(rounds)
    )


if __name__ == "__main__":
    main()
