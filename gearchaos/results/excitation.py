"""What a result says of its excitation, which may have the teeth of whole gears in a period."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

LARGEST = 1e9
"""Beyond any number of teeth, and any length in micrometres."""


class Excitation(NamedTuple):
    """The excitation of all lanes, as the attributes of these names tell.

    ``excitation_period``: mesh periods after which it repeats, 1 for a sine; where they are more,
    ``driving_teeth``, ``driven_teeth``: numbers of teeth, 0 where not known, and
    ``length_scale_um``: b', 0 where it is not known or differs from lane to lane.
    """

    excitation_period: int = 1
    driving_teeth: int = 0
    driven_teeth: int = 0
    length_scale_um: float = 0.0

    @property
    def in_words(self) -> str:
        """What the periods of motions count, where these are not mesh periods."""
        n = self.excitation_period
        return f"periods are those of the excitation, {n} mesh periods each" if n > 1 else ""


def excitation_of(metadata: Mapping[str, Any]) -> Excitation:
    """Read the excitation from the metadata of a result; what makes no sense is not known."""
    kinds: dict[str, Any] = dict.fromkeys(Excitation._fields, int)
    kinds["length_scale_um"] = int | float
    given = {name: metadata.get(name) for name in kinds}
    return Excitation(
        **{
            name: value
            for name, value in given.items()
            if isinstance(value, kinds[name]) and 0 < value < LARGEST
        }
    )
