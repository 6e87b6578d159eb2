"""List the stages of a sweep: intervals of the swept parameter in which the motion keeps its label.

--refine bisects every boundary between two stages. It computes lanes again, with the configuration
in the file, and reports how the orbit next to the boundary is lost. For a sweep in both directions
it follows the orbits to the values where each direction jumps. For two parameters without --at it
refines the boundaries along the first one in every row, including those that only a neighbouring
row shows.

The table goes to stdout, everything else to stderr.
"""

import json
import math
import textwrap
from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.options import (
    AsCsv,
    Option,
    Place,
    ResultFile,
    Threads,
    one_format,
    placed_coordinates,
)
from gearchaos.progress import count_of

if TYPE_CHECKING:
    from gearchaos.engine.recomputing import Survival
    from gearchaos.engine.refinement import Boundary
    from gearchaos.results.reading.contact_stretches import ContactStretch
    from gearchaos.results.reading.jumps import Apart, Crisis, Jump
    from gearchaos.results.reading.opinions import Opinions
    from gearchaos.results.reading.result import Result
    from gearchaos.results.reading.stage_table import Stage


WIDTH = 80  # Columns of a terminal.

MOST_STRETCHES = 12
"""Most stretches of contact that the table lists for a clearance."""


class StagesOptions(NamedTuple):
    """Options of ``gearchaos stages``."""

    result: ResultFile
    refine: Annotated[
        float | None,
        Option(
            "bisect every boundary between two stages to this width; of a sweep in both "
            "directions, only the jumps, as closely as the orbits reach",
            "WIDTH",
            low=1e-12,
        ),
    ] = None
    at: Annotated[
        tuple[Place, ...],
        Option(
            "use the nearest value of this axis; may be repeated (default: the first value of a "
            "second parameter, all starts and gear pairs)",
            "NAME=VALUE",
        ),
    ] = ()
    survival: Annotated[
        int | None,
        Option(
            "continue up to 25 chaotic lanes for this number of records, and report the share that "
            "is still chaotic",
            "RECORDS",
            low=1,
            high=1000,
        ),
    ] = None
    zero_one: Annotated[
        bool,
        Option("also apply the 0-1 test for chaos to the sections, and compare it with labels"),
    ] = False
    json: Annotated[bool, Option("print JSON instead of a table")] = False
    csv: AsCsv = False
    threads: Threads = None


class Listing(NamedTuple):
    """The stages of a sweep along one axis, and what else the command reports of them.

    ``result``: the sweep along this axis, with any pairs and starts; ``where``: values of the fixed
    axes; ``apart``: intervals where the two directions differ, None for a sweep in one direction;
    ``boundaries``, ``survival`` and ``opinions``, the values of the 0-1 test: None if they were not
    requested.
    """

    result: "Result"
    where: dict[str, float]
    stages: "list[Stage]"
    apart: "list[Apart] | None"
    boundaries: "list[Boundary] | None"
    jumps: "list[Jump]"
    crises: "list[Crisis]"
    contact: "list[ContactStretch]"
    survival: "Survival | None"
    opinions: "Opinions | None"


def _stages(options: StagesOptions) -> None:
    from gearchaos.outputs.names import DIRECTION, REPEATS, UNSWEPT
    from gearchaos.results.reading.listed import list_stages
    from gearchaos.results.reading.overview import json_values
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.stage_table import one_axis, require_labels
    from gearchaos.results.reading.tables import csv_text

    one_format(options.json, options.csv)
    whole = open_result(options.result)
    # Lanes are computed again for one pair and one start.
    kept = REPEATS if options.refine is None and options.survival is None else ()
    places = placed_coordinates(options.at, whole.axes, whole.axis)
    part = one_axis(whole, (*kept, DIRECTION), **places)
    require_labels(whole, options.result)
    if options.refine is not None and not options.at and {*whole.axes} - {whole.axis, *UNSWEPT}:
        _map_boundaries(whole, options, options.refine)
        return
    listing = _listing(whole, part, kept, options)
    if options.json:
        print(json.dumps(json_values(_facts(listing)), indent=1))
    elif options.csv:
        print(csv_text(*list_stages(listing.result, listing.stages)))
    else:
        print(_text(listing))


def _listing(
    whole: "Result", part: "Result", kept: Sequence[str], options: StagesOptions
) -> Listing:
    """List the stages of a slice, and compute what --refine and --survival request.

    ``part`` is the slice of the whole result, in all directions; ``kept`` are the axes beside the
    swept parameter.
    """
    from gearchaos.outputs.names import DIRECTION, REPEATS
    from gearchaos.results.reading.contact_stretches import contact_stretches
    from gearchaos.results.reading.jumps import apart, crises, jumps
    from gearchaos.results.reading.opinions import second_opinions
    from gearchaos.results.reading.stage_table import (
        labelled_lanes,
        one_axis,
        slice_facts,
        stage_table,
    )

    result, both = one_axis(part, kept), DIRECTION in part.axes
    stages = stage_table(labelled_lanes(result, name=options.result, repeats=True))
    stretches = apart(part)
    boundaries, outlasting = _computed_again(part, result, stages, stretches, options)
    for at, boundary in enumerate([] if both else boundaries or []):
        stages[at] = stages[at]._replace(end=boundary.below)
        # Between the lanes may lie a stage that none of them is in.
        if boundary.label_above == stages[at + 1].label:
            stages[at + 1] = stages[at + 1]._replace(start=boundary.above)
    several = any(axis in REPEATS for axis in result.axes)
    return Listing(
        result,
        slice_facts(whole, result),
        stages,
        stretches if both else None,
        boundaries,
        [] if several else jumps(result),
        [] if several else crises(result),
        [] if several else contact_stretches(result),
        outlasting,
        second_opinions(result, options.result) if options.zero_one else None,
    )


def _facts(listing: Listing) -> dict[str, Any]:
    """Return what --json prints."""
    from gearchaos.results.reading.listed import unit_of_axis

    return {
        "parameter": listing.result.axis,
        "unit": unit_of_axis(listing.result, listing.result.axis),
        "slice": listing.where,
        "stages": listing.stages,
        **({} if listing.apart is None else {"directions_apart": listing.apart}),
        **({} if listing.boundaries is None else {"boundaries": listing.boundaries}),
        "jumps": listing.jumps,
        "crises": listing.crises,
        **({"contact": listing.contact} if listing.contact else {}),
        "survival": listing.survival,
        **({} if listing.opinions is None else {"zero_one": listing.opinions.facts()}),
    }


def _text(listing: Listing) -> str:
    """Return the table of the stages, then remarks, then boundaries."""
    from gearchaos.outputs.names import RECORD, REPEATS
    from gearchaos.results.reading.excitation import excitation_of
    from gearchaos.results.reading.listed import unit_of_axis
    from gearchaos.results.reading.overview import slice_lines

    result = listing.result
    head = [
        f"all {result[axis].size} values of {axis}; --at {axis}=VALUE chooses one"
        for axis in result.axes
        if axis in REPEATS
    ]
    head += [*slice_lines(listing.where), excitation_of(result.metadata).in_words]
    mixed = int((result[RECORD] == 1).sum()) if RECORD in result else 0
    unit = unit_of_axis(result, result.axis)
    unit = "" if unit == "1" else f" {unit}"
    below = [*band_lines(listing.stages), *remarks(listing.jumps, listing.crises, mixed, unit)]
    below += directions_apart(listing.apart or ())
    below += contact_lines(listing.contact)
    below += [listing.survival.text] if listing.survival else []
    below += listing.opinions.lines() if listing.opinions else []
    axis = f"{result.axis} [{unit.strip()}]" if unit else result.axis
    first = table(axis, listing.stages, [*filter(None, head)])
    parts = map("\n".join, (first, below, boundary_list(listing.boundaries or ())))
    return "\n\n".join(filter(None, parts))


def _map_boundaries(result: "Result", options: StagesOptions, width: float) -> None:
    """Print the boundaries in all rows of a map, and how many lanes that took."""
    from gearchaos.engine.recomputing import refinable
    from gearchaos.engine.refinement import refined_map
    from gearchaos.engine.running import choose_threads, compiling
    from gearchaos.results.reading.overview import json_values

    choose_threads(options.threads)
    config = refinable(result, options.result)
    if len(result.axes) > 2 or options.survival is not None:
        raise ConfigurationError(
            f"--refine: {options.result} runs over {', '.join(result.axes)}; without --at only two "
            "swept parameters can be refined, and without --survival: choose a slice with --at "
            "NAME=VALUE"
        )
    with compiling():
        rows, lanes = refined_map(config, result, width)
    second, first = result.axes
    reach = float(result[first][-1] - result[first][0])
    fine = result[second].size * (math.ceil(reach / width) + 1)
    if options.json:
        facts = {
            "parameter": first,
            "second_parameter": second,
            "rows": [{"value": at, "boundaries": found} for at, found in rows.items()],
            "lanes": lanes,
            "lanes_of_a_map_as_fine": fine,
        }
        print(json.dumps(json_values(facts), indent=1))
        return
    for value, found in rows.items():
        print(f"{second} = {value:.6g}", *boundary_list(found), sep="\n")
    print(f"{lanes} lanes were computed; a map as fine everywhere would have {fine}")


def _computed_again(
    part: "Result",
    result: "Result",
    stages: "list[Stage]",
    stretches: "list[Apart]",
    options: StagesOptions,
) -> "tuple[list[Boundary] | None, Survival | None]":
    """Compute the boundaries for --refine and the survival for --survival, None without them."""
    if options.refine is None and options.survival is None:
        # Without them the command needs no compiler, which takes long to import.
        return None, None
    from gearchaos.engine.recomputing import computable, refinable, survival
    from gearchaos.engine.refinement import refined_boundaries, refined_jumps
    from gearchaos.engine.running import choose_threads, compiling
    from gearchaos.outputs.names import DIRECTION

    choose_threads(options.threads)
    boundaries = outlasting = None
    name, width = options.result, options.refine
    with compiling():
        if width is not None and DIRECTION in part.axes:
            boundaries = refined_jumps(computable(part, name), part, stretches, width)
        elif width is not None:
            boundaries = refined_boundaries(refinable(part, name), part, stages, width)
        if options.survival is not None:
            outlasting = survival(computable(result, name), result, options.survival)
    return boundaries, outlasting


def table(axis: str, stages: "Sequence[Stage]", where: Sequence[str]) -> Iterator[str]:
    """Return the stages of a slice as lines of a table, each of at most 80 characters."""
    yield f"stages over {axis}"
    yield from where
    yield f"{'from':>10}  {'to':>10}  {'motion':15}{'lanes':>6}  {'exponent':>20}"
    for stage in stages:
        exponent = f"{stage.lowest_exponent:.4f} to {stage.highest_exponent:.4f}"
        yield (
            f"{stage.start:10.6g}  {stage.end:10.6g}  {stage.label:15}{stage.lanes:6d}"
            f"  {'' if math.isnan(stage.lowest_exponent) else exponent:>20}".rstrip()
        )


def band_lines(stages: "Sequence[Stage]") -> Iterator[str]:
    """Return a line for each stage with sections on several bands."""
    for stage in stages:
        several = [f"{lanes} on {bands}" for bands, lanes in stage.bands.items() if bands > 1]
        if several:
            counted = sum(stage.bands.values())
            line = f"of {counted} {stage.label} lanes {', '.join(several)} bands"
            if len(stage.bands) == 1:
                line = f"all {counted} {stage.label} lanes on {max(stage.bands)} bands"
            if counted == 1:
                line = f"the only {stage.label} lane is on {max(stage.bands)} bands"
            yield from textwrap.wrap(f"{stage.start:.6g} to {stage.end:.6g}: {line}", WIDTH)


def remarks(
    jumping: "Sequence[Jump]", bursting: "Sequence[Crisis]", mixed: int, unit: str = ""
) -> Iterator[str]:
    """Return lines for what the table omits: jumps, crises, and records with two motions.

    ``unit``: that of the swept parameter, after a space, or nothing.
    """
    for jump in jumping:
        yield f"{jump.below:.6g} to {jump.above:.6g}{unit}: jumps to another motion of {jump.label}"
    for crisis in bursting:
        yield f"{crisis.below:.6g} to {crisis.above:.6g}{unit}: crisis, {crisis.section} spans"
        below = f"{crisis.lowest_below:.3g} to {crisis.highest_below:.3g} below"
        yield f"{below}, {crisis.lowest_above:.3g} to {crisis.highest_above:.3g} above"
    if mixed:
        lanes = f"{count_of(mixed, 'periodic lane')} settled within the record, which begins with"
        yield f"{lanes} another"
        yield "motion; raise integration.transient_periods to leave it out"


def contact_lines(stretches: "Sequence[ContactStretch]") -> Iterator[str]:
    """Return lines for the kinds of contact of every clearance over the swept values."""
    for element, some in groupby(stretches, attrgetter("element")):
        all_of = [*some]
        texts = [f"{one.contact} {_range(one.start, one.end)}" for one in all_of[:MOST_STRETCHES]]
        if len(all_of) > MOST_STRETCHES:
            texts += [f"{len(all_of) - MOST_STRETCHES} more (--json lists all)"]
        yield from textwrap.wrap(f"contact, {element}: {'; '.join(texts)}", WIDTH)


def _range(start: float, end: float) -> str:
    """Return a stretch of values as text."""
    return f"{start:.6g} to {end:.6g}" if start < end else f"at {start:.6g}"


def directions_apart(stretches: "Sequence[Apart]") -> Iterator[str]:
    """Return lines for the intervals where the upward and the downward sweep differ."""
    for one in stretches:
        line = f"{one.start:.6g} to {one.end:.6g}: other motions upwards ({one.motion_upwards}) "
        yield from textwrap.wrap(f"{line}than downwards ({one.motion_downwards})", WIDTH)


def boundary_list(boundaries: "Sequence[Boundary]") -> Iterator[str]:
    """Return the refined boundaries, each with the loss of the orbit next to it."""
    for boundary in boundaries:
        between = f"{boundary.label_below} | {boundary.label_above}"
        jumps = f", jumps {boundary.direction}" if boundary.direction else ""
        yield f"{boundary.below:.8g} to {boundary.above:.8g}: {between}{jumps}"
        if boundary.loss:
            yield f"    {boundary.loss}"
        if boundary.elsewhere:
            yield f"    the orbit is lost at {boundary.lost_at:.8g}, not in this interval: here the"
            yield "    motion changes to a coexisting one, or settles too slowly for its label"
        if not math.isnan(abs(boundary.multiplier)):
            pair = boundary.multiplier.imag != 0.0
            yield f"    multiplier {boundary.multiplier if pair else boundary.multiplier.real:.4f}"


main = Command("stages", __doc__, StagesOptions, _stages).start(__name__)
