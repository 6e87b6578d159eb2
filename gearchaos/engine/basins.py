"""From a result with several starts to its basins of attraction."""

import numpy as np

from gearchaos.dynamics.attractors import find_attractors, numbers_along
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.recomputing import computable
from gearchaos.engine.running import choose_threads
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.outputs import names as known
from gearchaos.records.label import UNRESOLVED
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.reading.ensembles import Basin, Basins, basin_entropy, in_order
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import label_text, require_labels

NO_MEANS = (
    *("return_distance", "section_error", "lyapunov_sum"),
    *(known.STEP_ERROR, known.LARGEST_EXPONENT + known.STANDARD_ERROR),
)
"""Numbers of a lane that tell of its computation alone."""


def find_basins(result: Result, name: str = "the result", threads: int | None = None) -> Basins:
    """Find the attractors of a result, their basins, and their numbers along the sweep.

    See `find_attractors` and `numbers_along`. ``result``: over one swept parameter or at a value of
    it, with several starts; messages call it ``name``. Raises ConfigurationError if it has other
    axes, FileError if it holds no labels or not its configuration.
    """
    require_labels(result, name)
    config = computable(result, name).replace("start.carry", "none")
    swept = [axis for axis in result.axes if axis not in known.REPEATS]
    if {*result.axes} != {*swept, known.START} or len(swept) > 1:
        raise ConfigurationError(
            f"{name}: has the axes {', '.join(result.axes)}; basins are those of several starts "
            'over one parameter: set start.kind = "grid" or start.count, fix others with sel (--at)'
        )
    choose_threads(threads)
    motion, period = (result.lanes(label) for label in known.LABELS)
    lanes, starts = Lanes(config), config.start.size
    if (len(lanes), lanes.states) != (motion.size, result.variables["state"].flags):
        raise FileError(f"{name}: holds the configuration of other lanes; run the sweep again")
    every = np.arange(len(lanes))
    system, at_value = lanes.system_of(every), every // starts
    state = result.lanes("end_state")
    found, place = find_attractors(system, at_value, state, motion, period, plan_of(config))
    sizes = np.bincount(place[place >= 0], minlength=len(found))
    averages = np.array([one.averages for one in found]).reshape(-1, 2, len(system.states))
    value = np.array([at_value[one.lane] for one in found], dtype=np.intp)
    # What has a motion, but no orbit next to its state, is not told either.
    numbers = -np.maximum(motion, UNRESOLVED).astype(np.intp)
    numbers[place >= 0] = numbers_along(value, sizes, averages)[place[place >= 0]]
    parameter = swept[0] if swept else known.axis_name(config.sweep.parameter)
    values = np.atleast_1d(result[parameter] if swept else result.fixed[parameter])
    numeric = [v for v in result.variables.values() if v.dtype == "float64"]
    contact = {n: v.flags for n, v in result.variables.items() if n.startswith("contact_state_")}
    told = [v.name for v in numeric if v.dims == result.axes and v.name not in NO_MEANS]
    basins: list[Basin] = []
    for here in every.reshape(-1, starts):
        for number in in_order(numbers[here].tolist()):
            mine = here[numbers[here] == number]
            first, orbit = mine[0], found[place[mine[0]]] if number > 0 else None
            code, repeats = (motion[first], int(period[first])) if orbit else (-number, 0)
            kept = {one: np.ma.masked_invalid(result.lanes(one)[mine]) for one in told}
            means = {one: float(np.ma.filled(n.mean(), np.nan)) for one, n in kept.items()}
            exponent = means.pop(known.LARGEST_EXPONENT, np.nan)
            multiplier = float(np.abs(orbit.multipliers[0])) if orbit else np.nan
            if multiplier > 0.0:
                exponent = float(np.log(multiplier) / (repeats * system.excitation_period[first]))
            low, high = wilson_interval(mine.size, starts).tolist()
            basins.append(
                Basin(
                    value=float(values[at_value[first]]),
                    number=number,
                    motion=label_text(result.variables["motion"].flags[code], repeats),
                    period=repeats,
                    multiplier=multiplier,
                    exponent=exponent,
                    starts=mine.size,
                    share=mine.size / starts,
                    share_95_percent=(low, high),
                    contact={n: f[result.lanes(n)[first]] for n, f in contact.items() if orbit},
                    means=means,
                    section=orbit.points if orbit else np.zeros((0, len(system.states))),
                )
            )
    box = config.start.box if config.start.kind == "grid" else {}
    grid = {str(one): np.linspace(*bounds, config.start.count) for one, bounds in box.items()}
    rows, shape = numbers.reshape(-1, starts), [config.start.count] * len(box)
    entropy = [basin_entropy(row.reshape(shape)) for row in rows] if grid else []
    return Basins(result, parameter, values, rows, basins, grid, entropy)
