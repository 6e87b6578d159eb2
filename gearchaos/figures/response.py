"""One lane of a response: time history, phase portrait, Poincare section, amplitude spectrum."""

from math import floor, log10
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, MaxNLocator, NullFormatter

from gearchaos.arrays import Floats
from gearchaos.errors import FigureError
from gearchaos.figures.labels import axis_label, check_variable, place_of, plain, unit_of
from gearchaos.figures.lanes import Between
from gearchaos.figures.page import remark
from gearchaos.figures.style import BLACK, BLUE, LEGEND, ORANGE, VERMILION
from gearchaos.outputs.names import MESH_PERIOD, TIME, acceleration_of
from gearchaos.records.amplitude_spectrum import spectral_lines
from gearchaos.records.period import motion_period
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.physical_units import SECONDS
from gearchaos.results.reading.result import Result, section_variables

COORDINATE = "delta_5"  # Coordinate of a gear pair that is drawn by default: the torsion.
HIGHEST_ORDER = 8.0  # Default limit of a spectrum, as a multiple of the mesh frequency.
DECADES = 5  # Decades of a spectrum, down from that of its highest line.
CONTACT_COLOURS = (ORANGE, "0.8", BLUE)  # No contact, driving flanks, back flanks.
STRIP_HEIGHT = 0.05  # Height of the contact strip, relative to its panel.

_LINE_LENGTH = 26
_MARGIN = 0.06
_MANY_LINES = 64
_SMALLEST_SHARE = 0.2
"""Least extent of a section, relative to the phase portrait, so that equal points coincide."""


def time_history(
    axes: Axes,
    result: Result,
    lane: int,
    variable: str | None = None,
    *,
    between: Between = (None, None),
    in_periods: bool = False,
) -> Line2D:
    """Draw a variable against time, in mesh periods, or in seconds where the result has these.

    Parameters
    ----------
    axes : Axes
        The axes to draw into.
    result : Result
        A response.
    lane : int
        Number of the lane, from 0, in the flattened axes of the result.
    variable : str, optional
        A variable over time, such as ``"delta_5_acceleration"`` or ``"mesh_force_tangential"``; by
        default the first coordinate, ``"delta_5"`` of a gear pair.
    between : (float or None, float or None)
        First and last mesh period to show; None is the end of the record.
    in_periods : bool
        Draw against mesh periods also where the result has seconds.

    Returns
    -------
    Line2D
        The curve. Forces and seconds have the prefix of the largest value, such as kN or ms.

    Raises
    ------
    FigureError
        If the result is not a response, the variable is missing, or the lane diverged.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> result = gearchaos.open_result("response.h5")
    >>> line = figures.time_history(axes, result, lane=0, variable="delta_5")
    """
    variable = variable or first_coordinate(result)
    values = motion_over_time(result, lane, variable)
    time = mesh_periods(result)
    low = time[0] if between[0] is None else between[0]
    high = time[-1] if between[1] is None else between[1]
    shown = (time >= low) & (time <= high)
    factor, label = time_axis(result, in_periods)
    power, prefix = _prefix(result, variable, values)
    (line,) = axes.plot(factor * time[shown], values[shown] / power, color=BLACK, linewidth=0.6)
    axes.set_xlim(factor * low, factor * high)
    _label(axes, result, TIME, variable)
    axes.set(xlabel=label, ylabel=axes.get_ylabel().replace("(N)", f"({prefix}N)"))
    return line


def _prefix(result: Result, variable: str, values: Floats) -> tuple[float, str]:
    """Return the power of 1000 and the prefix of forces in N; 1 and none for other variables."""
    if result.variables[variable].units != "N":
        return 1.0, ""
    return prefix_of(float(np.abs(values).max()))


def mesh_periods(result: Result) -> Floats:
    """Return the time of a response in mesh periods, shape (samples,)."""
    time: Floats = result[TIME]
    return time if result.variables[TIME].units != "s" else time / seconds_per_period(result)


def period_name(result: Result) -> str:
    """Return how the model of a response calls a period: mesh period, or excitation period."""
    return result.variables[MESH_PERIOD].long_name if MESH_PERIOD in result else "mesh period"


def seconds_per_period(result: Result) -> float:
    """Return the mesh period in seconds; NaN where the time of a response is in mesh periods."""
    if TIME not in result or result.variables[TIME].units != "s":
        return float("nan")
    period = result[MESH_PERIOD]
    factor = SECONDS[result.variables[MESH_PERIOD].units]
    return factor * float(period[np.isfinite(period)].flat[0])


def time_axis(result: Result, in_periods: bool = False) -> tuple[float, str]:
    """Return the length of a mesh period on the axis of time, and the label of this axis."""
    seconds = seconds_per_period(result)
    if not in_periods and seconds > 0.0:
        power, prefix = prefix_of(float(result[TIME][-1]))
        return seconds / power, f"Time, $t$ ({prefix}s)"
    if seconds > 0.0:
        return 1.0, f"Time in {period_name(result)}s"
    return 1.0, axis_label(result, TIME)


def prefix_of(largest: float) -> tuple[float, str]:
    """Return the power of 1000 of a size and its prefix, such as (1e-3, "m"), as EngFormatter."""
    powers = EngFormatter.ENG_PREFIXES
    power = 3 * floor(log10(largest) / 3 + 1e-9) if largest > 0.0 else 0
    power = min(max(power, min(powers)), max(powers))
    return 10.0**power, powers[power]


def contact_strip(
    axes: Axes, result: Result, lane: int, variable: str, *, in_periods: bool = False
) -> list[PolyCollection]:
    """Draw the contact state as a strip along the foot of a time history of a mesh force.

    Parameters
    ----------
    axes, result, lane
        As for `time_history`; the figure needs the constrained layout for its legend.
    variable : str
        Force of an element, such as ``"mesh_force_tangential"``.
    in_periods : bool
        As for `time_history`.

    Returns
    -------
    list of PolyCollection
        Bars of each contact state that occurs.

    Examples
    --------
    >>> axes = Figure(layout="constrained").subplots()
    >>> result = gearchaos.open_result("response.h5")
    >>> line = figures.time_history(axes, result, 0, "mesh_force_tangential")
    >>> bars = figures.contact_strip(axes, result, 0, "mesh_force_tangential")
    """
    name = f"contact_{element_of(result, variable)}"
    time = time_axis(result, in_periods)[0] * mesh_periods(result)
    states, strips = result.lanes(name)[lane], []
    first = np.flatnonzero(np.diff(states, prepend=-1))
    begin, lengths = time[first], np.diff(time[first], append=time[-1])
    for number, words in enumerate(result.variables[name].flags):
        bars = np.column_stack([begin, lengths])[states[first] == number]
        if bars.size:
            look: Any = {"color": CONTACT_COLOURS[number], "lw": 0.0}
            look |= {"label": words.replace("_", " "), "transform": axes.get_xaxis_transform()}
            strips.append(axes.broken_barh(bars.tolist(), (0.0, STRIP_HEIGHT), **look))
    assert axes.figure is not None
    axes.figure.legend(handles=strips, loc="outside upper left", ncols=len(strips), **LEGEND)
    return strips


def phase_portrait(
    axes: Axes, result: Result, lane: int, coordinate: str | None = None
) -> tuple[Line2D, Line2D]:
    """Draw velocity against displacement, with a point at the beginning of each mesh period.

    Parameters
    ----------
    axes, result, lane
        As for `time_history`.
    coordinate : str, optional
        Such as ``"delta_5"``; by default the first one.

    Returns
    -------
    (Line2D, Line2D)
        The curve, and the points once an excitation period. If that is longer than a mesh period,
        the points once a mesh period are light grey.

    Raises
    ------
    FigureError
        As for `time_history`.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> curve, points = figures.phase_portrait(axes, gearchaos.open_result("response.h5"), lane=0)
    """
    coordinate = coordinate or first_coordinate(result)
    plane = coordinate, f"{coordinate}_rate"
    displacement, velocity = (motion_over_time(result, lane, name) for name in plane)
    (curve,) = axes.plot(displacement, velocity, color=BLACK, linewidth=0.4)
    steps = samples_per_period(result)
    strobe = displacement[::steps], velocity[::steps]
    points = _points(axes, *strobe, 2.4, once_an_excitation(result, strobe[0].size))
    _label(axes, result, *plane)
    return curve, points


def poincare_section(
    axes: Axes, result: Result, lane: int, coordinate: str | None = None
) -> Line2D:
    """Draw the states at the beginning of all recorded mesh periods.

    Parameters
    ----------
    axes, result, lane, coordinate
        As for `phase_portrait`.

    Returns
    -------
    Line2D
        The points once an excitation period, as for `phase_portrait`.

    Raises
    ------
    FigureError
        As for `time_history`.

    Notes
    -----
    The axes cover at least a fifth of the phase portrait, so that the points of a periodic motion
    coincide.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> points = figures.poincare_section(axes, gearchaos.open_result("response.h5"), lane=0)
    """
    coordinate = coordinate or first_coordinate(result)
    plane = coordinate, f"{coordinate}_rate"
    curve = np.array([motion_over_time(result, lane, name) for name in plane])
    section = np.array([result.lanes(f"section_{name}")[lane] for name in plane])
    reach = (0.5 + _MARGIN) * np.maximum(np.ptp(section, 1), _SMALLEST_SHARE * np.ptp(curve, 1))
    reach[reach == 0.0] = 1.0
    middle = (section.min(axis=1) + section.max(axis=1)) / 2.0
    low, high = middle - reach, middle + reach
    once = once_an_excitation(result, section.shape[1])
    places = np.round((section.T[once] - low) / (high - low), 3)
    # A few points are visible only if they are large.
    markersize = float(np.clip(40.0 / len(np.unique(places, axis=0)), 1.5, 3.5))
    points = _points(axes, section[0], section[1], markersize, once)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    _label(axes, result, *plane)
    return points


def amplitude_spectrum(
    axes: Axes,
    result: Result,
    lane: int,
    variable: str | None = None,
    *,
    highest: float = HIGHEST_ORDER,
    in_orders: bool = False,
) -> LineCollection:
    """Draw the single-sided amplitude spectrum; a sine of amplitude A is a line of height A.

    Parameters
    ----------
    axes, result, lane
        As for `time_history`.
    variable : str, optional
        A variable over time, by default the acceleration of the first coordinate.
    highest : float
        Highest multiple of the mesh frequency to show.
    in_orders : bool
        Draw against multiples of the mesh frequency also where the result has seconds.

    Returns
    -------
    LineCollection
        The lines; each begins at the bottom of the axes, five decades below their top.

    Raises
    ------
    FigureError
        As for `time_history`.

    Notes
    -----
    A motion that repeats within the record is transformed over a whole number of its periods with
    a rectangular window. Any other motion is transformed over a whole number of excitation periods
    with a Hann window.

    Examples
    --------
    >>> axes = Figure().subplots()
    >>> lines = figures.amplitude_spectrum(axes, gearchaos.open_result("response.h5"), lane=0)
    """
    variable = variable or acceleration_of(first_coordinate(result))
    order, amplitude, window = spectrum_of(result, lane, variable)
    shown = order <= highest
    order, amplitude = order[shown], amplitude[shown]
    mesh, label = frequency_axis(result, highest, in_orders)
    power, prefix = _prefix(result, variable, amplitude)
    lines = _draw_spectrum(axes, mesh * order, amplitude / power)
    spare = 0.02 * mesh * highest
    axes.set_xlim(-spare, mesh * highest + spare)
    axes.set_xlabel(label)
    axes.xaxis.set_major_locator(MaxNLocator(9, integer=mesh == 1.0))
    symbol = result.attributes(variable).get("symbol") or plain(variable)
    unit = f"{prefix}{unit_of(result, variable)}"
    axes.set_ylabel(f"Amplitude of {symbol}" + (f" ({unit})" if unit else ""))
    remark(axes, window)
    return lines


def frequency_axis(result: Result, highest: float, in_orders: bool) -> tuple[float, str]:
    """Return the mesh frequency on the axis of a spectrum up to an order, and its label."""
    seconds = seconds_per_period(result)
    if in_orders or not seconds > 0.0:
        return 1.0, f"Frequency over {period_name(result).replace('period', 'frequency')}"
    power, prefix = prefix_of(highest / seconds)
    return 1.0 / (seconds * power), f"Frequency, $f$ ({prefix}Hz)"


def spectrum_of(result: Result, lane: int, variable: str) -> tuple[Floats, Floats, str]:
    """Return orders and amplitudes, each (lines,), and the window in words."""
    values, steps = motion_over_time(result, lane, variable), samples_per_period(result)
    held, excitation = values.size // steps, excitation_of(result.metadata).excitation_period
    repeats = repeats_after(result, lane)
    period = next((n for n in (repeats, excitation) if 0 < n <= held), 1)
    window = "Rectangular" if 0 < repeats <= held else "Hann"
    periods = held // period * period
    record = values[-1 - periods * steps : -1]
    order, amplitude = spectral_lines(record, steps, hann=window == "Hann")
    plural = "s" if periods > 1 else ""
    return order, amplitude, f"{window} window, {periods} {period_name(result)}{plural}"


def _draw_spectrum(axes: Axes, order: Floats, amplitude: Floats) -> LineCollection:
    """Draw lines over a logarithmic axis of `DECADES` decades."""
    top = 10.0 ** np.ceil(np.log10((1.0 + _MARGIN) * float(amplitude.max()) or 1.0))
    floor = top * 10.0**-DECADES
    axes.set_yscale("log")
    axes.yaxis.set_minor_formatter(NullFormatter())
    # Before the lines: matplotlib 3.9 would take limits from their logarithms, and warn.
    axes.set_ylim(floor, top)
    seen = amplitude > floor
    width = 0.5 if np.count_nonzero(amplitude > 1e-3 * top) > _MANY_LINES else 1.0
    return axes.vlines(order[seen], floor, amplitude[seen], color=BLUE, linewidth=width)


def is_response(result: Result) -> bool:
    """Whether a result contains the motion of its lanes over time."""
    return bool(response_variables_of(result))


def response_variables_of(result: Result) -> tuple[str, ...]:
    """Return the names of the variables over time, without contact states."""
    return tuple(
        name
        for name in result
        if TIME in result.dims(name)[len(result.axes) :] and not result.variables[name].flags
    )


def coordinates_of(result: Result) -> tuple[str, ...]:
    """Return the coordinates of a response that have accelerations, in the order of the file."""
    names = response_variables_of(result)
    return tuple(name for name in names if acceleration_of(name) in names)


def first_coordinate(result: Result) -> str:
    """Return the coordinate that is drawn by default: the first one, the torsion of a gear pair."""
    return next(iter(coordinates_of(result)), COORDINATE)


def element_of(result: Result, variable: str) -> str:
    """Return the clearance element whose force is a variable over time, "" for others."""
    _, force, element = variable.rpartition("force_")
    return element if force and f"contact_{element}" in result else ""


def forces_of(result: Result) -> tuple[str, ...]:
    """Return the forces of the clearance elements among the variables over time."""
    return tuple(name for name in response_variables_of(result) if element_of(result, name))


def repeats_after(result: Result, lane: int) -> int:
    """Return the number of mesh periods after which the motion of a lane repeats.

    0 if it does not repeat within 16 excitation periods, or the section has too few points.
    """
    section = np.stack([result.lanes(name)[lane] for name in section_variables(result)], axis=1)
    once = once_an_excitation(result, section.shape[0])
    return int(once.step * motion_period(section[np.newaxis, once])[0])


def once_an_excitation(result: Result, points: int) -> slice:
    """Select every point that is a whole number of excitation periods before the last point.

    ``points`` is the number of points, one per mesh period. A lane ends at the end of an
    excitation period.
    """
    period = excitation_of(result.metadata).excitation_period
    return slice((points - 1) % period, None, period)


def samples_per_period(result: Result) -> int:
    """Return the number of samples of a response per mesh period."""
    return int(np.searchsorted(mesh_periods(result), 1.0 - 1e-9))


def motion_over_time(result: Result, lane: int, variable: str) -> Floats:
    """Return a variable of one lane over time, shape (samples,).

    Raises
    ------
    FigureError
        If the result is not a response, the variable is missing, or the lane diverged.
    """
    check_variable(variable, response_variables_of(result), "over time")
    values = np.asarray(result.lanes(variable)[lane], dtype=np.float64)
    if not np.isfinite(values).all():
        place = ", ".join(f"{axis} = {value:g}" for axis, value in place_of(result, lane).items())
        raise FigureError(f"{place}: the lane diverged, it has no motion")
    return values


def _points(axes: Axes, x: Floats, y: Floats, markersize: float, once: slice) -> Line2D:
    if once.step > 1:
        axes.plot(x, y, "o", ms=1.2, mew=0.0, color="0.65", zorder=2.5, rasterized=True)
    return axes.plot(x[once], y[once], "o", ms=markersize, mew=0.0, color=VERMILION, zorder=3)[0]


def _label(axes: Axes, result: Result, along: str, upwards: str) -> None:
    axes.set_xlabel(axis_label(result, along))
    axes.set_ylabel(axis_label(result, upwards, _LINE_LENGTH), linespacing=1.2)
