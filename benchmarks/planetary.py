"""How much faster are flow maps of a planetary set than a scalar Runge-Kutta loop at equal error?

    python benchmarks/planetary.py [--lanes 10] [--periods 500] [--rounds 3]

The set of sweeps/planetary.toml has up to 18 coordinates, less those that are held, and backlash in
six meshes; every speed has maps of its own. Both contestants integrate the states alone, at speeds
spread over the sweep, on one thread, in processor time. The loop is that of a textbook: M^-1 times
matrices, stage by stage, plain steps across clearance boundaries. The error is the largest one of a
displacement after a few periods, in the median lane. Steps for smaller errors than measured follow
from the order, which is printed. The time of flow maps includes making them.
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

from gearchaos import load_config
from gearchaos.engine.lanes import Lanes

SWEEP = Path(__file__).parent.parent / "sweeps" / "planetary.toml"
ERROR_PERIODS = 5
STEPS = (1000, 4000)
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
    parser.add_argument("--lanes", type=int, default=10)
    parser.add_argument("--periods", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print_machine()
    numba.set_num_threads(1)
    config = load_config(SWEEP, [f"sweep.count={options.lanes}"])
    system = Lanes(config).system_of(np.arange(options.lanes))
    start = system.contact_state()
    exact = by_maps(system, start, 36, ERROR_PERIODS)
    print(
        f"flow maps, 12 steps: error {error(by_maps(system, start, 12, ERROR_PERIODS), exact):.1e}"
    )
    errors = [error(by_loop(system, start, steps, ERROR_PERIODS), exact) for steps in STEPS]
    order = np.log(errors[0] / errors[1]) / np.log(STEPS[1] / STEPS[0])
    for steps, found in zip(STEPS, errors, strict=True):
        print(f"scalar RK4, {steps} steps: error {found:.1e}")
    print(f"its order between them is {order:.2f}")
    steps, times = [], []
    for number in range(options.rounds):
        # Another frequency needs other maps: none are kept from the round before.
        other = replace(system, frequency=system.frequency * (1.0 + 1e-9 * (1 + number)))
        loop = seconds(by_loop, other, start, STEPS[0], ERROR_PERIODS) / ERROR_PERIODS / STEPS[0]
        maps = seconds(by_maps, other, start, 12, options.periods) / options.periods
        steps.append(loop / maps)
        times.append((loop / options.lanes, maps / options.lanes))
    step, period = (1e6 * statistics.median(one) for one in zip(*times, strict=True))
    print(f"scalar RK4: {step:.2f} us a step; flow maps: {period:.0f} us a lane and period")
    print("error | steps of RK4 a period | times as long as flow maps")
    for wanted in WANTED:
        needed = STEPS[1] * (errors[1] / wanted) ** (1.0 / order)
        print(f"{wanted:.0e} | {needed:.0f} | {needed * statistics.median(steps):.0f}")


if __name__ == "__main__":
    main()
