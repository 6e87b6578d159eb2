"""A second opinion on the labels of a sweep: the 0-1 test on its sections."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos.arrays import Floats, Mask
from gearchaos.errors import ConfigurationError
from gearchaos.records.zero_one import FEWEST, zero_one
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.jumps import sections_of
from gearchaos.results.reading.result import Result, section_variables
from gearchaos.results.reading.stage_table import labelled_lanes

LIMIT = 0.5
"""Value of the 0-1 test above which a motion counts as chaotic."""

MOST_LISTED = 8  # Most contradicting lanes that are listed.


WITHOUT_OPINION = ("unresolved", "diverged", "grows")
"""Labels that the test neither confirms nor contradicts."""


class Opinions(NamedTuple):
    """Value of the 0-1 test of each lane, NaN where it is unknown, with swept value and label.

    ``needed``: fewest section points of a file with which the test is evaluated.
    """

    values: Floats
    labels: NDArray[np.str_]
    tests: Floats
    needed: int = FEWEST

    @property
    def contradict(self) -> Mask:
        """Whether the test and the label disagree about chaos; some labels have no opinion."""
        known = np.isfinite(self.tests) & ~np.isin(self.labels, WITHOUT_OPINION)
        return np.asarray(known & ((self.tests > LIMIT) != (self.labels == "chaotic")))

    def lines(self) -> Iterator[str]:
        """Yield lines for a terminal."""
        known, wrong = np.isfinite(self.tests), self.contradict
        if not known.any():
            periods = f", {FEWEST} periods of the excitation" if self.needed > FEWEST else ""
            yield (
                f"0-1 test: no section has {self.needed} points{periods}; raise "
                "outputs.section_points"
            )
            return
        yield f"0-1 test: of {known.sum()} lanes {wrong.sum()} contradict their label"
        found = zip(self.values[wrong], self.labels[wrong], self.tests[wrong], strict=True)
        for value, label, test in [*found][:MOST_LISTED]:
            yield f"    {value:.6g}: {label}, K = {test:.2f}"
        if wrong.sum() > MOST_LISTED:
            yield f"    and {wrong.sum() - MOST_LISTED} more; --json lists all"

    def facts(self) -> list[dict[str, Any]]:
        """Return value, label and test of each lane for JSON."""
        every = zip(self.values.tolist(), self.labels.tolist(), self.tests.tolist(), strict=True)
        return [dict(zip(("value", "label", "K"), one, strict=True)) for one in every]


def second_opinions(result: Result, name: str) -> Opinions:
    """Apply the 0-1 test to the first section of each lane of a result with one axis.

    Raises ConfigurationError if the result has no section, or several starts or systems.
    """
    sections = section_variables(result)
    if not sections or len(result.axes) != 1:
        raise ConfigurationError(
            f"{name}: --zero-one needs a section and one lane for each value; set outputs.section, "
            "or choose a start and a system with --at"
        )
    lanes = labelled_lanes(result, name=name)
    # Within a period of the excitation the points of a periodic motion differ, too.
    tests = np.array([zero_one(points[:, 0]) for points in sections_of(result)])
    needed = FEWEST * excitation_of(result.metadata).excitation_period
    return Opinions(lanes.values, lanes.labels, tests, needed)
