"""What the figures of a response are drawn from: the motion of one lane, and when it repeats."""

import numpy as np

from gearchaos.errors import FigureError
from gearchaos.figures.labels import place_of
from gearchaos.figures.lanes import Floats
from gearchaos.records.period import motion_period
from gearchaos.results.excitation import excitation_of
from gearchaos.results.response_variables import TIME, acceleration_of
from gearchaos.results.result import Result, section_variables

COORDINATE = "delta_5"
"""The coordinate that is drawn unless another is asked for: the torsion."""


def is_response(result: Result) -> bool:
    """Whether a result holds the motion of its lanes in time."""
    return bool(response_variables_of(result))


def response_variables_of(result: Result) -> tuple[str, ...]:
    """Return the variables that run over time as numbers: all but the contact states."""
    return tuple(
        name
        for name in result
        if TIME in result.dims(name)[1:] and not result.variables[name].flags
    )


def coordinates_of(result: Result) -> tuple[str, ...]:
    """Return the coordinates whose motion a response holds, `delta_5` first."""
    names = response_variables_of(result)
    return tuple(name for name in names if acceleration_of(name) in names)


def repeats_after(result: Result, lane: int) -> int:
    """Return after how many mesh periods the motion of a lane repeats.

    0 for none up to 16 periods of the excitation, or a section with too few points to tell.
    """
    section = np.stack([result.lanes(name)[lane] for name in section_variables(result)], axis=1)
    once = once_an_excitation(result, section.shape[0])
    return int(once.step * motion_period(section[np.newaxis, once])[0])


def once_an_excitation(result: Result, points: int) -> slice:
    """Return which of so many points, a mesh period apart, are one period of the excitation apart.

    The last of them ends the lane, as it does a whole number of excitation periods.
    """
    period = excitation_of(result.metadata).excitation_period
    return slice((points - 1) % period, None, period)


def samples_per_period(result: Result) -> int:
    """Return how many samples of a response make a mesh period."""
    return int(np.searchsorted(result[TIME], 1.0))


def motion_of(result: Result, lane: int, variable: str) -> Floats:
    """Return a variable of one lane over time, shape (samples,).

    Raises FigureError if the result is no response, has no such lane or variable, or the lane
    diverged.
    """
    names = response_variables_of(result)
    if not names:
        raise FigureError(
            "the result holds no motion in time; compute one with python -m gearchaos.response"
        )
    if variable not in names:
        raise FigureError(
            f"no variable {variable!r} over time in the result; it has {', '.join(names)}"
        )
    lanes = result.along(result.axis).size
    if not 0 <= lane < lanes:
        raise FigureError(f"no lane {lane} in the result; it has 0 to {lanes - 1}")
    values = np.asarray(result.lanes(variable)[lane], dtype=np.float64)
    if not np.isfinite(values).all():
        place = ", ".join(f"{axis} = {value:g}" for axis, value in place_of(result, lane).items())
        raise FigureError(f"{place}: the lane diverged, it has no motion")
    return values
