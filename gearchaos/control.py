"""Keep a machine on a periodic orbit by small changes of an input, once per mesh period.

A periodic orbit of the motion is found, usually an unstable one within chaos. A linear controller
is designed from the linearised map over a mesh period, and tried from many states of the motion
without control. The command prints the multipliers with and without control, the share of the
starts that it captures with its 95 % interval, the time and effort this takes, and contact, loads
and transmission error before and after.

The controller knows all states, or measures those of --measure and estimates the others. The input
is the load of a gear pair, a force of a linear machine, or the torque on a shaft of a train. It
changes only where less than --limit is needed, and is constant over a mesh period.

The table goes to stdout, everything else to stderr. With --output, a figure is drawn as well.
"""

import json
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.options import ConfigFile, Option, Overwrite, Place, Threads, placed_coordinates
from gearchaos.progress import count_of, say

if TYPE_CHECKING:
    from gearchaos.controlling.controller import Controller
    from gearchaos.models import Configuration


class ControlOptions(NamedTuple):
    """Options of ``gearchaos control``."""

    config: ConfigFile
    at: Annotated[
        tuple[Place, ...],
        Option("value of a swept parameter; may be repeated", "NAME=VALUE"),
    ] = ()
    period: Annotated[int, Option("period of the orbit (default: 1)", "N", low=1, high=64)] = 1
    orbit: Annotated[
        int, Option("which orbit of this period, the least unstable is 0", "K", low=0)
    ] = 0
    method: Annotated[
        Literal["lqr", "placement", "delayed"],
        Option("linear-quadratic gain (default), pole placement, or delayed feedback"),
    ] = "lqr"
    limit: Annotated[
        float, Option("largest change of the input, as a share of it (default: 0.1)", "SHARE")
    ] = 0.1
    limit_absolute: Annotated[
        float | None,
        Option("largest change of the input in its unit: N m, or that of the forces", "VALUE"),
    ] = None
    actuator: Annotated[
        str | None, Option("the input: a force or a shaft (default: the only one)", "NAME")
    ] = None
    input_weight: Annotated[float, Option("weight of the input in the cost (default: 10)", "R")] = (
        10.0
    )
    measure: Annotated[
        tuple[str, ...], Option("state that is measured; may be repeated (default: all)", "STATE")
    ] = ()
    noise: Annotated[
        float, Option("standard deviation of the noise, in scales of the states", "SHARE")
    ] = 0.0
    seed: Annotated[int, Option("seed of the noise (default: 0)", "N", low=0)] = 0
    starts: Annotated[int, Option("number of starts (default: 1000)", "N", low=1, high=10**6)] = (
        1000
    )
    periods: Annotated[int, Option("mesh periods (default: 1000)", "N", low=1, high=10**7)] = 1000
    output: Annotated[
        Path | None,
        Option("draw a figure, such as control.png", "FIGURE", ("-o", "--output"), file=True),
    ] = None
    json: Annotated[bool, Option("print JSON")] = False
    overwrite: Overwrite = False
    threads: Threads = None


def _control(options: ControlOptions) -> None:
    from gearchaos.controlling.trial import facts_of, try_controller
    from gearchaos.engine.running import choose_threads, compiling
    from gearchaos.figures.control import control_page
    from gearchaos.figures.page import check_figures, save_figure
    from gearchaos.results.reading.overview import json_values

    choose_threads(options.threads)
    if options.output:
        check_figures([options.output], [options.config], options.overwrite)
    began = perf_counter()
    with compiling():
        try:
            controller = _controller(options)
            say(f"trying {options.starts} starts for {options.periods} periods each")
            check()
            trial = try_controller(controller, options.starts, options.periods)
            check()
        except KeyboardInterrupt as interrupt:
            interrupt.add_note("nothing is kept or written; fewer --starts take less time")
            raise
    say(f"{options.starts} starts, {perf_counter() - began:.1f} s")
    facts = facts_of(trial)
    if options.json:
        complex_names = ("multipliers", "closed_multipliers")
        written = {
            name: [[one.real, one.imag] for one in value] if name in complex_names else value
            for name, value in facts.items()
        } | {"input_shares": facts["input_shares"].tolist()}
        print(json.dumps(json_values(written), indent=1))
    else:
        print("\n".join(table(facts, trial.periods)))
    if options.output:
        save_figure(control_page(trial.drawing()), options.output)


def _controller(options: ControlOptions) -> "Controller":
    """Return the controller that the options describe."""
    from gearchaos.controlling.controller import Controller
    from gearchaos.dynamics.controllers import ControlSettings
    from gearchaos.models import load_config
    from gearchaos.system import System

    config = load_config(options.config)
    values = _values(options.at, config)
    system = System(config, values)
    orbits = system.orbits(options.period)
    if options.orbit >= len(orbits):
        raise ConfigurationError(f"{options.config}: {_missing(options, len(orbits))}")
    if orbits[options.orbit].stable:
        say("this orbit is stable: the motion stays on it without control")
    settings = ControlSettings(
        method=options.method,
        input_weight=options.input_weight,
        limit=options.limit,
        measured=options.measure,
        noise=options.noise,
        seed=options.seed,
        actuator=options.actuator,
        limit_absolute=options.limit_absolute,
    )
    return Controller(system, orbits[options.orbit], settings)


def _missing(options: ControlOptions, found: int) -> str:
    """Return why an orbit was not found; ``found``: the number of those of its period."""
    if not found:
        return (
            f"no orbit of period {options.period} was found near the motion; choose another "
            "--period or another value with --at (chaos in several bands comes near orbits of "
            "multiples of their number only)"
        )
    return (
        f"found only {count_of(found, 'orbit')} of period {options.period} near the motion, and "
        f"--orbit {options.orbit} is not among them; choose one below {found}, or another --period"
    )


def _values(places: tuple[Place, ...], config: "Configuration") -> dict[str, float]:
    """Return the value of each swept parameter; one without a name belongs to the only one.

    A name may be that of a parameter, or that of its axis in results.
    """
    from gearchaos.models import swept_values
    from gearchaos.outputs.names import axis_name

    swept = {one.parameter: swept_values(one) for one in config.sweeps.values()}
    names = {axis_name(one): one for one in (*(place.axis for place in places), *swept)}
    placed = placed_coordinates(places, [axis_name(one) for one in swept])
    values = {names[axis]: value for axis, value in placed.items()}
    for parameter, among in swept.items():
        low, high = float(among.min()), float(among.max())
        if parameter not in values and low < high:
            option = "--at VALUE" if len(swept) == 1 else f"--at {parameter}=VALUE"
            raise ConfigurationError(
                f"{config.source}: {parameter} is swept from {low:g} to {high:g}, and control "
                f"needs one value of it: give {option}"
            )
        if not low <= values.get(parameter, low) <= high:
            say(f"{parameter} = {values[parameter]:g} lies outside the sweep, {low:g} to {high:g}")
    return values


MEASURES = {
    "load_factor_largest": "largest mesh force over the static one",
    "transmission_error_peak_to_peak": "transmission error, peak to peak",
}
"""Names of the outputs that are compared, in words."""

OF_ELEMENTS = {
    "mesh_force_largest_": "largest mesh force, {}",
    "time_apart_": "share of the time apart, {}",
    "force_largest_": "largest force, {}",
    "gap_peak_to_peak_": "gap, peak to peak, {}",
}
"""Beginnings of the names of outputs of elements that are compared, in words with the element."""


def table(facts: dict[str, Any], periods: str) -> list[str]:
    """Return what a trial found as lines of text; ``periods``: the word for its periods."""
    lines = [
        f"orbit of period {facts['period']}",
        f"  {'multipliers':20} {'with control':20} input acts",
    ]
    rows = zip(
        facts["multipliers"], facts["closed_multipliers"], facts["input_shares"], strict=True
    )
    lines += [f"  {_number(a):20} {_number(b):20} {share:.1e}" for a, b, share in rows]
    if abs(facts["closed_multipliers"][0]) >= 1.0:
        lines += ["the orbit is unstable with this controller, too"]
    lines += [
        f"captured: {facts['captured']} of {facts['starts']} starts, "
        f"{_percent(facts['captured_share'])} ({_percent(facts['captured_low'])} to "
        f"{_percent(facts['captured_high'])}) after {facts['mesh_periods']} {periods}"
    ]
    if facts["captured"]:
        lines += [
            f"capture takes {facts['capture_median']:.0f} {periods} (median), "
            f"{facts['capture_95_percent']:.0f} for 95 %"
        ]
    lines += [
        f"largest change of {facts['actuator']} {_effort(facts, 'largest_effort')}, mean "
        f"{_effort(facts, 'mean_effort')}"
    ]
    if facts["captured"]:
        lines += [f"once captured {_effort(facts, 'final_effort')}"]
    physical = any(unit != "1" for unit in facts["units"].values())
    of = "" if physical else ", lengths and forces in the units of the equations"
    lines += [f"means over the starts{of}:", f"{'':42} before   after"]
    for name, value in facts["before"].items():
        words, unit = _measure(name), facts["units"][name]
        if words and name in facts["after"]:
            words += f" ({unit})" * (unit != "1")
            lines += [f"  {words:40} {value:<8.4g} {facts['after'][name]:.4g}"]
    return lines


def _measure(name: str) -> str:
    """Return an output in words, empty if it is not compared."""
    for begin, words in OF_ELEMENTS.items():
        if name.startswith(begin):
            return words.format(name.removeprefix(begin).replace("_", " "))
    return MEASURES.get(name, "")


def _number(value: complex) -> str:
    """Return a multiplier as text."""
    # Adding zero removes the sign of what is rounded to zero.
    real = f"{round(value.real, 4) + 0.0:.4f}"
    if abs(value.imag) < 1e-12:
        return real
    return f"{real} {'+' if value.imag > 0 else '-'} {abs(value.imag):.4f}i"


def _percent(share: float) -> str:
    """Return a share as a percentage."""
    return f"{100.0 * share:.1f} %"


def _effort(facts: dict[str, Any], name: str) -> str:
    """Return an effort as a percentage, and in the unit of the input where that is known."""
    share, torque, force = (facts.get(f"{name}{end}") for end in ("", "_Nm", "_force"))
    in_unit = f"{force:.3g}" if force is not None else ""
    in_unit = f"{torque:.3g} N m" if torque is not None else in_unit
    if share is None:
        return in_unit
    return f"{100.0 * share:.3g} %" + f" ({in_unit})" * bool(in_unit)


main = Command("control", __doc__, ControlOptions, _control).start(__name__)
