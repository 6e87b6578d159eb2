"""The boundaries of a map over two parameters, found more exactly than its lanes lie."""

from itertools import starmap
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from gearchaos.configuration import Configuration
from gearchaos.engine.lanes import Lanes, Numbers
from gearchaos.engine.refinement import Boundary, Floats, bisect
from gearchaos.engine.running import choose_threads
from gearchaos.engine.simulation import Simulation
from gearchaos.results.result import Result
from gearchaos.results.stage_table import label_text
from gearchaos.results.variables import LABELS


class _Places(Lanes):
    """Lanes at single places of a map, (lanes, 2): second parameter and first one."""

    places: Floats

    def __len__(self) -> int:
        return len(self.places)

    def values_of(self, lanes: Numbers) -> dict[str, Floats]:
        return dict(zip(self._of_systems, self.places[lanes].T, strict=True))


def refined_map(
    config: Configuration, result: Result, width: float, threads: int | None = None
) -> tuple[dict[float, list[Boundary]], int]:
    """Bisect the boundaries in all rows of a map, without a look at orbits.

    Returns those of each value of the second parameter that has any, and the number of lanes that
    this takes. ``config`` is from `refinable`, the axes of the result are its two sweeps.
    """
    choose_threads(threads)
    simulation, flags = Simulation(config), result.variables["motion"].flags
    simulation.lanes = lanes = _Places(config)
    computed = 0

    def edges(values: Floats, motion: NDArray[Any], period: NDArray[Any]) -> NDArray[Any]:
        kinds = zip(motion.ravel().tolist(), period.ravel().tolist(), strict=True)
        found = np.empty(period.size, [("value", "f8"), ("label", object)])
        found["value"], found["label"] = values, [label_text(flags[m], n) for m, n in kinds]
        return found

    def between(middle: Floats, numbers: Numbers) -> NDArray[Any]:
        nonlocal computed
        computed += middle.size
        lanes.places = np.stack([second[numbers], middle], axis=1)
        blocks = simulation.blocks(simulation.block_lanes(numba.get_num_threads()))
        found = [[part[name] for name in LABELS] for part in starmap(simulation.compute, blocks)]
        return edges(middle, *map(np.concatenate, zip(*found, strict=True)))

    whole = edges(result.along(result.axis), *(result[name] for name in LABELS))
    whole = whole.reshape(result["period"].shape)
    rows, columns = np.nonzero(whole["label"][:, 1:] != whole["label"][:, :-1])
    second, below, above = (
        result[result.axes[0]][rows],
        whole[rows, columns],
        whole[rows, columns + 1],
    )
    bisect(below, above, width, between)
    refined: dict[float, list[Boundary]] = {}
    for row, one, other in zip(second.tolist(), below, above, strict=True):
        ends = float(one["value"]), float(other["value"]), one["label"], other["label"]
        refined.setdefault(row, []).append(Boundary(*ends, "", complex("nan")))
    return refined, computed
