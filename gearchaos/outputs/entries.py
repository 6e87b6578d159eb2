"""Entries of the catalogue of outputs, the parts they form and the subjects they are made for."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Literal, TypeAlias

import numpy as np

from gearchaos.outputs.names import acceleration_of, rate_of
from gearchaos.outputs.scales import Quantity

SUBJECT = "@"
"""Placeholder for name, wording or symbol of the subject in the texts of an output."""
LANE_AXES = "lanes"
"""Placeholder for all axes of a result in the dimensions of an output."""

Dtype: TypeAlias = Literal["float64", "int32", "uint8"]


class Kind(Enum):
    """Kinds of things a model consists of; an output may exist once for each thing of a kind."""

    STATE = auto()
    ACCELERATION = auto()
    ELEMENT = auto()
    SIGNAL = auto()


@dataclass(frozen=True)
class Subject:
    """A state, an element or a signal of a model, as its outputs name it.

    Attributes
    ----------
    name : str
        Part of the names of outputs.
    long_name, symbol : str
        Wording for people, and mathtext for axis labels. The symbol of an element is that of its
        force.
    scale : Quantity
        The quantity that a state, an acceleration or a signal measures.
    """

    name: str
    long_name: str
    symbol: str = ""
    scale: Quantity = Quantity.NONE


NO_SUBJECT = Subject("", "")


@dataclass(frozen=True)
class Output:
    """One output. By default it is a number of each lane, not a number where it is missing.

    Attributes
    ----------
    name : str
        Name in the file. `SUBJECT` is replaced by the name of the subject.
    long_name, symbol : str
        Wording for people, and mathtext for axis labels. `SUBJECT` is replaced by those.
    dims : tuple of str
        Dimensions; `LANE_AXES` is replaced by all axes of the result.
    dtype : str
        ``"float64"``, ``"int32"`` or ``"uint8"``.
    scale : Quantity, optional
        The quantity that it measures. None: that of the subject.
    fill_value : float or int, optional
        Value that marks "none here". None: every value means something.
    errors : tuple of str
        Names of the outputs that give the error of this one.
    meanings : tuple of str
        Meanings of the values 0, 1, ... of an enumeration where they are always the same. Others
        are given when the variables of a result are listed.
    """

    name: str
    long_name: str
    symbol: str = ""
    dims: tuple[str, ...] = (LANE_AXES,)
    dtype: Dtype = "float64"
    scale: Quantity | None = Quantity.NONE
    fill_value: float | int | None = np.nan
    errors: tuple[str, ...] = ()
    meanings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.dtype == "uint8" and self.fill_value not in (None, *range(256)):
            raise ValueError(f"{self.name}: fill_value = {self.fill_value} is no {self.dtype}")
        if self.dtype == "int32" and not isinstance(self.fill_value, int | None):
            raise ValueError(f"{self.name}: fill_value = {self.fill_value} is no {self.dtype}")

    def name_for(self, subject: Subject) -> str:
        """Return the name of the output of one subject."""
        return self.name.replace(SUBJECT, subject.name)

    def dims_over(self, axes: Sequence[str]) -> tuple[str, ...]:
        """Return the dimensions of the output in a result with these axes."""
        return tuple(name for dim in self.dims for name in (axes if dim == LANE_AXES else (dim,)))


def numbers(name: str, long_name: str, symbol: str = "", meanings: tuple[str, ...] = ()) -> Output:
    """Return the coordinate of a dimension whose values are whole numbers."""
    return Output(name, long_name, symbol, (name,), "int32", Quantity.NONE, None, (), meanings)


@dataclass(frozen=True, eq=False)
class Part:
    """Outputs that a result holds together, or not at all.

    Attributes
    ----------
    when : str
        When they exist, in words.
    outputs : tuple of Output
        The outputs in the order of the file. A file that holds the first one must hold all.
    repeated_for : tuple of Kind
        The outputs exist once for each chosen subject of these kinds; empty: once.
    required : bool
        Whether every file of a sweep holds them.
    in_time : bool
        Whether only responses hold them. Readers accept a file that holds some of them.
    """

    when: str
    outputs: tuple[Output, ...]
    repeated_for: tuple[Kind, ...] = ()
    required: bool = False
    in_time: bool = False

    def __post_init__(self) -> None:
        for output in self.outputs:
            if (SUBJECT in output.name) != bool(self.repeated_for):
                raise ValueError(
                    f"{output.name}: must name its subject by {SUBJECT} if its part is repeated, "
                    "and only then"
                )
            if output.scale is None and not self.repeated_for:
                raise ValueError(f"{output.name}: has no subject whose quantity it could measure")


def rearranged(parts: Iterable[Part], instead: Mapping[Part, Sequence[Part]]) -> tuple[Part, ...]:
    """Return parts in their order, some of them replaced by others."""
    return tuple(new for part in parts for new in instead.get(part, (part,)))


def motion_subjects(name: str, symbol: str, wording: str) -> tuple[Subject, Subject, Subject]:
    """Return the displacement, the velocity and the acceleration of a coordinate as subjects.

    ``symbol`` is the TeX symbol of the displacement. ``wording`` has ``{}`` in place of the words
    displacement, velocity and acceleration.
    """
    return (
        Subject(name, wording.format("displacement"), f"${symbol}$", Quantity.LENGTH),
        Subject(rate_of(name), wording.format("velocity"), f"${symbol}'$", Quantity.SPEED),
        Subject(
            acceleration_of(name),
            wording.format("acceleration"),
            f"${symbol}''$",
            Quantity.ACCELERATION,
        ),
    )
