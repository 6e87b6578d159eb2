"""Shares of the gear pairs and starts of each swept value that move in the same way."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.result import Result
from gearchaos.results.stage_table import label_text
from gearchaos.results.variables import CROSSINGS, LABELS, REPEATS

Floats = NDArray[np.float64]


class Counted(NamedTuple):
    """How many lanes of each value have a property: ``counts`` of ``lanes``, both (values,)."""

    counts: NDArray[np.intp]
    lanes: NDArray[np.intp]

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
    counts: NDArray[np.intp]
    other: Counted
    apart: Counted | None


def motion_kinds(result: Result) -> tuple[NDArray[np.int32], list[str]]:
    """Number the kinds of motion: period 1, 2, 3, 4 or more, then those without a period.

    Returns the number of each lane's kind, of the shape of the axes, and the names of 0, 1, ...
    Raises FileError if the result has no labels.
    """
    if not all(name in result for name in LABELS):
        raise FileError(
            "the result has no labels of the motion; run the sweep with outputs.motion = true"
        )
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

    def rows(name: str) -> NDArray[Any]:
        return result[name].reshape(values.size, -1)

    kinds = kinds.reshape(values.size, -1)
    found = {name: np.sum(kinds == number, axis=1) for number, name in enumerate(names)}
    seen = {name: counts for name, counts in found.items() if counts.any()}
    lanes = np.full(values.size, kinds.shape[1])
    other, apart = Counted(lanes - found[names[0]], lanes), None
    if CROSSINGS in result:
        crossings = rows(CROSSINGS)
        apart = Counted(np.sum(crossings > 0.0, axis=1), np.sum(np.isfinite(crossings), axis=1))
    return Shares(values, tuple(seen), np.stack([*seen.values()], axis=1), other, apart)
