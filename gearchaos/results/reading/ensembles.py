"""Ensembles of gear pairs and starts: the shares of their motions, and their basins."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Counts, Floats, Integers
from gearchaos.errors import ConfigurationError
from gearchaos.outputs.names import CROSSINGS, REPEATS
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import label_text, require_labels

IMPACTS = "impacts_driving_", "impacts_back_"
"""Beginnings of names of impacts per mesh period; the name of an element follows."""
TIME_APART = "time_apart_"
TEETH_APART = "time_apart_tangential"
"""The time for which the teeth of a gear pair are apart."""
BOX = 5  # Starts along each side of a box of `basin_entropy`.


class Counted(NamedTuple):
    """Lanes of each value that have a property: ``counts`` out of ``lanes``, both (values,)."""

    counts: Integers
    lanes: Integers

    @property
    def shares(self) -> Floats:
        """Shares (values,), NaN where there is no lane."""
        return self.counts / np.where(self.lanes > 0, self.lanes, np.nan)

    @property
    def intervals(self) -> Floats:
        """Confidence intervals of 95 % of the shares (values, 2), see `wilson_interval`."""
        return wilson_interval(self.counts, self.lanes)


class MotionShares(NamedTuple):
    """Motions over one swept parameter; all drawn systems and starts of a value are counted.

    Attributes
    ----------
    values : array, shape (values,)
        Values of the parameter.
    motions : tuple of str
        Kinds of motion, such as "period 2" or "chaotic".
    counts : array of int, shape (values, motions)
        Number of lanes of each kind.
    other : Counted
        Lanes that do not have period 1, including diverged and unresolved ones.
    apart : Counted or None
        Lanes that lose contact, out of those that did not diverge. None if the result has neither
        times apart (`outputs.contact`) nor crossings of clearances, which count without them.
    """

    values: Floats
    motions: tuple[str, ...]
    counts: Integers
    other: Counted
    apart: Counted | None


def motion_kinds(result: Result) -> tuple[Counts, list[str]]:
    """Number the kinds of motion: period 1, 2, 3, 4 or more, then motions without a period.

    Returns the number of the kind of each lane, of the shape of the axes, and the names of the
    kinds 0, 1, ... Raises FileError if the result has no labels.
    """
    require_labels(result)
    names = ["period 1", "period 2", "period 3", "period 4 or more"]
    period, motion = result["period"], result["motion"].astype(np.int32)
    kinds = np.where(period > 0, np.minimum(period, len(names)) - 1, len(names) + motion)
    return kinds, names + [label_text(flag, 0) for flag in result.variables["motion"].flags]


def motion_shares(result: Result) -> MotionShares:
    """Count the motions at each value of the swept parameter of a result.

    Parameters
    ----------
    result : Result
        A result with labels, one swept parameter, and several drawn systems or starts.

    Returns
    -------
    MotionShares

    Raises
    ------
    FileError
        If the result has no labels.
    ConfigurationError
        If it has other axes.

    Examples
    --------
    >>> from gearchaos.results.reading.ensembles import motion_shares
    >>> counted = motion_shares(gearchaos.open_result("starts.h5"))
    >>> counted.counts.shape[0], counted.other.intervals.shape
    (2, (2, 2))
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
    sizes = _sizes_of_loss(result)
    if sizes:
        lost = np.max([result[name].reshape(kinds.shape) for name in sizes], axis=0)
        apart = Counted(np.sum(lost > 0.0, axis=1), np.sum(np.isfinite(lost), axis=1))
    return MotionShares(values, tuple(seen), np.stack([*seen.values()], axis=1), other, apart)


def _sizes_of_loss(result: Result) -> list[str]:
    """Return the names of variables: some value is positive where a lane loses contact.

    They are times apart and impacts: of the teeth of a gear pair, which its axial clearance does
    not part, or of all elements of a machine. A fast motion may be apart for a time that rounds to
    0. Without them, crossings of any clearance count.
    """
    if TEETH_APART in result:
        element = TEETH_APART.removeprefix(TIME_APART)
        sizes = [TEETH_APART, *(f"{side}{element}" for side in IMPACTS)]
    else:
        sizes = [name for name in result if name.startswith((TIME_APART, *IMPACTS))]
    return [name for name in sizes if name in result] or [CROSSINGS] * (CROSSINGS in result)


class Basin(NamedTuple):
    """The starts that lead to one attractor at one value of the parameter, or to none.

    Attributes
    ----------
    value : float
        Value of the parameter.
    number : int
        Number of the attractor, the same at all values. Where the starts lead to no attractor,
        minus the code of the motion.
    motion : str
        Label such as "period 2", "chaotic" or "diverged".
    period : int
        Period in periods of the excitation, 0 where the motion is not periodic.
    multiplier : float
        Largest modulus of the Floquet multipliers, NaN where the motion is not periodic.
    exponent : float
        Largest Lyapunov exponent: that of the orbit, or the mean over the starts.
    starts : int
        Number of starts.
    share : float
        Share of all starts at this value.
    share_95_percent : tuple of float
        Confidence interval of the share.
    contact : dict of str to str
        Kind of contact of the first start, by variable.
    means : dict of str to float
        Means of other variables of the result over the starts.
    section : array, shape (points, states)
        Points of the attractor, one per excitation period.
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

    Attributes
    ----------
    result : Result
        The result that the basins are found in.
    parameter : str
        Name of the axis of the values.
    values : array, shape (values,)
        Values of the parameter.
    numbers : array of int, shape (values, starts)
        Number of the basin of each start.
    basins : list of Basin
        All basins of all values.
    grid : dict of str to array
        Start values along the grid by state, in C order; empty if the starts are no grid.
    entropy : list of tuple
        `basin_entropy` at each value; empty if the starts are no grid.
    units : mapping of str to str
        Units of exponents and means by name, of physical basins also those of states.
    """

    result: Result
    parameter: str
    values: Floats
    numbers: Integers
    basins: list[Basin]
    grid: dict[str, Floats]
    entropy: list[tuple[float, float]]
    units: Mapping[str, str] = MappingProxyType({})


def in_order(numbers: Iterable[int]) -> list[int]:
    """Sort distinct numbers of basins; those without an attractor come last."""
    return sorted({*numbers}, key=lambda number: (number < 0, abs(number)))


def basin_entropy(attractors: NDArray[np.integer], box: int = BOX) -> tuple[float, float]:
    r"""Return the basin entropy of starts on a grid, and the entropy of the basin boundary.

    Parameters
    ----------
    attractors : array of int
        Number of the attractor of each start, over one dimension or several.
    box : int
        Starts along each side of a box.

    Returns
    -------
    tuple of float
        S_b and S_bb; both are NaN if the grid is smaller than a box.

    Notes
    -----
    The grid is cut into N boxes; starts beyond the last whole box are left out. With p_ij the share
    of starts in box i that lead to attractor j (Daza, Wagemakers, Georgeot, Guery-Odelin, Sanjuan
    2016)::

        S_i = -sum_j p_ij ln p_ij,   S_b = sum_i S_i / N,   S_bb = sum_i S_i / N_b

    N_b is the number of boxes that hold several attractors; S_bb is 0 where there are none.
    """
    whole = attractors[tuple(slice(size // box * box) for size in attractors.shape)]
    if not whole.size:
        return np.nan, np.nan
    cut = whole.reshape([part for size in whole.shape for part in (size // box, box)])
    within = tuple(range(1, cut.ndim, 2))
    share = np.stack([np.mean(cut == one, axis=within) for one in np.unique(whole)])
    entropy = -np.sum(share * np.log(np.where(share > 0.0, share, 1.0)), axis=0)
    return float(entropy.mean()), float(entropy.sum() / max(1, np.count_nonzero(entropy)))
