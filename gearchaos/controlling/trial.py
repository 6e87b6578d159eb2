"""Try a controller from many starts: its capture, its effort, and what it changes."""

from contextlib import suppress
from typing import Any, NamedTuple

import gearchaos_kernels as kernels
import numpy as np

from gearchaos.arrays import Floats
from gearchaos.controlling.controller import Controller
from gearchaos.engine.kept import variables_of
from gearchaos.engine.orbit_metadata import states_of
from gearchaos.engine.run_plan import plan_run
from gearchaos.errors import ConfigurationError
from gearchaos.figures.control import ControlDrawing
from gearchaos.outputs.listing import Catalogue
from gearchaos.records.contact import contact_summary
from gearchaos.records.control import ControlledMotion
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.reading.physical_units import in_physical_units

COMPARED_PERIODS = 200
"""Mesh periods over which motions with and without control are compared."""

SHOWN_PERIODS = 40
"""Excitation periods of the motions that are drawn."""


class ControlTrial(NamedTuple):
    """A controller tried from many starts.

    Attributes
    ----------
    controller : Controller
        The controller.
    motion : ControlledMotion
        The motions with control.
    free, held : array, shape (samples, states)
        The last mesh periods of a motion without control, and of one with it.
    before, after : dict of str to float
        Means over all starts of contact, loads and transmission error, without control and after
        the trial; in physical units where the configuration determines them.
    units : dict of str to str
        The unit of each of these means, "1" for a pure number.
    """

    controller: Controller
    motion: ControlledMotion
    free: Floats
    held: Floats
    before: dict[str, float]
    after: dict[str, float]
    units: dict[str, str]

    def drawing(self) -> ControlDrawing:
        """Return the contents of a page about the trial.

        Returns
        -------
        ControlDrawing
            See `figures.control_page`.

        Examples
        --------
        ::

            gearchaos.figures.control_page(trial.drawing())
        """
        controller = self.controller
        scale, words = _drawn_input(controller)
        target, run = controller.maps.points, plan_run(controller.system.config)
        named = {one.name: one for one in states_of(run)}
        first, rate = (named[f"section_{name}"] for name in controller.system.states[:2])
        return ControlDrawing(
            motion=self.motion,
            scale=scale,
            words=words,
            target=target,
            repeats=controller.system.repeats_after,
            free=self.free,
            held=self.held,
            states=(first, rate),
            periods=self.periods,
        )

    @property
    def periods(self) -> str:
        """The word for the periods of the excitation."""
        return self._catalogue.worded("mesh periods")

    @property
    def _catalogue(self) -> Catalogue:
        """The outputs of the model."""
        return plan_run(self.controller.system.config).lanes.model.catalogue


UNITS = {"Nm": "N m", "force": "", "": ""}
"""How the units of `Controller.unit` are written."""


def _drawn_input(controller: Controller) -> tuple[float, str]:
    """Return the factor of inputs in a figure, and the label of the axis."""
    name = controller.actuator
    if controller.load:
        return 100.0 / abs(controller.load), f"Change of the {name} (%)"
    size, unit = controller.unit
    return size, f"Change of {name}" + f" ({UNITS[unit]})" * bool(UNITS[unit])


def try_controller(controller: Controller, starts: int, periods: int) -> ControlTrial:
    """Integrate motions from many starts with control, and compare them with those without."""
    begin = controller.starts(starts)
    motion = controller.run(begin, periods)
    repeats = controller.system.repeats_after
    # The excitation begins again where the measured periods begin.
    tried = -(-periods // repeats) * repeats
    # A whole period of the excitation, unless it is so long that its motion covers the panel.
    shown = SHOWN_PERIODS * repeats if repeats <= SHOWN_PERIODS else SHOWN_PERIODS
    plan = controller.system.plan._replace(
        transient_periods=0, recorded_periods=shown, section_points=0, history_periods=shown
    )
    best = np.array([np.argmin(motion.distance[:, -1])])
    controlled = controller.lanes(starts)
    alone = controller.equations.of(np.zeros(starts, dtype=np.intp))
    free = kernels.integrate(controller.system.equations, begin[:1], plan)
    # From its start: a state alone has neither the estimate of the controller nor its noise.
    held = kernels.integrate(
        controlled.of(best), begin[best], plan._replace(transient_periods=tried)
    )
    before = _measures(controller, alone, begin, 0)
    after = _measures(controller, controlled, begin, tried)
    units = _to_physical_units(controller, before, after)
    return ControlTrial(controller, motion, free.history[0], held.history[0], before, after, units)


def _measures(
    controller: Controller, system: kernels.LaneSystem, begin: Floats, transient: int
) -> dict[str, float]:
    """Return means over lanes of contact, loads and transmission error, by name.

    ``begin`` (lanes, states): states at the beginning of ``transient`` mesh periods that come
    before those over which motions are compared.
    """
    run = plan_run(controller.system.config)
    whole = controller.system.repeats_after
    periods = -(-COMPARED_PERIODS // whole) * whole
    plan = controller.system.plan._replace(
        transient_periods=transient,
        recorded_periods=periods,
        section_points=0,
        loads=True,
        contact=controller.system.equations.clearance,
    )
    outcome = kernels.integrate(system, begin, plan)
    found: dict[str, Any] = dict(run.lanes.model.loads(outcome.loads, system))
    for number, element in enumerate(run.elements if plan.contact else ()):
        summary = contact_summary(outcome.contact[:, number], periods)
        found |= {f"{name}_{element}": values for name, values in summary.items()}
    return {
        name: float(np.mean(values))
        for name, values in found.items()
        if np.issubdtype(values.dtype, np.floating) and np.isfinite(values).all()
    }


def _to_physical_units(
    controller: Controller, before: dict[str, float], after: dict[str, float]
) -> dict[str, str]:
    """Convert means to physical units where the configuration determines them; return all units."""
    asked = {"outputs.loads": True, "outputs.contact": controller.system.equations.clearance}
    run = plan_run(controller.system.config.replace(asked))
    described, units = {one.name: one for one in variables_of(run)}, dict[str, str]()
    for name in dict.fromkeys([*before, *after]):
        variable = described.get(name)
        units[name] = "1" if variable is None else variable.units
        for means in (before, after):
            if variable is None or name not in means:
                continue
            one = np.full((1,) * len(variable.dims), means[name])
            with suppress(ConfigurationError):
                shown, value = in_physical_units(variable, one, run.lanes.parameters)
                means[name], units[name] = float(np.ravel(value)[0]), shown.units
    return units


def facts_of(trial: ControlTrial) -> dict[str, Any]:
    """Return what a trial found, by name.

    Efforts are shares of the steady input, None if that is 0, and in the unit of the input.
    """
    controller, motion = trial.controller, trial.motion
    captured = int(motion.captured.sum())
    size = np.abs(motion.inputs)
    held = size[motion.captured, -1]
    efforts = {
        "largest_effort": float(size.max()),
        "mean_effort": float(size.mean()),
        "final_effort": float(held.max()) if captured else None,
    }
    low, high = wilson_interval(captured, len(motion.captured)).tolist()
    times = motion.capture_time[motion.captured]
    return {
        "period": controller.orbit.period,
        "multipliers": controller.multipliers,
        "input_shares": controller.shares,
        "closed_multipliers": controller.closed_multipliers,
        "starts": len(motion.captured),
        "mesh_periods": motion.inputs.shape[1],
        "captured": captured,
        "captured_share": captured / len(motion.captured),
        "captured_low": low,
        "captured_high": high,
        "capture_median": float(np.median(times)) if times.size else None,
        "capture_95_percent": float(np.percentile(times, 95)) if times.size else None,
        "actuator": controller.actuator,
        **_scaled(efforts, 1.0 / abs(controller.load) if controller.load else None),
        **_in_unit(efforts, controller),
        "before": trial.before,
        "after": trial.after,
        "units": trial.units,
    }


def _scaled(efforts: dict[str, float | None], factor: float | None) -> dict[str, float | None]:
    """Return efforts times a factor; all are None without one."""
    return {
        name: None if value is None or factor is None else value * factor
        for name, value in efforts.items()
    }


def _in_unit(efforts: dict[str, float | None], controller: Controller) -> dict[str, float | None]:
    """Return efforts in the unit of the input, with its name; nothing if it is not known."""
    size, unit = controller.unit
    if not unit:
        return {}
    return {f"{name}_{unit}": value for name, value in _scaled(efforts, size).items()}
