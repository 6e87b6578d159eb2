"""How fast are exact methods on a planetary set, and how much slower is a scalar Runge-Kutta loop?

    python benchmarks/planetary.py [--lanes 40] [--periods 500] [--rounds 3] [--sweep 500]

The set of sweeps/planetary.toml has up to 18 coordinates, less those that are held, and backlash in
six meshes; every speed has maps of its own. All contestants integrate the states alone, at speeds
spread over the sweep, on one thread, in processor time. The loop is that of a textbook: M^-1 times
matrices, stage by stage, plain steps across clearance boundaries. The error is the largest one of a
displacement after a few periods, in the median lane. Steps for an error lie between those that were
measured, or follow from the order of the last two, which is printed. The time of flow maps includes
making them.

Last comes a whole sweep by Taylor series, with labels and exponents, in a process that has compiled
everything before: 400 periods of transient and 100 recorded ones.
"""

import argparse
import statistics
import time
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
from gearchaos_kernels import Plan, integrate
from machine import print_machine
from numba import njit

from gearchaos import load_config, run
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "planetary.toml"
ERROR_PERIODS = 5
STEPS = (1000, 4000, 16_000)
WANTED = (1e-6, 1e-8, 1e-10)


@njit
def accelerations(x, v, waves, lane):
    """Return the accelerations of one machine; ``lane``: its matrices and vectors."""
    position, rate, reaction, force, gap, motion, motion_rate, stiffness, damping, half = lane
    pushes = np.zeros(gap.shape[0])
    for j in range(gap.shape[0]):
        y, closing, spring = 0.0, 0.0, 0.0
        for i in range(x.size):
            y += gap[j, i] * x[i]
            closing += gap[j, i] * v[i]
        for w in range(waves.size):
            y -= motion[j, w] * waves[w]
            closing -= motion_rate[j, w] * waves[w]
            spring += stiffness[j, w] * waves[w]
        pushes[j] = spring * (y - min(max(y, -half[j]), half[j])) + damping[j] * closing
    result = np.zeros(x.size)
    for i in range(x.size):
        for w in range(waves.size):
            result[i] += force[i, w] * waves[w]
        for k in range(x.size):
            result[i] -= position[i, k] * x[k] + rate[i, k] * v[k]
        for j in range(pushes.size):
            result[i] -= reaction[i, j] * pushes[j]
    return result


@njit
def scalar_rk4(x, v, lane, waves, step, periods):
    """Integrate one machine in place; ``waves`` (2 steps + 1, waves): at every half step."""
    for _ in range(periods):
        for n in range(waves.shape[0] // 2):
            begin, middle, end = waves[2 * n], waves[2 * n + 1], waves[2 * n + 2]
            a1 = accelerations(x, v, begin, lane)
            v2 = v + 0.5 * step * a1
            a2 = accelerations(x + 0.5 * step * v, v2, middle, lane)
            v3 = v + 0.5 * step * a2
            a3 = accelerations(x + 0.5 * step * v2, v3, middle, lane)
            v4 = v + step * a3
            a4 = accelerations(x + step * v3, v4, end, lane)
            x += step / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
            v += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


def by_loop(system, start: np.ndarray, steps: int, periods: int) -> np.ndarray:
    """Return the end states of all lanes by the scalar loop."""
    phase = np.pi / steps * np.arange(2 * steps + 1)
    waves = np.hstack([np.ones((phase.size, 1)), system.wave_values(phase)])
    end = start.copy()
    for lane in range(system.lanes):
        names = "position", "rate", "reaction", "force", "gap", "motion"
        matrices = [np.ascontiguousarray(getattr(system, name)[lane]) for name in names]
        rates = np.zeros_like(matrices[-1])
        speeds = system.frequency[lane] * np.array(system.orders)
        rates[:, 1::2], rates[:, 2::2] = (
            speeds * matrices[-1][:, 2::2],
            -speeds * (matrices[-1][:, 1::2]),
        )
        rest = system.stiffness[lane], system.damping[lane], system.half_clearance[lane]
        x, v = end[lane, ::2].copy(), end[lane, 1::2].copy()
        step = system.mesh_period[lane] / steps
        scalar_rk4(x, v, (*matrices, rates, *rest), waves, step, periods)
        end[lane, ::2], end[lane, 1::2] = x, v
    return end


def by_maps(system, start: np.ndarray, steps: int, periods: int) -> np.ndarray:
    """Return the end states of all lanes by flow maps."""
    return integrate(system, start, Plan(steps, 0, periods, 0, method="flow_map")).end_state


def by_series(system, start: np.ndarray, steps: int, periods: int) -> np.ndarray:
    """Return the end states of all lanes by Taylor series."""
    return integrate(system, start, Plan(steps, 0, periods, 0, method="taylor")).end_state


EXACT = {"flow maps": (by_maps, 12), "Taylor series": (by_series, 4)}
"""The exact methods, with their steps."""


def error(found: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest error of any displacement, relative to the largest one; in the median."""
    errors = np.abs(found - exact)[:, ::2].max(axis=1) / np.abs(exact[:, ::2]).max(axis=1)
    return float(np.median(errors))


def seconds(integrated, *given) -> float:
    """Return the processor time of an integration."""
    began = time.process_time()
    integrated(*given)
    return time.process_time() - began


def main() -> None:
    """Measure errors, then time both in turn, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lanes", type=int, default=40)
    parser.add_argument("--periods", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--sweep", type=int, default=500, help="speeds of the sweep, 0 for none")
    options = parser.parse_args()
    print_machine()
    numba.set_num_threads(1)
    config = load_config(SWEEP, [f"sweep.count={options.lanes}"])
    system = Lanes(config).system_of(np.arange(options.lanes))
    start = system.contact_state()
    exact = by_maps(system, start, 36, ERROR_PERIODS)
    for name, (method, steps) in EXACT.items():
        found = error(method(system, start, steps, ERROR_PERIODS), exact)
        print(f"{name}, {steps} steps: error {found:.1e}")
    errors = [error(by_loop(system, start, steps, ERROR_PERIODS), exact) for steps in STEPS]
    for steps, found in zip(STEPS, errors, strict=True):
        print(f"scalar RK4, {steps} steps: error {found:.1e}")
    order = np.log(errors[-2] / errors[-1]) / np.log(STEPS[-1] / STEPS[-2])
    print(f"its order between the last two is {order:.2f}")
    times = [in_turn(system, start, number, options.periods) for number in range(options.rounds)]
    loop, *others = (
        1e6 * statistics.median(one) / options.lanes for one in zip(*times, strict=True)
    )
    print(f"scalar RK4: {loop:.2f} us a step")
    for name, other in zip(EXACT, others, strict=True):
        print(f"{name}: {other:.0f} us a lane and period")
    print("error | steps of RK4 a period | " + " | ".join(f"in times of {name}" for name in EXACT))
    for wanted in WANTED:
        needed = steps_for(wanted, errors, order)
        shares = [
            needed * statistics.median(one[0] / one[place] for one in times)
            for place in range(1, 1 + len(EXACT))
        ]
        print(f"{wanted:.0e} | {needed:.0f} | " + " | ".join(f"{share:.0f}" for share in shares))
    if options.sweep:
        whole_sweep(options.sweep)


def steps_for(wanted: float, errors: list[float], order: float) -> float:
    """Return the steps of the scalar loop for an error, from those of `STEPS`."""
    if wanted < errors[-1]:
        return STEPS[-1] * float((errors[-1] / wanted) ** (1.0 / order))
    return float(np.exp(np.interp(-np.log(wanted), -np.log(errors), np.log(STEPS))))


def in_turn(system, start: np.ndarray, number: int, periods: int) -> list[float]:
    """Return the seconds of one step of the loop, and of one period of each exact method."""
    # Another frequency needs other maps: none are kept from the round before.
    other = replace(system, frequency=system.frequency * (1.0 + 1e-9 * (1 + number)))
    loop = seconds(by_loop, other, start, STEPS[0], ERROR_PERIODS) / ERROR_PERIODS / STEPS[0]
    exact = [seconds(method, other, start, n, periods) / periods for method, n in EXACT.values()]
    return [loop, *exact]


def whole_sweep(speeds: int) -> None:
    """Print the processor time of a sweep with labels and exponents, compilation apart."""
    integration = "integration={method='taylor', transient_periods=400, recorded_periods=100}"
    given = [integration, "outputs.loads=false", "outputs.contact=false"]
    run(load_config(SWEEP, [*given, "sweep.count=8"]))
    began = time.process_time()
    result = run(load_config(SWEEP, [*given, f"sweep.count={speeds}"]))
    took = time.process_time() - began
    labels = dict(zip(*np.unique(result["motion"], return_counts=True), strict=True))
    print(f"{speeds} speeds, 500 periods, labels and exponents: {took:.1f} s")
    print("lanes by label:", {int(label): int(count) for label, count in labels.items()})


if __name__ == "__main__":
    main()
