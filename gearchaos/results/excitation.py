"""What a result says of its excitation, which may repeat only when the same teeth meet again."""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Excitation(NamedTuple):
    """The excitation of all lanes, by the attributes of these names.

    ``excitation_period``: mesh periods after which it repeats, 1 for a sine; the others, 0 where
    not known, are numbers of teeth that have errors of their own.
    """

    excitation_period: int = 1
    driving_teeth: int = 0
    driven_teeth: int = 0

    @property
    def of_teeth(self) -> bool:
        """Whether teeth have errors of their own, whose numbers are known."""
        return self.driving_teeth > 0 and self.driven_teeth > 0

    @property
    def in_words(self) -> str:
        """What the periods of motions are, where they are not mesh periods."""
        n = self.excitation_period
        return f"periods are those of the excitation, {n} mesh periods each" if n > 1 else ""


def excitation_of(metadata: Mapping[str, Any]) -> Excitation:
    """Read the excitation from the metadata of a result; what makes no sense is not known."""
    # Beyond that is no number of teeth.
    sound = {
        name: value
        for name, default in Excitation._field_defaults.items()
        if isinstance(value := metadata.get(name), type(default)) and 0 < value < 1e9
    }
    return Excitation(**sound)
