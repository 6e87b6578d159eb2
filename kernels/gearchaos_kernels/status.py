"""What became of a lane."""

from enum import IntEnum


class Status(IntEnum):
    """Outcome of the integration of one lane; the values are those of the result file."""

    OK = 0
    DIVERGED = 1
    TOO_FAST = 2


STATUS_TEXTS = {
    Status.OK: "integrated to the end",
    Status.DIVERGED: "left the range of numbers (or became not a number) and was stopped",
    Status.TOO_FAST: "moves faster than so few flow maps can follow, and was stopped",
}
