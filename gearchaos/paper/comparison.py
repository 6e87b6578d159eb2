"""Every number that the paper prints beside ours: the rows, worded, and their verdicts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

from gearchaos.paper.computation import Reproduction, largest_acceleration
from gearchaos.paper.our_numbers import NAN, contact_line_stiffness, our_numbers
from gearchaos.paper.published import Kind, PrintedStage, Published
from gearchaos.paper.stages import counterparts, motion_at, motions_between, own_share
from gearchaos.paper.verdict import RULES, Verdict, motion_verdict, overlap_verdict
from gearchaos.results.stage_table import Stage

NONE = "–"


class Row(NamedTuple):
    """One line of the comparison, worded."""

    quantity: str
    where: str
    kind: Kind
    published: str
    ours: str
    difference: str
    verdict: Verdict


def compare(printed: Published, found: Reproduction) -> dict[str, list[Row]]:
    """Compare a reproduction with all that the paper prints: the tables of the report, by name."""
    ours = our_numbers(printed, found)
    numbers = {
        key: _judged(
            number.quantity,
            number.where,
            number.kind,
            number.rule,
            number.value,
            ours[key],
            unit="" if number.unit == "1" else f" {number.unit}",
        )
        for key, number in printed.numbers.items()
    }
    pairs = list(
        zip(printed.stages, counterparts(printed.stages, found.labelled(found.sweep)), strict=True)
    )
    peak = numbers.pop("spectral_peak")
    added, hop = (
        [numbers.pop(key) for key in list(numbers) if key.startswith(group)]
        for group in ("added", "hop")
    )
    return {
        "derived": [*numbers.values()],
        "harmonics": [*_harmonics(printed)],
        "accelerations": [*added, *_increments(printed, found), peak],
        "hop": hop,
        "stages": [*_stages(printed, found, pairs)],
        "boundaries": [*_boundaries(printed, pairs)],
        "motions": [*_motions(printed, found)],
    }


def _harmonics(printed: Published) -> Iterator[Row]:
    table, mean = printed.harmonics, printed.numbers["mean_stiffness"].value
    series = contact_line_stiffness(printed).to_fourier(len(table.cosine))
    ours = mean * series.coefficients()
    first = math.hypot(table.cosine[0], table.sine[0])
    for letter, theirs, mine in (("a", table.cosine, ours.real), ("c", table.sine, -ours.imag)):
        for n, (one, other) in enumerate(zip(theirs, mine.tolist(), strict=True), 1):
            name = f"{letter}<sub>{n}</sub>"
            yield _judged(
                name, table.where, table.kind, table.rule, one, other, size=first, digits=4
            )


def _increments(printed: Published, found: Reproduction) -> Iterator[Row]:
    table = printed.increments
    for (low, high), value in zip(pairwise(table.pitch_errors), table.values, strict=True):
        before, after = (largest_acceleration(found.response, p) for p in (low, high))
        quantity = f"growth of the torsional acceleration from {low:g} to {high:g} e(τ)"
        yield _judged(quantity, table.where, table.kind, table.rule, value, after - before)


def _stages(
    paper: Published, found: Reproduction, pairs: list[tuple[PrintedStage, Stage | None]]
) -> Iterator[Row]:
    for printed, stage in pairs:
        mine = difference = NONE
        verdict = Verdict.DOES_NOT
        if stage is not None:
            share = own_share(found.labelled(found.sweep), stage)
            mine = f"{stage.start:.2f} – {stage.end:.2f}"
            if share < 1.0:
                # Rounded downwards: all of them are never said to be where one is not.
                mine += f", in {math.floor(100.0 * share)} % of its lanes"
            difference = (
                f"{signed(stage.start - printed.first)}, {signed(stage.end - printed.last)}"
            )
            verdict = overlap_verdict((printed.first, printed.last), (stage.start, stage.end))
        theirs = f"{printed.first:.2f} – {printed.last:.2f}"
        kind = Kind(paper.kinds["stages"])
        yield Row(printed.printed, "figure 7", kind, theirs, mine, difference, verdict)


def _boundaries(paper: Published, pairs: list[tuple[PrintedStage, Stage | None]]) -> Iterator[Row]:
    kind = paper.kinds["boundaries"]
    for (before, ended), (after, begun) in pairwise(pairs):
        # A boundary has two sides.
        mine = NAN if ended is None or begun is None else begun.start
        quantity = f"{before.printed} → {after.printed}"
        yield _judged(
            quantity, "figure 7", kind, "boundary", after.first, mine, unit=" e(τ)", digits=2
        )


def _motions(printed: Published, found: Reproduction) -> Iterator[Row]:
    reach, sweep = RULES["boundary"].in_kind, found.labelled(found.sweep)
    starts = found.shown(found.motions), found.shown(found.motions_from_contact)
    for shown in printed.motions:
        p = shown.pitch_error
        mine, other = (motion_at(lanes, p) for lanes in starts)
        near = motions_between(sweep, p - reach, p + reach)
        yield Row(
            f"motion at {p:g} e(τ)",
            f"figure {shown.figure}",
            Kind(printed.kinds["motions"]),
            shown.printed,
            mine if other == mine else f"{mine}; {other} from the contact flank",
            NONE,
            motion_verdict(shown.motion, mine, (other, *near)),
        )


def signed(value: float, digits: int = 2) -> str:
    """Write a difference with its sign, zero without."""
    text = f"{value:+.{digits}f}"
    return text.replace("-", "−") if float(text) else "0"


def short(value: float, digits: int = 4, sign: str = "-") -> str:
    """Write a number in a few digits, with a true minus sign."""
    # Adding zero makes plus zero of minus zero.
    return f"{value + 0.0:{sign}.{digits}g}".replace("-", "−")


def _judged(
    quantity: str,
    where: str,
    kind: str,
    rule: str,
    published: float,
    ours: float,
    *,
    unit: str = "",
    size: float | None = None,
    digits: int | None = None,
) -> Row:
    """Compare two numbers; ``size`` is what a relative rule divides by, if not the printed one."""
    judged = RULES[rule]
    theirs, mine, difference = _number(published) + unit, NONE, NONE
    if math.isfinite(ours):
        mine = _number(ours if digits is None else round(ours, digits)) + unit
        difference = signed(ours - published)
        if judged.relative:
            share = 100.0 * (ours - published) / abs(published if size is None else size)
            difference = f"{signed(share, 1 if abs(share) >= 1.0 else 3)} %"
    verdict = judged.verdict(published, ours, size)
    return Row(quantity, where, Kind(kind), theirs, mine, difference, verdict)


def _number(value: float) -> str:
    return short(value, 6 if abs(value) >= 1.0 else 4)
