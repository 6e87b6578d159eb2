"""Basins of attraction from a result with several starts."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem

from gearchaos.arrays import Floats, Integers
from gearchaos.dynamics.attractors import Attractor, find_attractors, numbers_along
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.recomputing import computable
from gearchaos.engine.running import choose_threads
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.models import Configuration
from gearchaos.outputs import names as known
from gearchaos.records.label import UNRESOLVED
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.reading.ensembles import Basin, Basins, basin_entropy, in_order
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import label_text, require_labels
from gearchaos.results.reading.tables import unit_text

NO_MEANS = (
    *("return_distance", "section_error", "lyapunov_sum"),
    *(known.STEP_ERROR, known.LARGEST_EXPONENT + known.STANDARD_ERROR),
)
"""Variables that describe the computation of a lane: they have no mean over a basin."""


class _Recomputed(NamedTuple):
    """A result and the system of its lanes.

    ``value`` (lanes,): value of the swept parameter of each lane; ``starts``: number of starts per
    value.
    """

    result: Result
    system: LaneSystem
    value: Floats
    starts: int


def find_basins(result: Result, name: str = "the result", threads: int | None = None) -> Basins:
    """Find the attractors of a result, their basins, and their numbers along the sweep.

    Parameters
    ----------
    result : Result
        Result with labels and several starts, over at most one swept parameter.
    name : str
        Name of the result in messages.
    threads : int, optional
        Number of threads; by default all cores.

    Returns
    -------
    Basins
        The basins of every value of the parameter, see `find_attractors` and `numbers_along`.

    Raises
    ------
    ConfigurationError
        If the result has other axes, or carries states along the sweep.
    FileError
        If the result has no labels, or its configuration is missing or describes other lanes.

    Examples
    --------
    >>> from gearchaos.engine.basins import find_basins
    >>> found = find_basins(gearchaos.open_result("grid.h5"))
    >>> found.numbers.shape
    (1, 4)
    """
    require_labels(result, name)
    config = computable(result, name)
    swept = _swept_axes(result, name)
    _require_own_starts(config, name)
    choose_threads(threads)
    lanes, starts = Lanes(config), config.start.size
    shape = result.lanes("motion").size, result.variables["state"].flags
    if (len(lanes), lanes.states) != shape:
        raise FileError(f"{name}: holds the configuration of other lanes; run the sweep again")
    every = np.arange(len(lanes))
    parameter = swept[0] if swept else known.axis_name(config.sweep.parameter)
    values = np.atleast_1d(result[parameter] if swept else result.fixed[parameter])
    recomputed = _Recomputed(result, lanes.system_of(every), values[every // starts], starts)
    attractors, numbers = _numbered_attractors(recomputed, every // starts, config)
    basins: list[Basin] = []
    for here in every.reshape(-1, starts):
        for number in in_order(numbers[here].tolist()):
            members = here[numbers[here] == number]
            basins.append(_basin(recomputed, members, number, attractors[members[0]]))
    box = config.start.box if config.start.kind == "grid" else {}
    grid = {str(one): np.linspace(*bounds, config.start.count) for one, bounds in box.items()}
    rows, side = numbers.reshape(-1, starts), [config.start.count] * len(box)
    entropy = [basin_entropy(row.reshape(side)) for row in rows] if grid else []
    named = {known.LARGEST_EXPONENT, *(name for one in basins for name in one.means)}
    units = {n: unit_text(result.variables[n]) for n in sorted(named) if n in result.variables}
    return Basins(result, parameter, values, rows, basins, grid, entropy, units)


def _swept_axes(result: Result, name: str) -> list[str]:
    """Return the swept axis of a result with several starts, if any; raise if there are others."""
    swept = [axis for axis in result.axes if axis not in known.REPEATS]
    if {*result.axes} != {*swept, known.START} or len(swept) > 1:
        raise ConfigurationError(
            f"{name}: has the axes {', '.join(result.axes)}; basins are those of several starts "
            'over one parameter: set start.kind = "grid" or start.count, and '
            "choose a value of every other axis with --at"
        )
    return swept


def _require_own_starts(config: Configuration, name: str) -> None:
    """Raise ConfigurationError if lanes start where others have ended."""
    if config.start.carry != "none":
        raise ConfigurationError(
            f'{name}: start.carry = "{config.start.carry}": beyond the first value, lanes start '
            "where those of the value before ended, so that their shares are no basins; sweep with "
            'start.carry = "none"'
        )


def _numbered_attractors(
    recomputed: _Recomputed, at_value: Integers, config: Configuration
) -> tuple[list[Attractor | None], Integers]:
    """Return the attractor of every lane, or None, and its number along the sweep (lanes,).

    ``at_value`` (lanes,): index of the value of the swept parameter. A lane without an attractor
    has minus the code of its motion in place of a number.
    """
    result, system = recomputed.result, recomputed.system
    motion, period = (result.lanes(label) for label in known.LABELS)
    state = result.lanes("end_state")
    found, place = find_attractors(system, at_value, state, motion, period, plan_of(config))
    sizes = np.bincount(place[place >= 0], minlength=len(found))
    averages = np.array([one.averages for one in found]).reshape(-1, 2, len(system.states))
    value = np.array([at_value[one.lane] for one in found], dtype=np.intp)
    # A lane with a motion but without an orbit next to its state is unresolved, too.
    numbers = -np.maximum(motion, UNRESOLVED).astype(np.intp)
    numbers[place >= 0] = numbers_along(value, sizes, averages)[place[place >= 0]]
    return [found[n] if n >= 0 else None for n in place.tolist()], numbers


def _basin(
    recomputed: _Recomputed, members: Integers, number: int, attractor: Attractor | None
) -> Basin:
    """Describe the basin of an attractor, or of None, with the lanes ``members`` (starts,)."""
    result, system, first = recomputed.result, recomputed.system, members[0]
    motion, period = (result.lanes(label)[first] for label in known.LABELS)
    code, repeats = (motion, int(period)) if attractor else (-number, 0)
    means = _means(result, members)
    exponent = means.pop(known.LARGEST_EXPONENT, np.nan)
    multiplier = float(np.abs(attractor.multipliers[0])) if attractor else np.nan
    if multiplier > 0.0:
        exponent = float(np.log(multiplier) / (repeats * system.excitation_period[first]))
    low, high = wilson_interval(members.size, recomputed.starts).tolist()
    contact = {n: v.flags for n, v in result.variables.items() if n.startswith("contact_state_")}
    return Basin(
        value=float(recomputed.value[first]),
        number=number,
        motion=label_text(result.variables["motion"].flags[code], repeats),
        period=repeats,
        multiplier=multiplier,
        exponent=exponent,
        starts=members.size,
        share=members.size / recomputed.starts,
        share_95_percent=(low, high),
        contact={n: f[result.lanes(n)[first]] for n, f in contact.items() if attractor},
        means=means,
        section=attractor.points if attractor else np.zeros((0, len(system.states))),
    )


def _means(result: Result, members: Integers) -> dict[str, float]:
    """Return the mean over some lanes of every variable with one number per lane."""
    numeric = [v for v in result.variables.values() if v.dtype == "float64"]
    averaged = [v.name for v in numeric if v.dims == result.axes and v.name not in NO_MEANS]
    kept = {name: np.ma.masked_invalid(result.lanes(name)[members]) for name in averaged}
    return {name: float(np.ma.filled(n.mean(), np.nan)) for name, n in kept.items()}
