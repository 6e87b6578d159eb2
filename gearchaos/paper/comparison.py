"""Comparison of every number printed in the paper with ours, each by a stated rule."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.figures.labels import short
from gearchaos.paper.computation import Reproduction, largest_acceleration
from gearchaos.paper.published import Printed, contact_line_stiffness, published
from gearchaos.results.reading.stage_table import LabelledLanes, Stage, stage_table

WINDOW = 0.1
"""Least width of a stage in multiples of e(tau); narrower ones are windows in a stage."""

NONE = "–"


class Agreement(StrEnum):
    """Result of a comparison."""

    AGREES = "agrees"
    IN_KIND = "agrees in kind"
    DOES_NOT = "does not agree"


AGREEMENT_RULES = vars(published().rules)


class ComparisonRow(NamedTuple):
    """One row of the comparison as text."""

    quantity: str
    where: str
    kind: str
    published: str
    ours: str
    difference: str
    verdict: Agreement


def compare(found: Reproduction) -> dict[str, list[ComparisonRow]]:
    """Compare a reproduction with all printed numbers; return the report's tables by name."""
    printed, ours = published(), found.numbers
    numbers = defaultdict(list)
    for key, number in vars(printed.numbers).items():
        row = _row(number.quantity, number, number.value, ours[key], unit=number.unit)
        numbers[number.table].append(row)
    stages = counterparts(printed.stages, found.lanes)
    pairs = list(zip(printed.stages, stages, strict=True))
    return {
        "derived": numbers["derived"],
        "harmonics": [*_harmonics()],
        "accelerations": [*numbers["accelerations"], *_increments(found), *numbers["peak"]],
        "hop": numbers["hop"],
        "stages": [*_stages(found, pairs)],
        "boundaries": [*_boundaries(pairs)],
        "motions": [*_motions(found)],
    }


def _harmonics() -> Iterator[ComparisonRow]:
    table, mean = published().harmonics, published().numbers.mean_stiffness.value
    ours = mean * contact_line_stiffness().coefficients(len(table.cosine))
    first = math.hypot(table.cosine[0], table.sine[0])
    for letter, theirs, mine in (("a", table.cosine, ours.real), ("c", table.sine, -ours.imag)):
        for n, (one, other) in enumerate(zip(theirs, mine.tolist(), strict=True), 1):
            yield _row(f"{letter}<sub>{n}</sub>", table, one, other, size=first, digits=4)


def _increments(found: Reproduction) -> Iterator[ComparisonRow]:
    table = published().increments
    for (low, high), value in zip(pairwise(table.pitch_errors), table.values, strict=True):
        before, after = (largest_acceleration(found.response, p) for p in (low, high))
        quantity = f"growth of the torsional acceleration from {low:g} to {high:g} e(τ)"
        yield _row(quantity, table, value, after - before)


def _stages(
    found: Reproduction, pairs: list[tuple[Printed, Stage | None]]
) -> Iterator[ComparisonRow]:
    labels, kind = found.lanes.labels, published().kinds.stages
    for printed, stage in pairs:
        mine, difference, judged = NONE, NONE, Agreement.DOES_NOT
        if stage is not None:
            share = np.mean(labels[stage.first : stage.last + 1] == stage.label)
            mine = f"{stage.start:.2f} – {stage.end:.2f}"
            if share < 1.0:
                # Rounded down: 100 % only if all lanes have the motion.
                mine += f", in {math.floor(100.0 * share)} % of its lanes"
            ends = (stage.start - printed.first, stage.end - printed.last)
            difference = ", ".join(map(signed, ends))
            judged = overlap_verdict((printed.first, printed.last), (stage.start, stage.end))
        theirs = f"{printed.first:.2f} – {printed.last:.2f}"
        yield ComparisonRow(printed.printed, "figure 7", kind, theirs, mine, difference, judged)


def _boundaries(pairs: list[tuple[Printed, Stage | None]]) -> Iterator[ComparisonRow]:
    for (before, ended), (after, begun) in pairwise(pairs):
        # A boundary needs a stage on either side.
        mine = math.nan if ended is None or begun is None else begun.start
        quantity = f"{before.printed} → {after.printed}"
        yield _row(quantity, published().boundaries, after.first, mine, unit="e(τ)", digits=2)


def _motions(found: Reproduction) -> Iterator[ComparisonRow]:
    reach = AGREEMENT_RULES["boundary"].in_kind
    for shown in published().motions:
        p = shown.pitch_error
        ours = found.motion_at(p)
        # The tolerance includes values at the end of the reach despite rounding.
        near = found.lanes.labels[np.abs(found.lanes.values - p) <= reach + 1e-9]
        judged = motion_verdict(shown.motion, ours, near.tolist())
        place = f"motion at {p:g} e(τ)", f"figure {shown.figure}", published().kinds.motions
        yield ComparisonRow(*place, shown.printed, ours, NONE, judged)


def counterparts(printed: Sequence[Printed], lanes: LabelledLanes) -> list[Stage | None]:
    """Find the stage of a sweep that corresponds to each printed stage.

    It is the stage with the printed motion and the largest overlap. Without any overlap it is the
    nearest stage within reach of the rule for boundaries, or None.
    """
    stages, found = stage_table(lanes, WINDOW), []
    for one in printed:
        alike = [stage for stage in stages if stage.label == one.motion]
        common = [min(s.end, one.last) - max(s.start, one.first) for s in alike]
        most = max(common, default=-np.inf)
        near = most >= -AGREEMENT_RULES["boundary"].in_kind
        found.append(alike[common.index(most)] if near else None)
    return found


def verdict(rule: Printed, published: float, ours: float, size: float | None = None) -> Agreement:
    """Judge a number by a rule; NaN does not agree.

    For a relative rule the distance is divided by ``size``, by default the printed number.
    """
    distance = abs(ours - published)
    if rule.relative:
        distance /= abs(published if size is None else size)
    # The tolerance includes distances at the limit despite rounding.
    within = distance * (1.0 - 1e-9)
    if within <= rule.agrees:
        return Agreement.AGREES
    return Agreement.IN_KIND if within <= rule.in_kind else Agreement.DOES_NOT


def overlap_verdict(published: tuple[float, float], ours: tuple[float, float]) -> Agreement:
    """Judge an interval (first, last) by the ratio of intersection to union."""
    common = min(published[1], ours[1]) - max(published[0], ours[0])
    together = max(published[1], ours[1]) - min(published[0], ours[0])
    return verdict(AGREEMENT_RULES["stage"], 1.0, max(common, 0.0) / together)


def motion_verdict(published: str, ours: str, near: Sequence[str]) -> Agreement:
    """Judge the motion at one pitch error; ``near``: motions within reach of the boundary rule."""
    if ours == published:
        return Agreement.AGREES
    return Agreement.IN_KIND if published in near else Agreement.DOES_NOT


def signed(value: float, digits: int = 2) -> str:
    """Write a difference with its sign; zero has none."""
    text = f"{value:+.{digits}f}"
    return text.replace("-", "−") if float(text) else "0"


def _row(
    quantity: str,
    printed: Printed,
    theirs: float,
    ours: float,
    *,
    unit: str = "",
    size: float | None = None,
    digits: int | None = None,
) -> ComparisonRow:
    """Compare two numbers; ``size``: divisor of a relative rule, if not the printed number."""
    rule, mine, difference = AGREEMENT_RULES[printed.rule], NONE, NONE
    if math.isfinite(ours):
        mine = f"{_number(ours if digits is None else round(ours, digits))} {unit}".rstrip()
        apart = ours - theirs
        difference = signed(apart, 2 if abs(apart) >= 0.01 else 3)
        if rule.relative:
            share = 100.0 * (ours - theirs) / abs(theirs if size is None else size)
            difference = f"{signed(share, 1 if abs(share) >= 1.0 else 3)} %"
    where, kind, judged = printed.where, printed.kind, verdict(rule, theirs, ours, size)
    printed_number = f"{_number(theirs)} {unit}".rstrip()
    return ComparisonRow(quantity, where, kind, printed_number, mine, difference, judged)


def _number(value: float) -> str:
    return short(value, 6 if abs(value) >= 1.0 else 4)
