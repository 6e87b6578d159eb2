"""Do the boundaries of a map lie where its periodic motions lose stability, and what do they cost?

    python benchmarks/boundaries.py [--map MAP.h5] [--lines 4]

The map is `sweeps/speed_and_error.toml` with 300 x 300 lanes; it is computed unless a file is
given. Two neighbouring lanes, one with period 1 and the other without, are a change of the map. The
orbit of the first is followed to the second in eight parts of the way. If it is lost or its
multipliers leave the unit circle, the change is one of stability. If it arrives and is still
stable, both lanes differ in their basins only: the start at rest leads to another motion. A curve
agrees with a change of stability if it passes both lanes within one cell.

Printed are the changes of both kinds, the share that the curves agree with, and the processor time
of the search, warm, over that of the map.
"""

import argparse
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from gearchaos_kernels import Plan
from machine import print_machine
from numpy.typing import NDArray

import gearchaos
from gearchaos.dynamics.orbits import polish
from gearchaos.engine.bounding import find_boundaries
from gearchaos.engine.running import one_thread
from gearchaos.models import swept_values
from gearchaos.models.registry import system_of
from gearchaos.records.boundary import Boundary
from gearchaos.records.branch import GRAZING
from gearchaos.records.period import coordinate_scale

CONFIG = Path(__file__).parents[1] / "sweeps" / "speed_and_error.toml"
PARTS = 8
STEPS = 12
DENSE = 0.05
"""Longest distance between the points of a curve that are compared, in cells."""

Cells = NDArray[np.intp]
Floats = NDArray[np.float64]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", type=Path, help="result of the sweep")
    parser.add_argument("--lines", type=int, default=4, help="lines across the map")
    arguments = parser.parse_args()
    print_machine()
    config = gearchaos.load_config(CONFIG)
    begin = time.process_time()
    result = gearchaos.open_result(arguments.map) if arguments.map else gearchaos.run(config)
    of_map = time.process_time() - begin
    find_boundaries(result, lines=arguments.lines)
    begin = time.process_time()
    curves = find_boundaries(result, lines=arguments.lines).boundaries
    of_search = time.process_time() - begin
    pairs, lost = changes(config, result)
    away = distances(config, curves, pairs)
    agree = int(np.sum(lost & (away <= 1.0)))
    print(f"changes of period 1: {lost.size}, of them of stability: {lost.sum()}")
    print(f"within one cell of a curve: {agree} of {lost.sum()}, {agree / lost.sum():.2%}")
    print(f"search: {of_search:.1f} s of processor time, {len(curves)} curves")
    if not arguments.map:
        print(f"map: {of_map:.1f} s; the search takes {of_search / of_map:.1%} of it")


def changes(
    config: gearchaos.Configuration, result: gearchaos.Result
) -> tuple[Cells, NDArray[np.bool_]]:
    """Return the pairs of cells of all changes, (changes, 2, 2), and whether stability is lost.

    The first cell has period 1; a cell is given by its numbers along both parameters.
    """
    first, second = (swept_values(sweep) for sweep in config.sweeps.values())
    alone = result.lanes("period").reshape(second.size, first.size).T == 1
    states = result.lanes("end_state").reshape(second.size, first.size, -1).swapaxes(0, 1)
    found = []
    for step in ((1, 0), (0, 1)):
        one, other = (
            alone[: first.size - step[0], : second.size - step[1]],
            alone[step[0] :, step[1] :],
        )
        for at in np.argwhere(one != other):
            ends = at, at + step
            found.append(ends if alone[tuple(at)] else ends[::-1])
    pairs = np.array(found)
    scale = coordinate_scale(states[alone][np.newaxis])[0]
    state, left = states[tuple(pairs[:, 0].T)], np.arange(len(pairs))
    names, plan = (
        [sweep.parameter for sweep in config.sweeps.values()],
        Plan(STEPS, 0, 1, 1, tangent=True, method="flow_map"),
    )
    for part in np.arange(PARTS + 1) / PARTS:
        at = pairs[left, 0] + part * (pairs[left, 1] - pairs[left, 0])
        values = [np.interp(at[:, n], np.arange(v.size), v) for n, v in enumerate((first, second))]
        system = system_of(config, dict(zip(names, values, strict=True)), config.needed_effects)
        with one_thread():
            orbits = polish(system, state[left], np.ones(left.size, dtype=np.intp), plan, scale)
        kept = orbits.converged & orbits.stable
        state[left[kept]] = orbits.points[kept]
        left = left[kept]
    lost = np.ones(len(pairs), dtype=bool)
    lost[left] = False
    return pairs, lost


def distances(config: gearchaos.Configuration, curves: Sequence[Boundary], pairs: Cells) -> Floats:
    """Return how far the nearest curve of period 1 passes each pair of cells, in cells."""
    both = [swept_values(sweep) for sweep in config.sweeps.values()]
    points = []
    for curve in curves:
        if curve.kind == GRAZING or curve.period != 1:
            continue
        at = np.stack(
            [np.interp(curve.values[:, n], v, np.arange(v.size)) for n, v in enumerate(both)], 1
        )
        for one, other in pairwise(at):
            count = int(np.ceil(np.max(np.abs(other - one)) / DENSE)) + 1
            points.append(one + np.linspace(0.0, 1.0, count)[:, np.newaxis] * (other - one))
    dense = np.concatenate(points)
    low, high = pairs.min(axis=1), pairs.max(axis=1)
    return np.array(
        [
            np.maximum(np.maximum(one - dense, dense - other), 0.0).max(axis=1).min()
            for one, other in zip(low, high, strict=True)
        ]
    )


if __name__ == "__main__":
    main()
