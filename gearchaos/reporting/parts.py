"""Figures and tables of a report: one for each slice of a result."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from itertools import islice, product
from math import prod
from typing import NamedTuple

import numpy as np

from gearchaos.errors import ConfigurationError, FileError, GearchaosError
from gearchaos.figures import (
    basins_page,
    bifurcation_page,
    map_page,
    response_page,
    shares_page,
)
from gearchaos.figures.lanes import swept_axes
from gearchaos.figures.page import Page
from gearchaos.figures.response import is_response
from gearchaos.outputs.names import (
    DIRECTION,
    LABELS,
    REPEATS,
    SECTION_POINT,
    START,
    STATUS,
    coordinate_text,
)
from gearchaos.reporting import markup
from gearchaos.results.reading.basin_units import physical_basins
from gearchaos.results.reading.ensembles import Basins, motion_shares
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.jumps import apart, jumps
from gearchaos.results.reading.listed import (
    Listed,
    list_apart,
    list_basins,
    list_jumps,
    list_shares,
    list_stages,
    unit_of_axis,
)
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import labelled_lanes, stage_table
from gearchaos.results.reading.tables import unit_text

MOST_SLICES = 6
"""Most slices of a result, or lanes of a response, that a report shows."""

MAP = "Map: kind of motion, largest Lyapunov exponent and contact at each pair of values"
DIAGRAM = (
    "Bifurcation diagram: the section of the motion at each value. {points}. A cloud is a chaotic "
    "or quasi-periodic motion. Below it, where it was computed, the largest Lyapunov exponent, "
    "which is positive where the motion is chaotic"
)
ONE_POINT = "One point means period 1, n points period n"
MORE_POINTS = "Period n has n times as many"
SHARES = "Shares of motions among all gear pairs and starts at each value, and of contact loss"
BASINS = "Basins of attraction: the attractor that each start leads to"
BASIN_SHARES = "Share of the starts that leads to each attractor"
"""Captions of figures."""

LARGEST_LOADS = "load_factor_largest", "mesh_force_largest", "force_largest"
"""Beginnings of the names of variables that are drawn and listed as loads."""

Pages = Iterator[tuple[str, Callable[[], Page]]]
"""Captions of figures, and the functions that draw them."""


class Parts(NamedTuple):
    """Figures and tables as HTML, and how many slices were left out."""

    figures: list[str]
    tables: list[str]
    left_out: int


def parts_of(computed: Result, shown: Result, name: str) -> Parts:
    """Draw and list a result.

    ``computed``: the result of the file; ``shown``: the same in the units of the report; ``name``:
    its name in messages.
    """
    if is_response(shown):
        return _response_parts(shown)
    axes = _split_axes(computed)
    parts = Parts([], [], max(0, prod(computed[axis].size for axis in axes) - MOST_SLICES))
    if words := excitation_of(computed.metadata).in_words:
        parts.tables.append(markup.paragraph(f"{words[0].upper()}{words[1:]}."))
    for numbers in islice(product(*(range(computed[axis].size) for axis in axes)), MOST_SLICES):
        # The values of an axis may have another unit in the report.
        one, of_file = (
            of.sel(
                None, **{axis: of[axis][n].item() for axis, n in zip(axes, numbers, strict=True)}
            )
            for of in (shown, computed)
        )
        found = _basins(of_file, name)
        if found is not None and shown is not computed:
            found = physical_basins(found)
        where = f", {one.where}" if one.fixed else ""
        parts.figures.extend(_drawn(_pages(one, found), where))
        for caption, listed in _tables(one, found):
            if listed.rows:
                parts.tables.append(markup.table(f"{caption}{where}", *listed))
    return parts


def _response_parts(result: Result) -> Parts:
    """Draw the lanes of a response that did not diverge."""
    lanes = np.flatnonzero(result.lanes(STATUS) == 0).tolist()
    pages = []
    for lane in lanes[:MOST_SLICES]:
        place = result.fixed | {axis: result.along(axis)[lane] for axis in result.axes}
        words = ", ".join(f"{axis} = {coordinate_text(axis, at)}" for axis, at in place.items())
        pages.append((f"Motion at {words}", partial(response_page, result, lane)))
    return Parts(_drawn(iter(pages), ""), [], max(0, len(lanes) - MOST_SLICES))


def _drawn(pages: Pages, where: str) -> list[str]:
    """Return figures with captions; instead of one that cannot be drawn, the reason."""
    drawn = []
    for caption, draw in pages:
        try:
            drawn.append(markup.picture_of(draw(), f"{caption}{where}"))
        except GearchaosError as error:
            drawn.append(markup.paragraph(f"{caption}{where}: not drawn, {error}"))
    return drawn


def _split_axes(result: Result) -> list[str]:
    """Return the axes along which each value has figures of its own."""
    swept, repeats = swept_axes(result), [axis for axis in result.axes if axis in REPEATS]
    split = swept[:-1] if repeats else swept[:-2]
    both = DIRECTION in result.axes and (repeats or len(swept) > 1)
    return [*split, DIRECTION] if both else split


def _basins(result: Result, name: str) -> Basins | None:
    """Find the basins of a slice with several starts; None where there are none to find."""
    if START not in result.axes or {*REPEATS} <= {*result.axes} or LABELS[0] not in result:
        return None
    # Without starts a report needs no compiler, which takes long to import.
    from gearchaos.engine.basins import find_basins
    from gearchaos.engine.running import compiling

    with suppress(ConfigurationError, FileError), compiling():
        return find_basins(result, name)
    return None


def _pages(one: Result, found: Basins | None) -> Pages:
    """Yield the figures of a slice: map, basins, shares, diagram."""
    if len(swept_axes(one)) > 1:
        yield MAP, partial(map_page, one)
        for name in _largest_loads(one):
            yield f"Map: {one.variables[name].long_name}", partial(map_page, one, name)
        return
    several = any(axis in REPEATS for axis in one.axes)
    if found is not None and (len(found.grid) == 2 or found.values.size > 1):
        caption = BASIN_SHARES if found.values.size > 1 else BASINS
        yield caption, partial(basins_page, found)
    if several and LABELS[0] in one and one[one.axis].size > 1:
        yield SHARES, partial(shares_page, one)
    if one[one.axis].size > 1 or not several:
        stages = LABELS[0] in one and DIRECTION not in one.axes
        yield _diagram_caption(one), partial(bifurcation_page, one, stages=stages)
        for name in _largest_loads(one):
            wording = one.variables[name].long_name
            yield f"{wording[0].upper()}{wording[1:]}", partial(bifurcation_page, one, name)


def _diagram_caption(one: Result) -> str:
    """Return the caption of a bifurcation diagram."""
    shown = one[SECTION_POINT].size if SECTION_POINT in one else 1
    words = excitation_of(one.metadata).points_in_words(shown).replace("\n", " ")
    points = f"{words[:1].upper()}{words[1:]}. {MORE_POINTS}" if words else ONE_POINT
    return DIAGRAM.format(points=points)


def _largest_loads(one: Result) -> list[str]:
    """Return the variables of the largest loads that a slice holds."""
    return [name for name in one.variables if name.startswith(LARGEST_LOADS)]


def _load_table(one: Result) -> Listed:
    """List each of the largest loads: its largest value, and where it lies."""
    axes = swept_axes(one)
    headings = ["quantity", "unit", "largest [unit]"]
    headings += [f"at {name} [{unit_of_axis(one, name)}]" for name in axes]
    rows = []
    for name in _largest_loads(one):
        variable, values = one.variables[name], one.lanes(name)
        if np.isfinite(values).any():
            lane = int(np.nanargmax(values))
            places = [float(one.along(axis)[lane]) for axis in axes]
            rows.append([variable.long_name, unit_text(variable), float(values[lane]), *places])
    return Listed(headings, rows)


def _tables(one: Result, found: Basins | None) -> Iterator[tuple[str, Listed]]:
    """Yield captions and tables of a slice: loads, stages, jumps, directions, shares, basins."""
    yield "Largest loads", _load_table(one)
    if LABELS[0] not in one or len(swept_axes(one)) > 1:
        return
    several = any(axis in REPEATS for axis in one.axes)
    if DIRECTION in one.axes:
        for way in one[DIRECTION].tolist():
            yield from _stage_tables(one.sel(None, direction=way), several)
        yield "Intervals where the directions differ", list_apart(one, apart(one))
    else:
        yield from _stage_tables(one, several)
    if several:
        yield "Shares of motions", list_shares(one, motion_shares(one))
    if found is not None:
        yield "Basins of attraction", list_basins(found)


def _stage_tables(one: Result, several: bool) -> Iterator[tuple[str, Listed]]:
    """Yield captions and tables of the stages and jumps of a slice in one direction."""
    way = f", {coordinate_text(DIRECTION, one.fixed[DIRECTION])}" if DIRECTION in one.fixed else ""
    yield (
        f"Stages over {one.axis}{way}",
        list_stages(one, stage_table(labelled_lanes(one, repeats=True))),
    )
    if not several:
        yield f"Jumps to another motion{way}", list_jumps(one, jumps(one))
