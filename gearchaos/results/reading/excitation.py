"""The excitation that the lanes of a result have in common, read from its metadata."""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Excitation(NamedTuple):
    """The excitation of all lanes; the fields are named as the attributes of the file.

    Attributes
    ----------
    excitation_period : int
        Mesh periods after which the excitation repeats, 1 for a sine.
    driving_teeth, driven_teeth : int
        Numbers of teeth that have errors of their own, 0 where they are not known.
    """

    excitation_period: int = 1
    driving_teeth: int = 0
    driven_teeth: int = 0

    @property
    def of_teeth(self) -> bool:
        """Whether teeth have errors of their own and their numbers are known."""
        return self.driving_teeth > 0 and self.driven_teeth > 0

    @property
    def in_words(self) -> str:
        """A sentence on the unit of periods; empty where they are counted in mesh periods."""
        n = self.excitation_period
        return f"periods are those of the excitation, {n} mesh periods each" if n > 1 else ""

    def points_in_words(self, shown: int) -> str:
        """Return a sentence on the points of a section; empty where each period has one.

        ``shown``: number of section points of each lane.
        """
        n = self.excitation_period
        last = f", and the last {shown} are drawn" if shown < n else ""
        points = f"period 1 has {n} points{last}"
        return f"the excitation repeats after {n} mesh periods:\n{points}" if n > 1 else ""


def excitation_of(metadata: Mapping[str, Any]) -> Excitation:
    """Read the excitation from the metadata of a result; invalid values count as unknown."""
    # No gear has more than 1e9 teeth.
    sound = {
        name: value
        for name, default in Excitation._field_defaults.items()
        if isinstance(value := metadata.get(name), type(default)) and 0 < value < 1e9
    }
    return Excitation(**sound)
