"""Ensembles of gear pairs and starts: the shares of their motions, and their basins."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Counts, Floats, Integers
from gearchaos.errors import ConfigurationError
from gearchaos.outputs.names import CROSSINGS, REPEATS
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import label_text, require_labels

BOX = 5  # Starts along each side of a box of which `basin_entropy` asks how mixed it is.


class Counted(NamedTuple):
    """How many lanes of each value have a property: ``counts`` of ``lanes``, both (values,)."""

    counts: Integers
    lanes: Integers

    @property
    def shares(self) -> Floats:
        """Shares (values,), not a number where there is no lane."""
        return self.counts / np.where(self.lanes > 0, self.lanes, np.nan)

    @property
    def intervals(self) -> Floats:
        """Their confidence intervals of 95 %, see `wilson_interval`, (values, 2)."""
        return wilson_interval(self.counts, self.lanes)


class Shares(NamedTuple):
    """Motions over one swept parameter, all gear pairs and starts of a value taken together.

    ``values`` (values,) of the parameter; ``motions``: such as "period 2" or "chaotic", the columns
    of ``counts`` (values, motions); ``other``: lanes that do not move with period 1, those diverged
    or unresolved among them; ``apart``: lanes whose teeth lose contact, of those that did not
    diverge, None where the result does not tell.
    """

    values: Floats
    motions: tuple[str, ...]
    counts: Integers
    other: Counted
    apart: Counted | None


def motion_kinds(result: Result) -> tuple[Counts, list[str]]:
    """Number the kinds of motion: period 1, 2, 3, 4 or more, then those without a period.

    Returns the number of each lane's kind, of the shape of the axes, and the names of 0, 1, ...
    Raises FileError if the result has no labels.
    """
    require_labels(result)
    names = ["period 1", "period 2", "period 3", "period 4 or more"]
    period, motion = result["period"], result["motion"].astype(np.int32)
    kinds = np.where(period > 0, np.minimum(period, len(names)) - 1, len(names) + motion)
    return kinds, names + [label_text(flag, 0) for flag in result.variables["motion"].flags]


def motion_shares(result: Result) -> Shares:
    """Count the motions of each value of the one swept parameter of a result.

    Raises FileError if it has no labels, ConfigurationError if it has not one swept parameter, or
    neither several gear pairs nor several starts.
    """
    kinds, names = motion_kinds(result)
    if len(result.axes) < 2 or sum(axis not in REPEATS for axis in result.axes) != 1:
        raise ConfigurationError(
            "shares are those of gear pairs or starts over one swept parameter, and the result has "
            f"the axes {', '.join(result.axes)}; fix others with --at NAME=VALUE (in Python: "
            "result.sel), or set pitch_error.realisations or start.count"
        )
    values = np.asarray(result[result.axis], dtype=np.float64)
    kinds = kinds.reshape(values.size, -1)
    found = {name: np.sum(kinds == number, axis=1) for number, name in enumerate(names)}
    seen = {name: counts for name, counts in found.items() if counts.any()}
    lanes = np.full(values.size, kinds.shape[1])
    other, apart = Counted(lanes - found[names[0]], lanes), None
    if CROSSINGS in result:
        crossings = result[CROSSINGS].reshape(kinds.shape)
        apart = Counted(np.sum(crossings > 0.0, axis=1), np.sum(np.isfinite(crossings), axis=1))
    return Shares(values, tuple(seen), np.stack([*seen.values()], axis=1), other, apart)


class Basin(NamedTuple):
    """The starts that lead to one attractor at one value of the parameter, or to none.

    ``number`` of the attractor, the same at all values, minus the code of the motion where there is
    none; ``motion``: such as "period 2", "chaotic" or "diverged"; ``multiplier``: largest modulus
    of the Floquet multipliers, not a number where the motion is not periodic; ``exponent``: largest
    Lyapunov exponent, that of the orbit or a mean over the starts; ``starts``: how many, with their
    share and its confidence interval; ``contact``: the kind of contact on the attractor, that of
    the first of them, by variable; ``means`` of other variables of the result over all of them;
    ``section`` (points, states): points of the attractor, once an excitation period.
    """

    value: float
    number: int
    motion: str
    period: int
    multiplier: float
    exponent: float
    starts: int
    share: float
    share_95_percent: tuple[float, float]
    contact: dict[str, str]
    means: dict[str, float]
    section: Floats


class Basins(NamedTuple):
    """All basins of a result.

    ``parameter``: name of the axis of the ``values`` (values,); ``numbers`` (values, starts) of the
    basin that each start is in; ``grid``: start values by state where the starts are a grid, in C
    order; ``entropy`` of every value, see `basin_entropy`, none without a grid.
    """

    result: Result
    parameter: str
    values: Floats
    numbers: Integers
    basins: list[Basin]
    grid: dict[str, Floats]
    entropy: list[tuple[float, float]]


def in_order(numbers: Iterable[int]) -> list[int]:
    """Sort the numbers of basins, each once: those without an attractor come last."""
    return sorted({*numbers}, key=lambda number: (number < 0, abs(number)))


def basin_entropy(attractors: NDArray[np.integer], box: int = BOX) -> tuple[float, float]:
    r"""Return the basin entropy of starts on a grid, and that of the boundary of basins alone.

    The grid is cut into boxes with ``box`` starts along each side; in each, with p_ij the share of
    starts that lead to attractor j::

        S_i = -sum_j p_ij ln p_ij,   S_b = sum_i S_i / N,   S_bb = sum_i S_i / N_b

    over all N boxes, and over those N_b that hold several attractors (0 where none does). What is
    left of the grid beyond whole boxes does not count. ``attractors``: a number for each start, of
    one dimension or several; not a number where the grid holds no box. (Daza, Wagemakers, Georgeot,
    Guery-Odelin, Sanjuan 2016.)
    """
    whole = attractors[tuple(slice(size // box * box) for size in attractors.shape)]
    if not whole.size:
        return np.nan, np.nan
    cut = whole.reshape([part for size in whole.shape for part in (size // box, box)])
    within = tuple(range(1, cut.ndim, 2))
    share = np.stack([np.mean(cut == one, axis=within) for one in np.unique(whole)])
    entropy = -np.sum(share * np.log(np.where(share > 0.0, share, 1.0)), axis=0)
    return float(entropy.mean()), float(entropy.sum() / max(1, np.count_nonzero(entropy)))
