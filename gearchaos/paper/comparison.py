"""Every number that the paper prints beside ours: the rows, their verdicts, and the table."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from gearchaos.paper.computation import Reproduction, largest_acceleration
from gearchaos.paper.our_numbers import contact_line_stiffness, our_numbers
from gearchaos.paper.published import Published, Stage
from gearchaos.paper.stages import WINDOW, counterparts, motion_at, motions_between
from gearchaos.paper.verdict import (
    RULES,
    Verdict,
    motion_verdict,
    overlap_verdict,
)

NONE = "–"
NAN = float("nan")


@dataclass(frozen=True)
class Row:
    """One line of the comparison, worded."""

    quantity: str
    where: str
    published: str
    ours: str
    difference: str
    verdict: Verdict


@dataclass(frozen=True)
class Section:
    """Rows that belong together, under a heading, and how far ours are free to differ."""

    heading: str
    note: str
    rows: tuple[Row, ...]


class Comparison:
    """The comparison of a reproduction with the paper.

    Parameters
    ----------
    printed : Published
    found : Reproduction
    """

    def __init__(self, printed: Published, found: Reproduction) -> None:
        self.printed = printed
        self.found = found

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """All rows, in the order of the paper."""
        numbers = self._numbers()
        derived = [key for key in numbers if self.printed.numbers[key].rule == "derived"]
        spectral = "spectral_peak"
        derived.remove(spectral)
        hop = [key for key in numbers if key.startswith("hop")]
        return (
            Section(
                "Derived quantities",
                "From Table 1 and the printed stiffness. The period is that of the printed "
                "frequency, which is taken over.",
                tuple(numbers[key] for key in derived),
            ),
            Section(
                "Table 2: harmonics of the mesh stiffness",
                "Here: exact Fourier coefficients of the contact lines' trapezoid, in N/(µm mm); "
                "the even ones are zero.",
                tuple(self._harmonics()),
            ),
            Section(
                "Table 3, figures 14 and 15: accelerations",
                'Of the largest signed acceleration, see "why the increments are even". The groups '
                "were fitted to these numbers; the peak is the frequency, which is taken over.",
                (numbers["added_acceleration"], *self._increments(), numbers[spectral]),
            ),
            Section(
                "Figure 7: the hop",
                "The groups were fitted to its place and its exponent.",
                tuple(numbers[key] for key in hop),
            ),
            Section(
                "Figure 7: stages",
                "First and last pitch error in multiples of e(τ). Other motions in windows of up "
                f"to {WINDOW:g} e(τ) do not end a stage. The groups were fitted to the boundaries.",
                tuple(self._stages()),
            ),
            Section(
                "Figure 7: boundaries",
                "Where the second of two stages begins. The groups were fitted to these five.",
                tuple(self._boundaries()),
            ),
            Section(
                "Figures 8 to 13: the motion at six pitch errors",
                "Starting at rest.",
                tuple(self._motions()),
            ),
        )

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows."""
        return tuple(row for section in self.sections for row in section.rows)

    def count(self, verdict: Verdict) -> int:
        """Return how many rows have a verdict."""
        return sum(row.verdict is verdict for row in self.rows)

    def _numbers(self) -> dict[str, Row]:
        ours = our_numbers(self.printed, self.found)
        rows = {}
        for key, number in self.printed.numbers.items():
            value = ours[key]
            unit = "" if number.unit == "1" else f" {number.unit}"
            rows[key] = _row(
                number.quantity, number.where, number.rule, number.value, value, unit=unit
            )
        return rows

    def _harmonics(self) -> Iterator[Row]:
        printed = self.printed.harmonics
        mean = self.printed.numbers["mean_stiffness"].value
        ours = (
            mean
            * contact_line_stiffness(self.printed).to_fourier(len(printed.cosine)).coefficients()
        )
        first = math.hypot(printed.cosine[0], printed.sine[0])
        for letter, theirs, mine in (
            ("a", printed.cosine, ours.real),
            ("c", printed.sine, -ours.imag),
        ):
            for n, (one, other) in enumerate(zip(theirs, mine, strict=True), 1):
                quantity = f"{letter}<sub>{n}</sub>"
                yield _row(
                    quantity, printed.where, printed.rule, one, float(other), size=first, digits=4
                )

    def _increments(self) -> Iterator[Row]:
        printed, response = self.printed.increments, self.found.response
        for (low, high), value in zip(pairwise(printed.pitch_errors), printed.values, strict=True):
            mine = largest_acceleration(response, high) - largest_acceleration(response, low)
            quantity = f"growth of the torsional acceleration from {low:g} to {high:g} e(τ)"
            yield _row(quantity, printed.where, printed.rule, value, mine)

    def _stages(self) -> Iterator[Row]:
        for stage, span in self._pairs():
            mine = NONE if span is None else f"{span[0]:.2f} – {span[1]:.2f}"
            difference = NONE
            if span is not None:
                difference = f"{signed(span[0] - stage.first)}, {signed(span[1] - stage.last)}"
            yield Row(
                stage.words,
                "figure 7",
                f"{stage.first:.2f} – {stage.last:.2f}",
                mine,
                difference,
                Verdict.DOES_NOT
                if span is None
                else overlap_verdict((stage.first, stage.last), span),
            )

    def _boundaries(self) -> Iterator[Row]:
        for (before, ended), (after, begun) in pairwise(self._pairs()):
            # A boundary has two sides.
            mine = NAN if ended is None or begun is None else begun[0]
            yield _row(
                f"{before.words} → {after.words}",
                "figure 7",
                "boundary",
                after.first,
                mine,
                unit=" e(τ)",
                digits=2,
            )

    def _pairs(self) -> list[tuple[Stage, tuple[float, float] | None]]:
        stages = self.printed.stages
        return list(zip(stages, counterparts(stages, self.found.sweep), strict=True))

    def _motions(self) -> Iterator[Row]:
        rest, contact = self.found.motions, self.found.motions_from_contact
        for shown in self.printed.motions:
            p = shown.pitch_error
            mine, other = motion_at(rest, p), motion_at(contact, p)
            reach = RULES["boundary"].in_kind
            near = motions_between(self.found.sweep, p - reach, p + reach)
            text = mine if other == mine else f"{mine}; {other} from the contact flank"
            yield Row(
                f"motion at {p:g} e(τ)",
                f"figure {shown.figure}",
                shown.words,
                text,
                NONE,
                motion_verdict(shown.motion, mine, (other, *near)),
            )


def signed(value: float, digits: int = 2) -> str:
    """Write a difference with its sign, zero without."""
    text = f"{value:+.{digits}f}"
    return text.replace("-", "−") if float(text) else "0"


def _row(
    quantity: str,
    where: str,
    rule: str,
    published: float,
    ours: float,
    *,
    unit: str = "",
    size: float | None = None,
    digits: int | None = None,
) -> Row:
    judged = RULES[rule]
    if not math.isfinite(ours):
        return Row(quantity, where, _number(published) + unit, NONE, NONE, Verdict.DOES_NOT)
    distance = ours - published
    if judged.relative:
        share = 100.0 * distance / abs(published if size is None else size)
        difference = f"{signed(share, 1 if abs(share) >= 1.0 else 3)} %"
    else:
        difference = signed(distance)
    return Row(
        quantity,
        where,
        _number(published) + unit,
        (_number(ours) if digits is None else _number(round(ours, digits))) + unit,
        difference,
        judged.verdict(published, ours, size),
    )


def _number(value: float) -> str:
    """Write a number as short as six digits allow, with a true minus sign."""
    # Adding zero makes plus zero of minus zero.
    text = f"{value + 0.0:.6g}" if abs(value) >= 1.0 else f"{value + 0.0:.4g}"
    return text.replace("-", "−")
