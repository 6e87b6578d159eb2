"""Pages about sweeps with control: diagrams above the effort, or a map of the captured share."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from gearchaos.arrays import Floats
from gearchaos.errors import FigureError
from gearchaos.figures.diagrams import bifurcation
from gearchaos.figures.labels import axis_label, unit_of
from gearchaos.figures.lanes import Between, diagram_lanes, swept_axes
from gearchaos.figures.page import Page, letter, page, remark
from gearchaos.figures.style import BLUE, LEGEND, SINGLE_COLUMN_MM, VERMILION
from gearchaos.outputs.names import axis_name
from gearchaos.records.control import CAPTURED, LIMITS
from gearchaos.results.reading.result import Result, section_variables

LIMIT_AXES = tuple(axis_name(f"control.{name}") for name in LIMITS)
"""Axes along which the value 0 is the machine without control."""

SHARES = "cividis"
"""Colours of the captured share."""

LEAST_SHOWN = 1e-4
"""Smallest effort that is shown, as a share of the largest one."""


def control_sweep_page(
    result: Result,
    between: Between = (None, None),
    width_mm: float = SINGLE_COLUMN_MM,
    height_mm: float | None = None,
) -> Page:
    """Draw a sweep with control: the diagrams without and with it, and the effort of each lane.

    If two keys of the controller are swept, the share of captured lanes is drawn as a map.

    Parameters
    ----------
    result : Result
        A sweep with [control] over a parameter of the machine. If ``control.limit`` is swept as
        well and one of its values is 0, the diagram of that value is the one without control.
    between : (float or None, float or None)
        Part of the parameter range to show; None is the end of the sweep.
    width_mm, height_mm : float
        Size of the page.

    Returns
    -------
    Page
        A figure unknown to pyplot. Diagrams have lanes that are not captured in red.

    Raises
    ------
    FigureError
        If the result is none with control over one parameter of the machine.

    Examples
    --------
    ::

        page = figures.control_sweep_page(gearchaos.open_result("control.h5"))
    """
    if len(_of_controllers(result)) == 2:
        return _captured_page(result, width_mm, height_mm)
    free, held = _parts(result)
    panels = [one for one in (free, held) if one is not None]
    height = height_mm or 20.0 + 0.42 * width_mm * (len(panels) + 1)
    with page(width_mm, height) as figure:
        stack = figure.subplots(len(panels) + 1, 1, sharex=True)
        for axes, part in zip(stack, panels, strict=False):
            drawn = bifurcation(axes, part, between=between)
            axes.set_xlabel("")
            variable = section_variables(part)[0]
            unit = unit_of(part, variable)
            axes.set_ylabel(
                f"Section {part.variables[variable].symbol}" + f" ({unit})" * bool(unit)
            )
            remark(axes, "without control" if part is free else _words(held))
            if part is held:
                _mark_others(axes, part, between)
        if free is not None:
            limits = np.array([axes.get_ylim() for axes in stack[:2]])
            for axes in stack[:2]:
                axes.set_ylim(limits[:, 0].min(), limits[:, 1].max())
        draw_efforts(stack[-1], held, between)
        stack[-1].set_xlim(drawn.lanes.limits)
        letter(stack)
        figure.align_ylabels(stack)
    return figure


def _of_controllers(result: Result) -> list[str]:
    """Return the axes that are keys of the controller."""
    return [axis for axis in swept_axes(result) if axis.startswith("control_")]


def _captured_page(result: Result, width_mm: float, height_mm: float | None) -> Page:
    """Draw the share of captured starts over two keys of the controller."""
    y, x = _of_controllers(result)
    captured = np.asarray(result["capture"] == CAPTURED)
    starts = captured.reshape(result[y].size, result[x].size, -1)
    with page(width_mm, height_mm or 15.0 + 0.7 * width_mm) as figure:
        axes = figure.subplots()
        # The values need not be evenly spaced: every cell has the same size.
        shares = 100.0 * starts.mean(axis=2)
        mesh = axes.imshow(shares, origin="lower", aspect="auto", vmin=0, vmax=100, cmap=SHARES)
        axes.set_xticks(range(shares.shape[1]), _texts(result[x]), rotation=45)
        axes.set_yticks(range(shares.shape[0]), _texts(result[y]))
        axes.set_xlabel(axis_label(result, x, line_length=44))
        axes.set_ylabel(axis_label(result, y, line_length=44))
        axes.tick_params(which="both", length=0)
        figure.colorbar(mesh, ax=axes, label="Captured starts (%)")
        remark(axes, f"{starts.shape[2]} starts each")
    return figure


def _texts(values: Floats) -> list[str]:
    """Return numbers as short texts."""
    return [f"{value:g}" for value in values.tolist()]


def _parts(result: Result) -> tuple[Result | None, Result]:
    """Return the parts of a result without and with control; the first may be missing."""
    if "capture" not in result.variables:
        raise FigureError("--control: is for results of sweeps with [control]; leave it out")
    free = None
    for axis in LIMIT_AXES:
        if axis in result.axes:
            values = result[axis]
            if values[0] == 0.0:
                free = result.sel(None, **{axis: 0.0})
            result = result.sel(None, **{axis: float(values[-1])})
    if len(swept_axes(result)) != 1 or swept_axes(result)[0].startswith("control_"):
        raise FigureError(
            "--control: draws a sweep over one parameter of the machine, beside the limit; choose "
            "a value of the others with --at"
        )
    return free, result


def _words(held: Result) -> str:
    """Return what the diagram with control shows, in words."""
    limit = held.fixed.get(LIMIT_AXES[0])
    within = "" if limit is None else f", at most {100.0 * limit:g} % of the input"
    return f"with control{within}"


def _mark_others(axes: Axes, held: Result, between: Between) -> None:
    """Mark the lanes that the controller does not keep on the orbit."""
    lanes = diagram_lanes(held, between)
    others = held.lanes("capture")[lanes.numbers] != CAPTURED
    at = lanes.parameter[others]
    if at.size:
        axes.plot(
            at,
            np.full(at.size, 0.02),
            "|",
            color=VERMILION,
            markersize=4,
            transform=axes.get_xaxis_transform(),
            label="not captured",
        )
        axes.legend(loc="lower center", **LEGEND)


def _unit_of_efforts(held: Result) -> tuple[float, str, str]:
    """Return the factor of the drawn efforts, the end of their names, and their unit.

    They are shares in percent, or values in the unit of an input whose steady value is 0.
    """
    if np.isfinite(held["effort_largest"]).any():
        return 100.0, "", " (%)"
    for end in ("_Nm", "_force"):
        if f"effort_largest{end}" in held.variables:
            unit = unit_of(held, f"effort_largest{end}")
            return 1.0, end, f" ({unit})" * bool(unit)
    return 100.0, "", " (%)"


def draw_efforts(axes: Axes, held: Result, between: Between) -> None:
    """Draw the largest and the mean effort of every lane."""
    lanes = diagram_lanes(held, between)
    factor, end, unit = _unit_of_efforts(held)
    largest, mean = (
        factor * held.lanes(f"{name}{end}")[lanes.numbers]
        for name in ("effort_largest", "effort_mean")
    )
    look: dict[str, Any] = {"marker": "o", "markersize": 1.8, "markeredgewidth": 0.0}
    look["linestyle"] = "none"
    axes.plot(lanes.parameter, largest, color=BLUE, label="largest", **look)
    axes.plot(lanes.parameter, mean, color=VERMILION, label="mean since control began", **look)
    axes.set_yscale("log")
    top = max(float(np.nanmax(largest, initial=0.0)), 1e-12)
    axes.set_ylim(top * LEAST_SHOWN, 3.0 * top)
    axes.set_ylabel(f"Change of the input{unit}")
    axes.set_xlabel(axis_label(held, swept_axes(held)[0]))
    axes.legend(loc="center right", **LEGEND)
