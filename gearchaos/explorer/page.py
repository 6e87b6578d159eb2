"""The page of one result, and its reactions to switches, clicks and links."""

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from html import escape, unescape
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import holoviews as hv
import numpy as np
import panel as pn
from bokeh.models import CrosshairTool, GlyphRenderer, Label, Span

from gearchaos.configuration.ranges import LARGEST_VALUE
from gearchaos.engine.recomputing import continued
from gearchaos.engine.response import compute_response, prepared
from gearchaos.engine.running import compiling
from gearchaos.errors import ConfigurationError, FigureError, GearchaosError
from gearchaos.explorer.charts import Charts, basin_map, diagram, two_parameter_map
from gearchaos.explorer.motion import SCALES, empty_panel, show
from gearchaos.explorer.overlay import Overlaid, glyphs, hover, legend
from gearchaos.explorer.shades import basin_boxes, stage_boxes
from gearchaos.explorer.starts import AT_START, ATTRACTOR, start_grid
from gearchaos.explorer.text import plain_text
from gearchaos.figures.diagrams import diagram_variables
from gearchaos.figures.labels import axis_label, in_words, unit_of
from gearchaos.figures.lanes import cell_edges, diagram_lanes, swept_axes
from gearchaos.figures.overlay import Overlay
from gearchaos.figures.page import FORMATS
from gearchaos.figures.response import forces_of
from gearchaos.figures.style import GREY, VERMILION
from gearchaos.outputs.catalogue import DEFAULT_PERIODS
from gearchaos.outputs.names import (
    CONVERTED,
    LABELS,
    LARGEST_EXPONENT,
    ORDER,
    SECTION,
    STATE,
    STATUS,
    coordinate_text,
)
from gearchaos.results.reading.ensembles import Basins
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import label_text

WIDE = {"sizing_mode": "stretch_width"}
HINT: Any = {
    "x": 0,
    "y": 0,
    "x_offset": 8,
    "y_offset": 8,
    "text_font_size": "11px",
    "background_fill_color": "white",
    "background_fill_alpha": 0.85,
}
"""Look of the text at the pointer."""

# Side by side where the window is wide enough.
HALF = {"flex": "1 1 560px", "min-width": "0"}
QUARTER = {"flex": "1 1 270px", "min-width": "0"}


MOST_PERIODS = 1000
"""Mesh periods of a motion at most, to resolve the orders of shafts."""

WIDEST = 320
"""Largest width of a switch, in pixels: a window of 390 holds it."""

MOST_ENTRIES = 64
"""Most values of an axis in a menu; more are chosen by a number."""

SECTIONS = "\N{WHITE CIRCLE} motion at the section"
"""Legend of the circles in basins."""


class ExplorerPage:
    """The page of one visitor.

    Parameters
    ----------
    result : Result
        The result to show.
    path : str
        Its file, for texts and commands.
    draw : callable
        Runs the command `plot` or `basins`, the first of a list of arguments; raises FigureError
        if that fails.
    overlaid : Overlaid, optional
        Branches or boundaries to draw over the first chart.
    """

    def __init__(
        self,
        result: Result,
        path: str,
        draw: Callable[[Sequence[str]], None],
        overlaid: Overlaid | None = None,
    ) -> None:
        self._overlay = _PageOverlay(overlaid)
        self._file, self._path, self._draw = result, path, draw
        self._grid = start_grid(result, path)
        result = self._grid.result if self._grid else result
        self._result = self._shown = result
        swept = swept_axes(result)[::-1]
        # A parameter with one value has no axis to draw over.
        self._swept = [axis for axis in swept if result[axis].size > 1] or swept[:1]
        if self._grid:
            self._swept = self._grid.axes[:2]
        self._others = [axis for axis in result.axes if axis not in self._swept]
        self._periods = _periods_of(result)
        choices: dict[str, Any] = {"variable": self._variables()}
        long = [axis for axis in self._others if result[axis].size > MOST_ENTRIES]
        self._numbers = [*self._swept, *long]
        for axis in self._others:
            if axis not in long:
                choices[axis] = {coordinate_text(axis, at): at for at in result[axis].tolist()}
        units = ["dimensionless", "physical"]
        # Branches and boundaries are dimensionless.
        units = units[::-1] if not overlaid and _is_physical(result) else units
        choices |= {"units": units, "motion_from": ["end", "start"]}
        self._switches = {
            name: pn.widgets.Select(options=choices[name], **_named(name, result))
            for name in choices
        }
        for axis in self._numbers:
            first = result[axis][0 if axis in long else result[axis].size // 2]
            given = {"value": float(first), "format": "0.[000000]"}
            self._switches[axis] = pn.widgets.FloatInput(**given, **_named(axis, result))
        self._window = pn.widgets.LiteralInput(value=[], visible=False)
        # Every text has its line from the beginning: a new line would move the charts below it.
        texts = (pn.pane.HTML("&nbsp;", **WIDE) for _ in range(5))
        self._pointed, self._lane, self._fault, self._kinds, self._commands = texts
        self._charts, self._panels = pn.Column(**WIDE), [*map(empty_panel, SCALES)]
        ways = zip(("height", "width"), self._swept, strict=False)
        self._marks = [Span(dimension=way, line_color=VERMILION) for way, _ in ways]
        self._hint = Label(text="", visible=False, **HINT)
        self._steady = True
        self._fixed: Mapping[str, float] = {}
        self._basins: Basins | None = None
        self._last: tuple[str, Mapping[str, float], str] | None = None
        self._motion: Result | None = None
        self._refused: dict[str, str] = {}

    def view(self) -> Any:
        """Compose the page from its link; afterwards the link follows the switches."""
        pn.config.exception_handler = self._say_fault
        for name, switch in (*self._switches.items(), ("window", self._window)):
            wrong = partial(self._refuse, name)
            pn.state.location.sync(switch, {"value": name}, lambda _, wrong=wrong: wrong())
        for name, switch in self._switches.items():
            moves = name in ("motion_from", *self._swept)
            changed = partial(self._change, name, self._move if moves else self._redraw)
            switch.param.watch(changed, "value")
        if self._overlay.overlaid:
            wrong = partial(self._refuse, self._overlay.name)
            synced = {"value": self._overlay.name}
            pn.state.location.sync(self._overlay.switch, synced, lambda _, wrong=wrong: wrong())
            self._overlay.switch.param.watch(lambda _: self._say_commands(), "value")
        self._redraw()
        for name in self._switches:
            self._allowed(name)
        for name in self._refused:
            self._refuse(name)
        files = [(name, kind) for name in ("sweep", "motion", "force") for kind in FORMATS]
        saves = [
            pn.widgets.FileDownload(
                callback=partial(self._saved, name, kind),
                filename=f"{Path(self._path).stem}_{name}.{kind}",
                label=f"{name.replace('_', ' ').capitalize()} as {kind.upper()}",
                width=170,
            )
            for name, kind in files
        ]
        title = escape(str(self._result.metadata.get("title", "")))
        panels = [pn.Column(one, styles=QUARTER) for one in self._panels]
        return pn.Column(
            pn.pane.HTML(f"<b>{title}</b> {escape(self._path)}", **WIDE),
            pn.FlexBox(*self._switches.values(), *self._overlay.switches),
            self._fault,
            pn.FlexBox(
                pn.Column(
                    self._pointed, self._charts, self._kinds, self._overlay.legend, styles=HALF
                ),
                pn.Column(self._lane, pn.FlexBox(*panels, **WIDE), styles=HALF),
                **WIDE,
            ),
            pn.FlexBox(*saves),
            self._commands,
            **WIDE,
        )

    def _variables(self) -> dict[str, str]:
        """Return the names of all variables to draw by their labels, the default first."""
        result = self._result
        if len(self._swept) == 1:
            over_orders = (*result.axes, ORDER)
            amplitudes = [name for name in result if result.dims(name) == over_orders]
            return _worded(result, [*diagram_variables(result), *amplitudes])
        of_lanes = [name for name in result if result.dims(name) == result.axes]
        found = _worded(result, sorted(of_lanes, key=lambda name: name != LABELS[0]))
        has_basins = self._grid is not None and self._grid.has_basins
        return {ATTRACTOR.capitalize(): ATTRACTOR} | found if has_basins else found

    @property
    def _ends(self) -> list[float]:
        """Limits of both axes of the first chart; empty if it is not zoomed."""
        ends = self._window.value
        given = isinstance(ends, list) and len(ends) == 4
        return ends if given and all(map(_is_number, ends)) else []

    def _value(self, name: str) -> Any:
        return self._switches[name].value

    def _in_units(self, result: Result) -> Result:
        return result.physical() if self._value("units") == "physical" else result

    def _change(self, name: str, show: Callable[[], None], _event: Any) -> None:
        """Update the page after a switch has changed."""
        if self._steady and self._allowed(name):
            if show == self._redraw:
                self._window.value = []
            show()

    def _allowed(self, name: str) -> bool:
        """Whether a switch has a valid value; an invalid one from a link becomes the first."""
        choices = getattr(self._switches[name], "values", None)
        if name in self._numbers and self._snapped(name):
            return False
        if self._value(name) in choices if choices else _is_number(self._value(name)):
            return True
        self._switches[name].value = choices[0] if choices else float(self._result[name][0])
        self._refuse(name)
        return False

    def _snapped(self, name: str) -> bool:
        """Replace a value outside of the sweep by the nearest one, and say so."""
        value, there = self._value(name), self._result[name]
        if not _is_number(value):
            return False
        margin = 0.5 * float(np.ptp(there)) / max(1, there.size - 1)
        if there.min() - margin <= value <= there.max() + margin:
            return False
        nearest = float(np.clip(value, there.min(), there.max()))
        self._switches[name].value = nearest
        ends = f"{there.min():.6g} to {there.max():.6g}"
        whole = "grid of starts" if self._grid and name in self._grid.axes else "sweep"
        self._say(f"{name} = {value:.6g}: outside of the {whole}, {ends}; {nearest:.6g} is shown")
        return True

    def _refuse(self, name: str) -> None:
        self._refused[name] = ""
        self._say(f"the link names what does not exist: {', '.join(self._refused)}")

    def _redraw(self) -> None:
        """Draw the sweep with the variable, axis values and units of the switches, and a motion."""
        chosen = self._result.sel("nearest", **{axis: self._value(axis) for axis in self._others})
        try:
            self._shown = self._in_units(chosen)
        except ConfigurationError as error:  # The pair has no physical units.
            self._steady, variable = False, self._value("variable")
            self._switches["units"].value = "dimensionless"
            self._steady = True
            # A browser repeats its link while it loads the page: charts that it already has would
            # be replaced by ones that take no clicks.
            if self._last != (variable, chosen.fixed, "dimensionless"):
                self._redraw()
            self._say_fault(error)
            return
        try:
            (charts, kinds), drawn = self._drawn(chosen.fixed)
        except GearchaosError as error:
            self._say_fault(error)
            return
        self._last = self._value("variable"), chosen.fixed, self._value("units")
        line = Span(dimension="height", line_color=GREY)
        zero = Span(dimension="width", location=0.0, line_color=GREY, line_dash="dashed")
        if ends := self._ends:
            charts[0].opts(ylim=tuple(ends[2:]))
        for chart in charts:
            chart.opts(**({"xlim": tuple(ends[:2])} if ends else {}))
            # The second chart shows exponents, and has a line at zero.
            lines: list[Any] = [zero, *self._marks]
            if chart is charts[0]:
                lines = [*self._marks, *drawn, self._hint]
            hooks: list[Callable[..., None]] = [partial(_marked, lines)]
            if chart is charts[0]:
                hooks.append(self._overlay.hook)
            chart.opts(tools=[CrosshairTool(overlay=line)], hooks=hooks)
            chart.opts(active_tools=["box_zoom", "wheel_zoom"])
            hv.streams.PointerXY(source=chart).add_subscriber(self._point)
            hv.streams.Tap(source=chart).add_subscriber(self._click)
        hv.streams.RangeXY(source=charts[0]).add_subscriber(self._zoom)
        self._charts[:] = [pn.pane.HoloViews(hv.Layout(charts).cols(1), **WIDE)]
        swatch = "<span style='background:{}; border:1px solid; padding:0 .6em'></span> {} &emsp;"
        texts = (swatch.format(colour, escape(name)) for name, colour in kinds.items())
        circles = self._basins is not None and self._value("variable") == ATTRACTOR
        self._kinds.object = "".join([*texts, *([SECTIONS] if circles else [])])
        self._move()

    def _drawn(self, place: Mapping[str, float]) -> tuple[Charts, list[Any]]:
        """Draw the charts of the sweep at a place on its other axes, with what lies over them."""
        variable, shown = self._value("variable"), self._shown
        over = self._overlay.drawn(shown, variable, self._value("units"))
        if self._grid and self._grid.has_basins:
            self._basins = self._grid.basins(place, self._value("units"))
            if variable == ATTRACTOR:
                return basin_map(shown, self._basins)
        if len(self._swept) > 1:
            return two_parameter_map(shown, variable), []
        charts, _ = diagram(shown, variable, over)
        boxes, kinds = stage_boxes(shown, diagram_lanes(shown).limits)
        if self._basins:
            boxes, kinds = basin_boxes(self._basins)
        return (charts, kinds), boxes

    def _nearest(self, x: float | None, y: float | None) -> dict[str, int]:
        """Return the number of the value nearest to a place in a chart, for each swept axis."""
        if x is None or y is None:
            return {}
        pairs = zip(self._swept, (x, y), strict=False)
        return {axis: int(np.abs(self._shown[axis] - value).argmin()) for axis, value in pairs}

    def _point(self, x: float | None, y: float | None) -> None:
        if at := self._nearest(x, y):
            words = self._words({axis: self._shown[axis][at[axis]] for axis in at})
            self._pointed.object = words
            with pn.io.unlocked():
                # In a plane the axes show the place: without it the text fits into the chart.
                drop = "<b>.*</b>" if self._grid and len(at) > 1 else ""
                text = unescape(re.sub("<[^>]*>", "", re.sub(drop, "", words))).strip()
                right = float(x or 0.0) > float(np.mean(self._shown[self._swept[0]][[0, -1]]))
                side = {"text_align": "right" if right else "left", "x_offset": -8 if right else 8}
                self._hint.update(x=x, y=y, text=text, visible=True, **side)

    def _click(self, x: float | None, y: float | None) -> None:
        if at := self._nearest(x, y):
            self._steady = False
            for axis, number in at.items():
                self._switches[axis].value = float(self._result[axis][number])
            self._steady = True
            self._move()

    def _zoom(self, x_range: Any, y_range: Any) -> None:
        if x_range and y_range:
            ends = () if self._is_whole(x_range, y_range) else (*x_range, *y_range)
            self._window.value = [float(f"{end:.6g}") for end in ends]
            self._say_commands()

    def _is_whole(self, *ranges: Any) -> bool:
        """Whether a chart with these limits shows the whole sweep."""
        if len(self._swept) == 1:
            return np.allclose(ranges[0], diagram_lanes(self._shown).limits)
        edges = [cell_edges(np.asarray(self._shown[axis], dtype=float)) for axis in self._swept]
        return np.allclose(ranges, [one[[0, -1]] for one in edges])

    def _move(self) -> None:
        """Show the motion of the lane nearest to the values of the switches."""
        fault, self._motion, start = "", None, self._value("motion_from")
        try:
            lane = self._result.sel("within", **{a: self._value(a) for a in self._result.axes})
            at = {a: self._shown[a][self._result[a] == lane.fixed[a]][0] for a in self._swept}
            if self._grid:
                lane = self._file.sel(None, **self._grid.start(lane.fixed))
            self._fixed = lane.fixed
            with pn.io.unlocked():
                for mark, value in zip(self._marks, at.values(), strict=True):
                    mark.location = float(value)
            self._lane.object = self._words(at)
            self._say_commands()
            config = continued(lane, self._path, start)
            with compiling():
                given = prepared(config, self._periods), self._periods, ""
                motion = compute_response(*given, str(lane.metadata["fixed"]))
            with pn.io.unlocked(), pn.state.curdoc.models.freeze():
                show(self._panels, self._in_units(motion), self._coordinate)
            self._motion = motion
            self._say_commands()
        except (GearchaosError, MemoryError) as error:
            fault = _reason(error)
        self._say(fault)

    @property
    def _coordinate(self) -> str:
        """The coordinate of the drawn section, or the first one of the machine."""
        if self._grid:
            return self._grid.axes[0].removeprefix(AT_START).removesuffix("_rate")
        name = str(self._value("variable"))
        of_section = name.startswith(SECTION)
        first: str = self._result.variables[STATE].flags[0]
        return name.removeprefix(SECTION).removesuffix("_rate") if of_section else first

    @property
    def _force(self) -> str:
        """The force of the first clearance element of the shown motion, "" without one."""
        return next(iter(forces_of(self._motion) if self._motion is not None else ()), "")

    def _words(self, at: Mapping[str, float]) -> str:
        """Word the swept value, motion, period, exponent and chosen variable of a lane."""
        lane = self._shown.sel(None, **at)
        words = ["diverged"] if lane[STATUS] else []
        if self._basins and (number := self._attractor(at)) > 0:
            words.append(f"attractor {number}")
        if LABELS[0] in lane and not lane[STATUS]:
            motion, period = (int(lane[name]) for name in LABELS)
            words.append(label_text(lane.variables[LABELS[0]].flags[motion], period))
        for name in dict.fromkeys([LARGEST_EXPONENT, self._value("variable")]):
            if name in lane and lane.dims(name) == () and lane[name].dtype == float:
                symbol = lane.attributes(name).get("symbol") or name.replace("_", " ")
                words.append(plain_text(f"{symbol} = {lane[name]:.4g} {unit_of(lane, name)}"))
        return f"<b>{escape(plain_text(in_words(self._shown, at)))}</b> {escape(', '.join(words))}"

    def _attractor(self, at: Mapping[str, float]) -> int:
        """Return the number of the attractor of a start, at most 0 without one."""
        assert self._basins is not None
        place = [int(np.abs(self._shown[axis] - at[axis]).argmin()) for axis in self._swept]
        sizes = [self._shown[axis].size for axis in self._swept]
        return int(self._basins.numbers[0].reshape(sizes)[*place])

    def _say(self, text: str) -> None:
        self._fault.object = f"<b style='color:{VERMILION}'>{escape(text)}</b>" if text else ""

    def _say_fault(self, error: Exception) -> None:
        """Show an error on the page; the traceback of a defect also goes to the terminal."""
        self._say(_reason(error))
        if not isinstance(error, GearchaosError | MemoryError):
            raise error

    def _arguments(self) -> dict[str, list[str]]:
        """Return the arguments of the commands that reproduce the page, by figure."""
        ends, motion = self._ends, f"{Path(self._path).stem}_response.h5"
        units = ["--units", "physical"] if self._value("units") == "physical" else []
        of_motion = ["--units", str(self._value("units"))]
        at = {a: f"--at={a}={coordinate_text(a, value)}" for a, value in self._fixed.items()}
        here = [at[axis] for axis in self._others if axis in at]
        between = ["--from", f"{ends[0]}", "--to", f"{ends[1]}"] if ends else []
        how = ["--begin", self._value("motion_from"), "--periods", f"{self._periods}"]
        shown = ["--variable", self._value("variable")]
        sweep = ["plot", self._path, *here, *between, *shown, *units, *self._overlay.arguments]
        if self._grid:
            sweep = ["basins", self._path, *here, *units]
        return {
            "sweep": sweep,
            "lane": ["response", self._path, *at.values(), *how],
            "motion": ["plot", motion, "--variable", self._coordinate, *of_motion],
            "force": ["plot", motion, "--variable", self._force, *of_motion],
        }

    @property
    def _has_figure(self) -> bool:
        """Whether a command draws the sweep as the page does."""
        of_two = self._grid is not None and len(self._grid.axes) == 2
        return self._grid is None or (of_two and self._value("variable") == ATTRACTOR)

    def _say_commands(self) -> None:
        words = self._arguments()
        if not self._force:  # No motion yet, or a machine without clearance elements.
            del words["force"]
        if self._grid and self._has_figure:
            words["sweep"] += ["--output", f"{Path(self._path).stem}_basins.png"]
        elif self._grid and not self._grid.has_basins:
            del words["sweep"]
        lines = (f"python -m gearchaos.{shlex.join(w)}\n" for w in words.values())
        self._commands.object = f"<pre style='white-space: pre-wrap'>{escape(''.join(lines))}</pre>"

    def _saved(self, name: str, kind: str) -> BytesIO:
        """Draw a figure as the displayed command does, and return its file."""
        # From the result in memory: its file may have been removed or replaced.
        drawn = self._file if name == "sweep" else self._motion
        if drawn is None:
            raise FigureError("there is no motion to draw")
        if name == "sweep" and not self._has_figure:
            raise FigureError("of a grid of starts, only the attractors over two states are drawn")
        with TemporaryDirectory() as folder:
            path, target = Path(folder, "drawn.h5"), Path(folder, f"figure.{kind}")
            drawn.save(path)
            command, _, *options = self._arguments()[name]
            self._draw([command, str(path), *options, "--output", str(target)])
            return BytesIO(target.read_bytes())


class _PageOverlay:
    """Branches or boundaries on the page of one visitor, with their switch and their legend."""

    def __init__(self, overlaid: Overlaid | None) -> None:
        self.overlaid, self._drawn = overlaid, list[GlyphRenderer]()
        self.name = overlaid.option if overlaid else ""
        self.switch = pn.widgets.Checkbox(name=self.name.capitalize(), value=True)
        self.legend = pn.pane.HTML("", visible=overlaid is not None, **WIDE)
        self._text = ""
        self.switch.param.watch(lambda _: self._show(), "value")

    @property
    def switches(self) -> list[Any]:
        """The switch, if there is something to show or hide."""
        return [self.switch] if self.overlaid else []

    @property
    def arguments(self) -> list[str]:
        """Arguments of the command `plot` for what is shown."""
        shown = self.overlaid is not None and self._drawn and self.switch.value
        return [f"--{self.name}", self.overlaid.path] if self.overlaid and shown else []

    def drawn(self, result: Result, variable: str, units: str) -> Overlay | None:
        """Make the lines and markers for a chart, and return what they show."""
        self._drawn, over = [], None
        if self.overlaid is None:
            return None
        try:
            # Boundaries lie over the parameters of the map. Most parameters keep their units.
            kept = self.name == "boundaries" and CONVERTED not in result.metadata
            if units == "physical" and not kept:
                raise FigureError(f"{self.name} are drawn in dimensionless units only")
            over = self.overlaid.over(result, variable)
        except FigureError as error:
            self._text = escape(str(error))
        else:
            self._drawn, self._text = glyphs(over), legend(over)
        self._show()
        return over

    def hook(self, plot: Any, _element: Any) -> None:
        """Put lines and markers into the chart when it is first drawn."""
        if self._drawn and self._drawn[0] not in plot.state.renderers:
            plot.state.renderers = [*plot.state.renderers, *self._drawn]
            plot.state.add_tools(hover(self._drawn))

    def _show(self) -> None:
        """Show or hide them as the switch has it; a reason why there are none stays."""
        for one in self._drawn:
            one.visible = self.switch.value
        self.legend.object = self._text if self.switch.value or not self._drawn else ""


def _periods_of(result: Result) -> int:
    """Return the mesh periods of a motion on the page."""
    periods, recorded = DEFAULT_PERIODS, result.metadata.get("recorded_periods")
    repeats = excitation_of(result.metadata).excitation_period
    if repeats <= MOST_PERIODS:
        # Lines of the shafts are resolved by a whole period of the excitation.
        periods = max(DEFAULT_PERIODS, repeats)
    if isinstance(recorded, int) and recorded > 0:
        periods = min(periods, recorded)
    return periods


def _named(switch: str, result: Result) -> dict[str, Any]:
    """Return name and width of a switch; some versions of panel cannot change the name later."""
    name = switch.replace("_", " ").capitalize()
    if switch in result.axes:
        name = plain_text(axis_label(result, switch, 200))
    # About 7 pixels for each letter of the name, within a narrow window.
    width = WIDEST if switch == "variable" else min(max(170, 7 * len(name)), WIDEST)
    return {"name": name, "width": width, "stylesheets": ["label { white-space: normal; }"]}


def _worded(result: Result, names: Sequence[str]) -> dict[str, str]:
    """Return names of variables by their labels, with units; equal labels get their names."""
    labels = [plain_text(axis_label(result, name, 200)) for name in names]
    several = {label for label in labels if labels.count(label) > 1}
    pairs = zip(labels, names, strict=True)
    return {f"{label} [{name}]" if label in several else label: name for label, name in pairs}


def _is_physical(result: Result) -> bool:
    """Whether all variables can be converted to physical units."""
    few = result.sel(None, **{axis: result[axis][0] for axis in result.axes})
    try:
        few.physical()
    except ConfigurationError:
        return False
    return True


def _marked(marks: Sequence[Span], plot: Any, _element: Any) -> None:
    """Draw marks into a chart whenever it is redrawn, and keep its frame."""
    # A fixed border: longer tick labels would move the frame and redraw the chart.
    plot.state.min_border_left = 130
    plot.state.axis.axis_label_text_font_style = "normal"
    plot.state.toolbar.logo = None
    if marks[0] not in plot.state.center:
        plot.state.center = [*plot.state.center, *marks]


def _is_number(value: object) -> bool:
    """Whether a value is a number within the range of sweeps."""
    return isinstance(value, float | int) and -LARGEST_VALUE <= value <= LARGEST_VALUE


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__
