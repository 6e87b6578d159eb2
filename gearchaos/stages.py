"""List the stages of a sweep: stretches of the swept parameter in which the motion keeps its label.

The table goes to stdout, everything else to stderr. Exit codes: 0 done, 2 the command line asks
for what cannot be, 4 the file cannot be read, is damaged or holds no labels.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gearchaos.command_line import OK, Command, coordinates, number, place

if TYPE_CHECKING:
    from gearchaos.engine.refinement import Boundary
    from gearchaos.engine.survival import Survival
    from gearchaos.results.crises import Crisis
    from gearchaos.results.jumps import Jump
    from gearchaos.results.result import Result
    from gearchaos.results.stage_table import Stage


WIDTH = 80
"""Columns of a terminal."""


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("result", metavar="RESULT.h5", help="result file of a sweep")
    add(
        "--narrowest",
        type=_width,
        default=0.0,
        metavar="WIDTH",
        help="put narrower stages into what surrounds them, and count them",
    )
    add(
        "--refine",
        type=_width,
        metavar="WIDTH",
        help="bisect every boundary to this width, and tell how the orbit beside it is lost; lanes "
        "are computed again with the configuration in the file",
    )
    add(
        "--at",
        type=place,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="where to fix an axis of a result that has several, at the nearest of its values; may "
        "be repeated (default: the first value of each but the first swept parameter)",
    )
    add(
        "--survival",
        type=_records,
        metavar="RECORDS",
        help="let up to 25 chaotic lanes go on for so many records of their own length, and tell "
        "which share is still chaotic then",
    )
    add("--json", action="store_true", help="print JSON instead of a table")


def _width(text: str) -> float:
    width = number(text)
    if width <= 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return width


def _records(text: str) -> int:
    records = number(text, 1, 1000)
    if records % 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(records)


def _stages(options: argparse.Namespace) -> int:
    from gearchaos.results.crises import crises
    from gearchaos.results.excitation import excitation_of
    from gearchaos.results.jumps import jumps
    from gearchaos.results.overview import finite
    from gearchaos.results.result import open_result
    from gearchaos.results.stage_table import (
        band_counts,
        labelled_lanes,
        one_axis,
        slice_facts,
        slice_lines,
        stage_table,
    )
    from gearchaos.results.variables import RECORD

    whole = open_result(options.result)
    result = one_axis(whole, **coordinates(options.at, whole.axes, whole.axis))
    where = slice_facts(whole, result)
    lanes = labelled_lanes(result, name=options.result)
    stages = stage_table(lanes, options.narrowest)
    bands = band_counts(result, stages)
    boundaries = None
    if options.refine is not None:
        boundaries = _refined(result, stages, options)
        stages = refined_stages(stages, boundaries)
    outlasting = _survival(result, options) if options.survival is not None else None
    jumping, bursting = jumps(result), crises(result)
    mixed = int((result[RECORD] == 1).sum()) if RECORD in result else 0
    if options.json:
        facts = {"parameter": result.axis, "slice": where, **_facts(stages, boundaries)}
        for stage, counts in zip(facts["stages"], bands, strict=True):
            stage["bands"] = counts
        facts["jumps"] = [jump._asdict() for jump in jumping]
        facts["crises"] = [crisis._asdict() for crisis in bursting]
        facts["survival"] = outlasting and outlasting._asdict()
        print(json.dumps(finite(facts), indent=1, allow_nan=False))
    else:
        unit = excitation_of(result.metadata).in_words
        head = slice_lines(where) + ([unit] if unit else [])
        print("\n".join(table(result.axis, stages, head)))
        told = band_lines(stages, bands) + remarks(jumping, bursting, mixed)
        told += [outlasting.text] if outlasting else []
        for lines in (told, boundary_list(boundaries or ())):
            if lines:
                print("\n".join(["", *lines]))
    return OK


def _refined(result: Result, stages: list[Stage], options: argparse.Namespace) -> list[Boundary]:
    # Only here: reading a file needs no compiler.
    from gearchaos.engine.refinement import refinable, refined_boundaries
    from gearchaos.engine.running import compiling

    config = refinable(result, options.result)
    with compiling():
        return refined_boundaries(config, result, stages, options.refine, options.threads)


def _survival(result: Result, options: argparse.Namespace) -> Survival:
    from gearchaos.engine.refinement import computable
    from gearchaos.engine.running import compiling
    from gearchaos.engine.survival import survival

    config = computable(result, options.result)
    with compiling():
        return survival(config, result, options.survival, options.threads)


def refined_stages(stages: list[Stage], boundaries: Sequence[Boundary]) -> list[Stage]:
    """Return the stages with their ends at the refined boundaries."""
    starts = [stages[0].start, *(boundary.above for boundary in boundaries)]
    ends = [*(boundary.below for boundary in boundaries), stages[-1].end]
    return [
        stage._replace(start=start, end=end)
        for stage, start, end in zip(stages, starts, ends, strict=True)
    ]


def table(axis: str, stages: Sequence[Stage], where: Sequence[str] = ()) -> list[str]:
    """Word the stages of a slice as lines of a table, no longer than 80 characters."""
    lines = [
        f"stages over {axis}",
        *where,
        f"{'from':>10}  {'to':>10}  {'motion':15}{'lanes':>6}  {'exponent':>20}  narrower",
    ]
    for stage in stages:
        exponent = f"{stage.lowest_exponent:.4f} to {stage.highest_exponent:.4f}"
        lines.append(
            f"{stage.start:10.6g}  {stage.end:10.6g}  {stage.label:15}{stage.lanes:6d}"
            f"  {'' if math.isnan(stage.lowest_exponent) else exponent:>20}"
            f"  {f'with {stage.narrower}' if stage.narrower else ''}".rstrip()
        )
    return lines


def band_lines(stages: Sequence[Stage], bands: Sequence[Mapping[int, int]]) -> list[str]:
    """Word on how many bands the sections of a stage lie, where any lies on several."""
    lines = []
    for stage, counts in zip(stages, bands, strict=True):
        several = [f"{lanes} on {count}" for count, lanes in counts.items() if count > 1]
        if several:
            line = f"{stage.start:.6g} to {stage.end:.6g}: of {sum(counts.values())} "
            line += f"{stage.label} lanes {', '.join(several)} bands"
            lines += textwrap.wrap(line, WIDTH)
    return lines


def remarks(jumping: Sequence[Jump], bursting: Sequence[Crisis], mixed: int) -> list[str]:
    """Word what the table does not show: jumps and crises in a stage, chaos that came to rest."""
    lines = [
        f"{jump.below:.6g} to {jump.above:.6g}: jumps to another motion of {jump.label}"
        for jump in jumping
    ]
    lines += [
        f"{crisis.below:.6g} to {crisis.above:.6g}: crisis, {crisis.section} spans\n"
        f"{crisis.lowest_below:.3g} to {crisis.highest_below:.3g} below, "
        f"{crisis.lowest_above:.3g} to {crisis.highest_above:.3g} above"
        for crisis in bursting
    ]
    if mixed:
        lines.append(
            f"{mixed} periodic lanes came to rest within their record, which holds another\n"
            "motion before; integration.transient_periods leaves it out"
        )
    return lines


def boundary_list(boundaries: Sequence[Boundary]) -> list[str]:
    """Word the refined boundaries, each with what the orbit beside it does."""
    lines = []
    for boundary in boundaries:
        between = f"{boundary.label_below} | {boundary.label_above}"
        lines.append(f"{boundary.below:.8g} to {boundary.above:.8g}: {between}")
        if boundary.loss:
            lines.append(f"    {boundary.loss}")
        if not math.isnan(abs(boundary.multiplier)):
            real, imaginary = boundary.multiplier.real, abs(boundary.multiplier.imag)
            pair = f" +- {imaginary:.4f}i" if imaginary else ""
            lines.append(f"    multiplier {real:.4f}{pair}")
    return lines


_NAMES = {
    "start": "from",
    "end": "to",
    "label": "motion",
    "narrower": "narrower_stages",
    "label_below": "motion_below",
    "label_above": "motion_above",
    "loss": "loss_of_stability",
}
"""Names in JSON of what stages and boundaries have, where they differ."""


def _facts(stages: Sequence[Stage], boundaries: Sequence[Boundary] | None) -> dict[str, Any]:
    def named(record: Stage | Boundary) -> dict[str, Any]:
        return {_NAMES.get(name, name): value for name, value in record._asdict().items()}

    facts = {"stages": [{**named(stage), "lanes": stage.lanes} for stage in stages]}
    if boundaries is not None:
        facts["boundaries"] = [named(boundary) for boundary in boundaries]
    for fact in facts.get("boundaries", ()):
        multiplier = fact.pop("multiplier")
        fact |= {"multiplier_real": multiplier.real, "multiplier_imaginary": multiplier.imag}
        fact["loss_of_stability"] = fact["loss_of_stability"] or None
    return facts


main = Command("stages", __doc__, _arguments, _stages, common=("threads",))

if __name__ == "__main__":
    sys.exit(main())
