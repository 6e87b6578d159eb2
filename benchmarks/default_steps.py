"""Is any of 400 random pairs wrong by more than 1 % without a word about it?

    python benchmarks/default_steps.py [--pairs 400] [--steps 200]

Each pair is integrated over 12 mesh periods from rest, with the steps that are chosen for it or
with a given number, and compared with flow maps, which are exact to 1e-10. Its error is that of
the state after the last period, each part of it over its largest value after any period. Refused
are pairs for which the given number is unstable.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from gearchaos_kernels import integrate
from machine import print_machine

from gearchaos.engine.choosing import with_chosen_steps

sys.path.insert(0, str(Path(__file__).parent.parent))

from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.errors import ConfigurationError
from gearchaos.models import Configuration
from tests.gearchaos.random_pairs import random_configuration

WRONG = 1e-2
PERIODS = 12
TRUTH = {"method": "flow_map", "steps_per_period": 48}
WARNINGS = "too coarse", "amplif", "shift Lyapunov exponents"


def main() -> int:
    """Count the pairs by their steps, and list those that are wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=400)
    parser.add_argument("--steps", type=int, help="steps per period; by default chosen")
    options = parser.parse_args()
    print_machine()
    taken: Counter[int] = Counter()
    refused, silent, wrong, seconds = 0, 0, [], []
    for number in range(options.pairs):
        config = Configuration.from_toml(random_configuration(number, options.steps), f"{number}")
        began = time.perf_counter()
        try:
            simulation = plan_run(config)
        except ConfigurationError:
            refused += 1
            continue
        simulation = with_chosen_steps(simulation)
        seconds.append(time.perf_counter() - began)
        taken[simulation.plan.steps_per_period] += 1
        error = error_of(simulation)
        if error > WRONG:
            warned = any(text in note for note in simulation.notes for text in WARNINGS)
            wrong.append(f"pair {number}: off by {error:.1e}, {'warned' if warned else 'SILENT'}")
            silent += not warned
    print("\n".join(wrong))
    print(f"steps per period: {dict(sorted(taken.items()))}, {refused} pairs refused")
    print(f"{len(wrong)} wrong by more than {WRONG:.0%}, {silent} of them without a word")
    print(f"a choice took {np.median(seconds):.3f} s (median), {max(seconds[9:]):.2f} s at most")
    return 1 if silent else 0


def error_of(simulation: RunPlan) -> float:
    """Return the error of the only lane after the last period."""
    first = np.arange(1)
    system, start = simulation.lanes.system_of(first), simulation.lanes.start_of(first)
    plan = simulation.plan._replace(
        transient_periods=0, recorded_periods=PERIODS, section_points=PERIODS
    )
    truth = integrate(system, start, plan._replace(**TRUTH)).section[0]
    found = integrate(system, start, plan).section[0]
    return float(np.max(np.abs(found[-1] - truth[-1]) / np.max(np.abs(truth), axis=0)))


if __name__ == "__main__":
    sys.exit(main())
