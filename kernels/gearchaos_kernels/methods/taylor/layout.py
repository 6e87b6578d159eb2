"""Where Taylor series are stored: rows of a block that the method uses for itself."""

from functools import cache
from typing import NamedTuple

from gearchaos_kernels.memory.rows import constants, rows_of
from gearchaos_kernels.memory.tuples import zeros_of
from gearchaos_kernels.scene import Scene, provider_of

TERMS = 24
"""Number of terms of a series after the constant one."""

REACH = 2.5
"""Length of a piece, in times in which the fastest motion turns by 1 rad.

The first term that is left out is then 2.5**25 / 25!, 6e-16 of the motion.
"""


class End(NamedTuple):
    """The gap of an element at the end of a piece.

    Attributes
    ----------
    value, slope : float
        The gap, and its slope per length of the piece.
    bend : float
        A bound on its fourth derivative along the piece, by the same length.
    """

    value: float
    slope: float
    bend: float


class SeriesRows(NamedTuple):
    """First rows of what Taylor series store of every lane.

    Attributes
    ----------
    reach : int
        Longest piece, in steps.
    angle : int
        Mesh phase of a step in rad.
    substeps : int
        Steps per step of the plan.
    done, length : int
        Where a piece begins within its step, and its length, in steps.
    crossing : int
        Number of the element that crosses at the end of a piece, or -1.
    crossings : int
        Number of crossings that have followed each other without a piece of full length.
    waves, wave_term : int
        The waves where a piece begins, and a term of their series.
    ends : int
        The `End` of each element.
    term, tangent_term : int
        A term of state and tangent vector: positions and rates alternate.
    series, tangent_series : int
        The positions of all terms, `TERMS` + 1 times the number of coordinates.
    gap, tangent_gap, stiffness : int
        A term of the gaps, also along the tangent vector, and of the stiffnesses.
    gaps, tangent_gaps, stiffnesses : int
        All terms of each.
    sums, tangent_sums : int
        Sums of the products of terms of stiffnesses and gaps, without the first and the last one.
    total : int
        Number of rows, counted from ``reach``.
    coordinates, elements, waves_in_all : int
        How many there are.
    """

    reach: int
    angle: int
    substeps: int
    done: int
    length: int
    crossing: int
    crossings: int
    waves: int
    wave_term: int
    ends: int
    term: int
    series: int
    gap: int
    gaps: int
    sums: int
    stiffness: int
    stiffnesses: int
    tangent_term: int
    tangent_series: int
    tangent_gap: int
    tangent_gaps: int
    tangent_sums: int
    total: int
    coordinates: int
    elements: int
    waves_in_all: int


@cache
def _rows_from(scene: Scene, first: int) -> SeriesRows:
    """Return the rows of the series, from a first one on."""
    model = provider_of(scene.model)
    coordinates, elements = model.states(scene.model) // 2, model.elements(scene.model)
    waves = 2 * len(model.series.orders(scene.model))
    motion = {
        "term": 2 * coordinates,
        "series": (TERMS + 1) * coordinates,
        "gap": elements,
        "gaps": TERMS * elements,
        "sums": elements,
    }
    sizes = dict.fromkeys(SeriesRows._fields[: SeriesRows._fields.index("waves")], 1)
    sizes |= {"waves": waves, "wave_term": waves, "ends": 3 * elements, **motion}
    sizes |= {"stiffness": elements, "stiffnesses": TERMS * elements}
    with_tangent = 0 if scene.tangent is None else 1
    sizes |= {f"tangent_{name}": with_tangent * size for name, size in motion.items()}
    places, at = {}, first
    for name, size in sizes.items():
        places[name] = at
        at += size
    return SeriesRows(
        **places, total=at - first, coordinates=coordinates, elements=elements, waves_in_all=waves
    )


def series_rows_of(scene: Scene) -> SeriesRows:
    """Return the rows that Taylor series use in a block."""
    return _rows_from(scene, rows_of(scene).method)


def rows_needed(scene: Scene) -> int:
    """Return the number of rows that Taylor series use in a block."""
    return _rows_from(scene, 0).total


series_rows = constants(series_rows_of)
"""`SeriesRows` of a scene, as constants of compiled code."""

no_waves = zeros_of(lambda scene: series_rows_of(scene).waves_in_all)
"""Return values of 0 for all waves, a tuple; argument: scene."""
