"""List the stages of a sweep: stretches of the swept parameter in which the motion keeps its label.

The table goes to stdout, everything else to stderr.
"""

import json
import math
import textwrap
from argparse import Namespace
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from gearchaos.command_line import Command, coordinates
from gearchaos.errors import ConfigurationError

if TYPE_CHECKING:
    from gearchaos.engine.recomputing import Survival
    from gearchaos.engine.refinement import Boundary
    from gearchaos.results.reading.jumps import Apart, Crisis, Jump
    from gearchaos.results.reading.result import Result
    from gearchaos.results.reading.stage_table import Stage


WIDTH = 80  # Columns of a terminal.


def _stages(options: Namespace) -> None:
    from gearchaos.outputs.names import DIRECTION, RECORD, REPEATS, UNSWEPT
    from gearchaos.results.reading.excitation import excitation_of
    from gearchaos.results.reading.jumps import apart, crises, jumps
    from gearchaos.results.reading.overview import plain, slice_lines
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.stage_table import (
        labelled_lanes,
        one_axis,
        slice_facts,
        stage_table,
    )

    whole = open_result(options.result)
    # What is computed again is that of one pair and one start.
    kept = REPEATS if options.refine is None and options.survival is None else ()
    places = coordinates(options.at, whole.axes, whole.axis)
    part = one_axis(whole, (*kept, DIRECTION), **places)
    result, both = one_axis(part, kept), DIRECTION in part.axes
    where = slice_facts(whole, result)
    lanes = labelled_lanes(result, name=options.result, repeats=True)
    if options.refine is not None and not options.at and {*whole.axes} - {whole.axis, *UNSWEPT}:
        _map_boundaries(whole, options)
        return
    stages = stage_table(lanes)
    stretches = apart(part)
    boundaries, outlasting = _computed_again(part, result, stages, stretches, options)
    for at, boundary in enumerate([] if both else boundaries or []):
        stages[at] = stages[at]._replace(end=boundary.below)
        stages[at + 1] = stages[at + 1]._replace(start=boundary.above)
    several = [axis for axis in result.axes if axis in REPEATS]
    jumping, bursting = ([], []) if several else (jumps(result), crises(result))
    if options.json:
        refined = {} if boundaries is None else {"boundaries": boundaries}
        facts = {
            "parameter": result.axis,
            "slice": where,
            "stages": stages,
            **({"directions_apart": stretches} if both else {}),
            **refined,
            "jumps": jumping,
            "crises": bursting,
            "survival": outlasting,
        }
        print(json.dumps(plain(facts), indent=1))
        return
    mixed = int((result[RECORD] == 1).sum()) if RECORD in result else 0
    told = [*band_lines(stages), *remarks(jumping, bursting, mixed), *directions_apart(stretches)]
    told += [outlasting.text] if outlasting else []
    head = [
        f"all {result[axis].size} values of {axis}, of which --at {axis}=VALUE chooses one"
        for axis in several
    ]
    head += [*slice_lines(where), excitation_of(result.metadata).in_words]
    first = table(result.axis, stages, [*filter(None, head)])
    parts = map("\n".join, (first, told, boundary_list(boundaries or ())))
    print("\n\n".join(filter(None, parts)))


def _map_boundaries(result: "Result", options: Namespace) -> None:
    """Find the boundaries in all rows of a map, and tell what that saves."""
    from gearchaos.engine.recomputing import refinable
    from gearchaos.engine.refinement import refined_map
    from gearchaos.engine.running import choose_threads, compiling
    from gearchaos.results.reading.overview import plain

    choose_threads(options.threads)
    config = refinable(result, options.result)
    if len(result.axes) > 2 or options.survival is not None:
        raise ConfigurationError(
            f"--refine: {options.result} runs over {', '.join(result.axes)}; only two swept "
            "parameters are refined as a whole, without --survival: choose a slice with --at "
            "NAME=VALUE"
        )
    with compiling():
        rows, lanes = refined_map(config, result, options.refine)
    second, first = result.axes
    reach = float(result[first][-1] - result[first][0])
    fine = result[second].size * (math.ceil(reach / options.refine) + 1)
    if options.json:
        facts = {
            "parameter": first,
            "second_parameter": second,
            "rows": [{"value": at, "boundaries": found} for at, found in rows.items()],
            "lanes": lanes,
            "lanes_of_a_map_as_fine": fine,
        }
        print(json.dumps(plain(facts), indent=1))
        return
    for value, found in rows.items():
        print(f"{second} = {value:.6g}", *boundary_list(found), sep="\n")
    print(f"{lanes} lanes were computed; a map as fine everywhere would have {fine}")


def _computed_again(
    part: "Result",
    result: "Result",
    stages: "list[Stage]",
    stretches: "list[Apart]",
    options: Namespace,
) -> "tuple[list[Boundary] | None, Survival | None]":
    """Compute what --refine and --survival ask for, None where they do not."""
    if options.refine is None and options.survival is None:
        # Reading a file needs no compiler.
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
    """Word the stages of a slice as lines of a table, no longer than 80 characters."""
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
    """Word on how many bands the sections of a stage lie, where any lies on several."""
    for stage in stages:
        several = [f"{lanes} on {bands}" for bands, lanes in stage.bands.items() if bands > 1]
        if several:
            line = f"{stage.start:.6g} to {stage.end:.6g}: of {sum(stage.bands.values())} "
            line += f"{stage.label} lanes {', '.join(several)} bands"
            yield from textwrap.wrap(line, WIDTH)


def remarks(jumping: "Sequence[Jump]", bursting: "Sequence[Crisis]", mixed: int) -> Iterator[str]:
    """Word what the table does not show: jumps and crises in a stage, chaos that came to rest."""
    for jump in jumping:
        yield f"{jump.below:.6g} to {jump.above:.6g}: jumps to another motion of {jump.label}"
    for crisis in bursting:
        yield f"{crisis.below:.6g} to {crisis.above:.6g}: crisis, {crisis.section} spans"
        below = f"{crisis.lowest_below:.3g} to {crisis.highest_below:.3g} below"
        yield f"{below}, {crisis.lowest_above:.3g} to {crisis.highest_above:.3g} above"
    if mixed:
        yield f"{mixed} periodic lanes came to rest within their record, which holds another"
        yield "motion before; integration.transient_periods leaves it out"


def directions_apart(stretches: "Sequence[Apart]") -> Iterator[str]:
    """Word where a sweep comes to other motions upwards than downwards."""
    for one in stretches:
        line = f"{one.start:.6g} to {one.end:.6g}: other motions upwards ({one.motion_upwards}) "
        yield from textwrap.wrap(f"{line}than downwards ({one.motion_downwards})", WIDTH)


def boundary_list(boundaries: "Sequence[Boundary]") -> Iterator[str]:
    """Word the refined boundaries, each with what the orbit beside it does."""
    for boundary in boundaries:
        between = f"{boundary.label_below} | {boundary.label_above}"
        jumps = f", jumps {boundary.direction}" if boundary.direction else ""
        yield f"{boundary.below:.8g} to {boundary.above:.8g}: {between}{jumps}"
        if boundary.loss:
            yield f"    {boundary.loss}"
        if not math.isnan(abs(boundary.multiplier)):
            pair = boundary.multiplier.imag != 0.0
            yield f"    multiplier {boundary.multiplier if pair else boundary.multiplier.real:.4f}"


main = Command("stages", __doc__, _stages).start(__name__)
