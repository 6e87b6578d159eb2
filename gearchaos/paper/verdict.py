"""By which rule a computed number agrees with a printed one."""

import math
from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What a comparison comes to."""

    AGREES = "agrees"
    IN_KIND = "agrees in kind"
    DOES_NOT = "does not agree"


@dataclass(frozen=True)
class Rule:
    """How far a computed number may lie from a printed one.

    ``measure``: what the distance is measured by, in words; ``agrees``, ``in_kind``: the largest
    distances with these verdicts; ``relative``: whether these are shares, shown in percent.
    """

    measure: str
    agrees: float
    in_kind: float
    relative: bool = True

    def verdict(self, published: float, ours: float, size: float | None = None) -> Verdict:
        """Judge a number, not a number where there is no such thing.

        Where the rule is relative the distance is divided by ``size``, by default the printed one.
        """
        distance = abs(ours - published)
        if self.relative:
            distance /= abs(published if size is None else size)
        if not math.isfinite(distance):
            return Verdict.DOES_NOT
        # A distance that is the limit but for rounding is within it.
        within = distance * (1.0 - 1e-9)
        if within <= self.agrees:
            return Verdict.AGREES
        return Verdict.IN_KIND if within <= self.in_kind else Verdict.DOES_NOT

    def __str__(self) -> str:
        agrees, in_kind = (
            f"{100 * limit:g} %" if self.relative else f"{limit:g} e(τ)"
            for limit in (self.agrees, self.in_kind)
        )
        return f"agrees within {agrees} {self.measure}, in kind within {in_kind}"


RULES = {
    "derived": Rule("of the printed number", 0.001, 0.1),
    "coefficient": Rule("of the first harmonic", 0.001, 0.01),
    "boundary": Rule("of the printed place", 0.1, 0.5, relative=False),
    "amplitude": Rule("of the printed number", 0.05, 0.25),
    "exponent": Rule("of the printed number", 0.1, 0.5),
    "stage": Rule("of both spans together that is not common to them", 0.1, 0.5),
}
"""The rules by the names that `published.toml` uses."""


def overlap_verdict(published: tuple[float, float], ours: tuple[float, float]) -> Verdict:
    """Judge a span, its first and last value, by how much of both together is common to them."""
    common = min(published[1], ours[1]) - max(published[0], ours[0])
    together = max(published[1], ours[1]) - min(published[0], ours[0])
    return RULES["stage"].verdict(1.0, max(common, 0.0) / together)


def motion_verdict(published: str, ours: str, also: tuple[str, ...]) -> Verdict:
    """Judge the label of the motion at one pitch error.

    ``also`` are those found from another start or within the boundary rule's widest distance.
    """
    if ours == published:
        return Verdict.AGREES
    return Verdict.IN_KIND if published in also else Verdict.DOES_NOT
