"""What a recorder is: it accumulates something of every lane while lanes are integrated.

A recorder has rows of its own in the memory of a block, and is called at fixed moments. A scene
names its recorders; what it does not name is not compiled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.rows import rows_of
from gearchaos_kernels.scene import Interface, Scene


class Clock(NamedTuple):
    """Where in time a step or a mesh period lies.

    Attributes
    ----------
    period : int
        Mesh periods since the start.
    number : int
        Of the step within its mesh period.
    steps, every : int
        Steps of a period, and how many of them make one of those requested.
    recorded : int
        Recorded periods before this one; negative during the transient.
    left : int
        Periods that follow this one.
    """

    period: int
    number: int
    steps: int
    every: int
    recorded: int
    left: int


class Block(NamedTuple):
    """The lanes of a block: the place of the first one in the order of lanes, and their number."""

    first: int
    lanes: int


class Place(NamedTuple):
    """A lane: its slot in the block, and its number among all lanes."""

    slot: int
    lane: int


@dataclass(frozen=True)
class Recorder:
    """One recorder. Functions that it leaves out do nothing.

    Attributes
    ----------
    name : str
        Its flag among those of the scene's recorders.
    wanted : callable
        ``wanted(plan, resolved)``: whether a plan requests it, for a scene that resolves crossings
        or does not.
    rows : callable
        ``rows(scene)``: number of its rows in the memory of a block.
    reads_before : bool
        Whether it reads the state before a step.
    begin : compiled function, optional
        ``begin(memory, at, block, clock, given, scene)``, at the beginning of every mesh period;
        ``at``: first row of the recorder; ``given``: the `Records` of the block.
    step : compiled function, optional
        ``step(memory, at, block, clock, given, scene)``, after every step.
    crossing : compiled function, optional
        ``crossing(memory, at, slot, crossing, lane, scene)``, when a lane crosses a boundary in a
        recorded period.
    end_period : compiled function, optional
        ``end_period(memory, at, place, clock, given, scene)``, after every mesh period of a lane;
        ``place``: the lane.
    stop : compiled function, optional
        The same for a lane that has left the range of numbers, once.
    finish : compiled function, optional
        ``finish(memory, at, place, clock, given, scene)``, in the end.
    """

    name: str
    wanted: Callable[..., bool]
    rows: Callable[[Scene], int]
    reads_before: bool = False
    begin: Any = None
    step: Any = None
    crossing: Any = None
    end_period: Any = None
    stop: Any = None
    finish: Any = None


class Records(NamedTuple):
    """What recorders read and write: tables of the model, maps, the batch, and the outcome."""

    steps: Any
    batch: Any
    outcome: Any


begin_record = Interface("recorders", "begin")
record_step = Interface("recorders", "step")
record_crossing = Interface("recorders", "crossing")
record_period = Interface("recorders", "end_period")
record_stop = Interface("recorders", "stop")
finish_record = Interface("recorders", "finish")


def _then_block(first: Any, at: int, rest: Any) -> Any:
    def of_block(memory, block, clock, given, scene):
        first(memory, at, block, clock, given, scene)
        rest(memory, block, clock, given, scene)

    return of_block


def _then_crossing(first: Any, at: int, rest: Any) -> Any:
    def crossing(memory, slot, crossing, lane, scene):
        first(memory, at, slot, crossing, lane, scene)
        rest(memory, slot, crossing, lane, scene)

    return crossing


def _then_lane(first: Any, at: int, rest: Any) -> Any:
    def of_lane(memory, place, clock, given, scene):
        first(memory, at, place, clock, given, scene)
        rest(memory, place, clock, given, scene)

    return of_lane


_THEN = {
    "begin": _then_block,
    "step": _then_block,
    "crossing": _then_crossing,
    "end_period": _then_lane,
    "stop": _then_lane,
    "finish": _then_lane,
}


def _nothing_of_five(_a, _b, _c, _d, _e):
    pass


class Recorders:
    """Some recorders as one, called one after the other; see `scene.implement`."""

    def __init__(self, recorders: Sequence[Recorder]) -> None:
        self.recorders = tuple(recorders)

    def of(self, scene: Scene) -> list[Recorder]:
        """Return the recorders that a scene names."""
        return [one for one in self.recorders if getattr(scene.recorders, one.name)]

    def rows(self, scene: Scene) -> int:
        """Return the number of their rows."""
        return sum(one.rows(scene) for one in self.of(scene))

    def first_row(self, name: str, scene: Scene) -> int:
        """Return the first row of a recorder."""
        at = rows_of(scene).recorders
        for one in self.of(scene):
            if one.name == name:
                break
            at += one.rows(scene)
        return at

    def function(self, name: str, scene: Scene) -> Any:
        """Return a compiled function that calls that of each recorder in turn."""
        called = scalar(_nothing_of_five)
        for one in reversed(self.of(scene)):
            function = getattr(one, name)
            if function is not None:
                at = self.first_row(one.name, scene)
                called = scalar(_THEN[name](function, at, called))
        return called
