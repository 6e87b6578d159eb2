"""The interface of recorders, which accumulate data of every lane during an integration.

A recorder uses rows in the memory of a block and is called at fixed moments. Only the recorders
that a scene names are compiled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.rows import rows_of
from gearchaos_kernels.scene import Interface, Scene


class Clock(NamedTuple):
    """The position of a step or mesh period in time.

    Attributes
    ----------
    period : int
        Number of the mesh period since the start.
    number : int
        Number of the step within its mesh period.
    steps : int
        Steps per mesh period.
    substeps : int
        Steps per step of the plan, since a method may take more steps than requested.
    recorded : int
        Number of the recorded period; negative during the transient.
    left : int
        Number of mesh periods after this one.
    """

    period: int
    number: int
    steps: int
    substeps: int
    recorded: int
    left: int


class Block(NamedTuple):
    """The lanes of a block.

    Attributes
    ----------
    first : int
        Place of the first lane in `Share.order`.
    lanes : int
        Number of lanes.
    """

    first: int
    lanes: int


class LaneAt(NamedTuple):
    """Where a lane is.

    Attributes
    ----------
    slot : int
        Its slot in the block.
    number : int
        Its number among all lanes.
    """

    slot: int
    number: int


@dataclass(frozen=True)
class Recorder:
    """One recorder. Functions that a recorder leaves out do nothing.

    Attributes
    ----------
    name : str
        Name of its flag among the recorders of a scene.
    wanted : callable
        ``wanted(plan, resolved)``: whether a plan requests the recorder; ``resolved``: whether the
        scene resolves crossings.
    rows : callable
        ``rows(scene)``: rows of a block that the recorder uses.
    arrays : tuple of str
        Names of the arrays of `Outcome` and `Batch` that only this recorder uses. A compiled loop
        without the recorder gets None in their place.
    reads_before : bool
        Whether it reads the state before a step.
    begin : compiled function, optional
        ``begin(memory, first_row, block, clock, records, scene)``, called at the beginning of every
        mesh period. ``first_row``: the first row of the recorder; ``block``: the `Block`;
        ``clock``: the `Clock`; ``records``: the `Records`.
    step : compiled function, optional
        ``step(memory, first_row, block, clock, records, scene)``, called after every step.
    crossing : compiled function, optional
        ``crossing(memory, first_row, slot, crossing, lane, scene)``, called when a lane crosses a
        clearance boundary in a recorded period. ``crossing``: the `Crossing`; ``lane``: the
        coefficients.
    end_period : compiled function, optional
        ``end_period(memory, first_row, lane_at, clock, records, scene)``, called after every mesh
        period of a lane. ``lane_at``: the `LaneAt`.
    stop : compiled function, optional
        Called instead of ``end_period``, once, when a lane has diverged.
    finish : compiled function, optional
        ``finish(memory, first_row, lane_at, clock, records, scene)``, called at the end.
    """

    name: str
    wanted: Callable[..., bool]
    rows: Callable[[Scene], int]
    arrays: tuple[str, ...] = ()
    reads_before: bool = False
    begin: Any = None
    step: Any = None
    crossing: Any = None
    end_period: Any = None
    stop: Any = None
    finish: Any = None


class Records(NamedTuple):
    """The inputs and outputs of recorders.

    Attributes
    ----------
    steps : StepInputs
        What the steps of the block read.
    batch : Batch
        What the blocks read.
    outcome : Outcome
        What is written.
    """

    steps: Any
    batch: Any
    outcome: Any


begin_record = Interface("recorders", "begin")
record_step = Interface("recorders", "step")
record_crossing = Interface("recorders", "crossing")
record_period = Interface("recorders", "end_period")
record_stop = Interface("recorders", "stop")
finish_record = Interface("recorders", "finish")


def _then_block(first: Any, first_row: int, rest: Any) -> Any:
    """Return a function that calls the one of a recorder, then that of the other recorders.

    ``rest`` is None if there are no others.
    """

    def of_block(memory, block, clock, records, scene):
        first(memory, first_row, block, clock, records, scene)
        if rest is not None:
            rest(memory, block, clock, records, scene)

    return of_block


def _then_crossing(first: Any, first_row: int, rest: Any) -> Any:
    """Return what `_then_block` returns, with the arguments of ``crossing``."""

    def crossing(memory, slot, crossing, lane, scene):
        first(memory, first_row, slot, crossing, lane, scene)
        if rest is not None:
            rest(memory, slot, crossing, lane, scene)

    return crossing


def _then_lane(first: Any, first_row: int, rest: Any) -> Any:
    """Return what `_then_block` returns, with the arguments of functions of one lane."""

    def of_lane(memory, lane_at, clock, records, scene):
        first(memory, first_row, lane_at, clock, records, scene)
        if rest is not None:
            rest(memory, lane_at, clock, records, scene)

    return of_lane


_THEN = {
    "begin": _then_block,
    "step": _then_block,
    "crossing": _then_crossing,
    "end_period": _then_lane,
    "stop": _then_lane,
    "finish": _then_lane,
}


@scalar
def _nothing(_a, _b, _c, _d, _e):
    """Do nothing; all functions of recorders, once combined, have five arguments."""


class Recorders:
    """Several recorders, called one after the other; registered by `scene.implement`."""

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
        """Return a compiled function that calls the one of each recorder in turn."""
        called = None
        for one in reversed(self.of(scene)):
            function = getattr(one, name)
            if function is not None:
                at = self.first_row(one.name, scene)
                called = scalar(_THEN[name](function, at, called))
        return called or _nothing
