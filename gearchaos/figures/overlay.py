"""Lines and special points that are drawn over a figure: in print and in the browser."""

from typing import Any, NamedTuple

from gearchaos.arrays import Floats


class OverlaidLine(NamedTuple):
    """A line, or several lines over the same values.

    Attributes
    ----------
    kind : str
        Its entry in the legend.
    x : array, shape (points,)
        Values along the first axis.
    y : array, shape (points, lines)
        Values along the second axis.
    look : dict
        Colour, line style and line width, as matplotlib names them.
    grows : bool
        Whether it grows so far that a panel shows only a part of it.
    """

    kind: str
    x: Floats
    y: Floats
    look: dict[str, Any]
    grows: bool = False


class OverlaidPoint(NamedTuple):
    """A special point, which may have several places above each other.

    Attributes
    ----------
    kind : str
        Its entry in the legend.
    x : float
        Value along the first axis.
    y : array, shape (places,)
        Values along the second axis.
    look : dict
        Marker and colour, as matplotlib names them.
    text : str
        What it is and what happens there.
    """

    kind: str
    x: float
    y: Floats
    look: dict[str, Any]
    text: str


class Overlay(NamedTuple):
    """Lines and points to draw over a figure.

    Attributes
    ----------
    lines : list of OverlaidLine
        Lines, in the order in which they are drawn.
    points : list of OverlaidPoint
        Special points, above the lines.
    kinds : list of str
        Entries of the legend in their order.
    """

    lines: list[OverlaidLine]
    points: list[OverlaidPoint]
    kinds: list[str]
