"""From a result with several starts to its basins of attraction."""

from typing import Any

import numpy as np
from gearchaos_kernels import System
from numpy.typing import NDArray

from gearchaos.dynamics.attractors import Attractor, find_attractors, led_to
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.refinement import computable
from gearchaos.engine.running import choose_threads
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.records.attractor_sets import numbers_along
from gearchaos.records.basin_entropy import basin_entropy
from gearchaos.records.label import UNRESOLVED
from gearchaos.results.basins import Basin, Basins
from gearchaos.results.result import Result
from gearchaos.results.shares import Counted
from gearchaos.results.stage_table import label_text
from gearchaos.results.variables import (
    LABELS,
    LARGEST_EXPONENT,
    REPEATS,
    STANDARD_ERROR,
    START,
    STEP_ERROR,
    axis_name,
)

Numbers = NDArray[np.intp]

NO_MEANS = (
    *("return_distance", "section_error", STEP_ERROR, "lyapunov_sum"),
    *(LARGEST_EXPONENT, LARGEST_EXPONENT + STANDARD_ERROR),
)
"""Numbers of a lane that tell of its computation, or that a basin has of its own."""


def find_basins(result: Result, name: str = "the result", threads: int | None = None) -> Basins:
    """Find the attractors of a result, their basins, and their numbers along the sweep.

    Attractors are found as `find_attractors` does; those of one value are numbered by their shares,
    the largest first, unless they go on as one of a lower value, see `numbers_along`. ``result``:
    over one swept parameter or at a value of it, with several starts; messages call it ``name``.
    Raises ConfigurationError if it has other axes, FileError if it holds no labels or not its
    configuration.
    """
    if not all(label in result for label in LABELS):
        raise FileError(f"{name}: holds no labels; run the sweep again with outputs.motion = true")
    motion, period = (result.lanes(label) for label in LABELS)
    config = computable(result, name).replace("start.carry", "none")
    starts, swept = config.start.size, [axis for axis in result.axes if axis not in REPEATS]
    if {*result.axes} != {*swept, START} or len(swept) > 1:
        raise ConfigurationError(
            f"{name}: has the axes {', '.join(result.axes)}; basins are those of several starts "
            'over one parameter: set start.kind = "grid" or start.count, fix others with sel (--at)'
        )
    choose_threads(threads)
    lanes = Lanes(config)
    if (len(lanes), lanes.states) != (motion.size, result.variables["state"].flags):
        raise FileError(f"{name}: holds the configuration of other lanes; run the sweep again")
    every = np.arange(len(lanes))
    parameter = swept[0] if swept else axis_name(config.sweep.parameter)
    values = {axis_name(p): v for p, v in lanes.values_of(every[::starts]).items()}[parameter]
    system = lanes.system_of(every)
    state, at_value = result.lanes("end_state"), every // starts
    how = config.integration.steps_per_period, config.integration.method
    found, place = find_attractors(system, at_value, state, motion, period, *how)
    # What has a motion, but no orbit next to its state, is not told either.
    numbers = -np.maximum(motion, UNRESOLVED).astype(np.intp)
    numbers[place >= 0] = _numbered(system, found, place, at_value, *how)[place[place >= 0]]
    told = [v.name for v in result.variables.values() if v.dims == result.axes]
    told = [name for name in told if result[name].dtype == float and name not in NO_MEANS]
    known = LARGEST_EXPONENT in result
    exponents = result.lanes(LARGEST_EXPONENT) if known else np.full(every.size, np.nan)
    rows: list[Basin] = []
    for here in every.reshape(-1, starts):
        # Those without an attractor come last.
        for number in sorted({*numbers[here].tolist()}, key=lambda n: (n < 0, abs(n))):
            mine = here[numbers[here] == number]
            first, orbit = mine[0], found[place[mine[0]]] if number > 0 else None
            code, repeats = (motion[first], int(period[first])) if orbit else (-number, 0)
            multiplier = float(np.abs(orbit.multipliers[0])) if orbit else np.nan
            exponent = _mean(exponents[mine])
            if multiplier > 0.0:
                exponent = np.log(multiplier) / (repeats * system.excitation_period[first])
            rows.append(
                Basin(
                    value=float(values[at_value[first]]),
                    number=number,
                    motion=label_text(result.variables["motion"].flags[code], repeats),
                    period=repeats,
                    multiplier=multiplier,
                    exponent=float(exponent),
                    starts=Counted(np.array(mine.size), np.array(starts)),
                    means={name: _mean(result.lanes(name)[mine]) for name in told},
                    section=orbit.points if orbit else np.zeros((0, len(system.states))),
                )
            )
    box = config.start.box if config.start.kind == "grid" else {}
    grid: dict[str, NDArray[np.float64]] = {
        name: np.linspace(*bounds, config.start.count) for name, bounds in box.items()
    }
    shape = [along.size for along in grid.values()]
    every_start = numbers.reshape(-1, starts)
    entropy = [basin_entropy(row.reshape(shape)) for row in every_start] if grid else []
    return Basins(result, parameter, values, every_start, rows, grid, entropy)


def _numbered(
    system: System, found: list[Attractor], place: Numbers, at_value: Numbers, *how: Any
) -> Numbers:
    """Number the attractors along the sweep, given the places of all lanes among them."""
    sizes = np.bincount(place[place >= 0], minlength=len(found))
    lanes = np.array([one.lane for one in found], dtype=np.intp)
    following = np.minimum(at_value[lanes] + 1, at_value[-1])
    seeds = np.array([one.points[0] for one in found]).reshape(-1, len(system.states))
    ahead = led_to(system.of(np.searchsorted(at_value, following)), seeds, *how)
    there: list[list[int]] = [[] for _ in range(at_value[-1] + 1)]
    for at in np.argsort(-sizes, kind="stable").tolist():
        there[at_value[lanes[at]]].append(at)
    sets = [[found[at].points for at in some] for some in there]
    along = numbers_along(sets, [[ahead[at] for at in some] for some in there])
    number = np.zeros(len(found), dtype=np.intp)
    for some, numbers in zip(there, along, strict=True):
        number[some] = numbers
    return number


def _mean(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else np.nan
