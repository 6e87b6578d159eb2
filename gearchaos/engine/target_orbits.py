"""The orbit on which controllers keep the lanes: found once, then followed along a parameter."""

from typing import NamedTuple

import gearchaos_kernels as kernels
import numpy as np

from gearchaos.arrays import Floats, Integers
from gearchaos.configuration.tables import OF_CONTROLLERS, of_the_machine
from gearchaos.dynamics.arclength import along_the_way
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.dynamics.branches import TracedBranch, trace
from gearchaos.dynamics.embedded import embedded_orbits, record_length
from gearchaos.dynamics.orbits import polish
from gearchaos.engine.lanes import start_states
from gearchaos.engine.run_plan import RunPlan
from gearchaos.errors import ConfigurationError
from gearchaos.models import axis_values
from gearchaos.models.registry import system_of
from gearchaos.progress import count_of
from gearchaos.records.period import coordinate_scale

LEAST_TRANSIENT, MOST_MESH_PERIODS = 300, 30_000
"""Fewest excitation periods before the motion is searched for the orbit.

Fewer have to do where they would have more mesh periods than the second number.
"""

ROUGH = 1e-3
"""Length of the stretch in which special points of the branch are located; none is used."""


class TargetOrbits(NamedTuple):
    """The orbits of a period at all values of the swept parameter of the machine.

    Attributes
    ----------
    parameter : str
        The parameter; empty if only keys of the controller are swept.
    values : array, shape (values,)
        Its values, ascending; a single 0 without a parameter.
    points : array, shape (values, states)
        State at mesh phase 0; NaN where the orbit does not exist.
    found_at : float
        The value at which the motion was searched for the orbit.
    """

    parameter: str
    values: Floats
    points: Floats
    found_at: float

    @property
    def exists(self) -> int:
        """Number of values at which the orbit exists."""
        return int(np.isfinite(self.points[:, 0]).sum())

    @property
    def place(self) -> str:
        """Where the orbit was found, in words; empty without a parameter."""
        return f" at {self.parameter} = {self.found_at:g}" if self.parameter else ""


def machine_at(run: RunPlan, parameter: str, values: Floats) -> kernels.LaneSystem:
    """Return the systems without control at values (lanes,) of the parameter, "" for none."""
    # A key of the controller, which the machine does not have, gives the number of lanes.
    name = parameter or next(iter(OF_CONTROLLERS))
    return system_of(run.config, {name: values}, run.lanes.effects)


def target_orbits(run: RunPlan) -> TargetOrbits:
    """Find the orbit that [control] describes, and follow it to all values of the sweep.

    Raises ConfigurationError if the motion does not come near such an orbit.
    """
    control = run.config.control
    assert control is not None
    swept = [sweep.parameter for sweep in of_the_machine(run.config).values()]
    parameter = swept[0] if swept else ""
    values = axis_values(run.config)[parameter] if parameter else np.zeros(1)
    middle = float(values[values.size // 2])
    found_at = middle if control.found_at is None else control.found_at
    empty = np.full((values.size, len(run.lanes.states)), np.nan)
    wanted = TargetOrbits(parameter, values, empty, found_at)
    point = _found(run, wanted)
    if values.size == 1 and values[0] == found_at:
        wanted.points[0] = point
    else:
        branch = _branch(run, wanted, point)
        _fill(run, wanted, branch)
    return wanted


def _found(run: RunPlan, wanted: TargetOrbits) -> Floats:
    """Return the state (states,) of the orbit at the value at which it is searched for."""
    control, plan = run.config.control, run.plan
    assert control is not None
    system = machine_at(run, wanted.parameter, np.array([wanted.found_at]))
    repeats = system.repeats_after
    least = min(LEAST_TRANSIENT, -(-MOST_MESH_PERIODS // repeats))
    transient = max(-(-plan.transient_periods // repeats), least) * repeats
    record = plan.over(record_length(repeats) * repeats, transient)
    start = start_states(run.config, system, np.zeros(1, dtype=np.intp))
    outcome = kernels.integrate(system, start, record)
    found = np.zeros((0, start.shape[1]))
    if outcome.status[0] == kernels.Status.OK:
        section = outcome.every(repeats).section[0]
        found = embedded_orbits(system, section, control.period, plan).points
    if not len(found):
        raise ConfigurationError(
            f"{run.config.source}: no orbit of period {control.period} was found near the motion"
            f"{wanted.place}; choose another control.period or control.found_at"
        )
    if control.number >= len(found):
        raise ConfigurationError(
            f"{run.config.source}: control.number = {control.number}: found only "
            f"{count_of(len(found), 'orbit')} of period {control.period} near the motion"
            f"{wanted.place}; choose a smaller control.number, or another control.period or "
            "control.found_at"
        )
    point: Floats = found[control.number]
    return point


def _branch(run: RunPlan, wanted: TargetOrbits, point: Floats) -> TracedBranch:
    """Return the branch through a point (states,), over the range of the parameter."""
    control, values = run.config.control, wanted.values
    assert control is not None

    def systems(at: Floats) -> kernels.LaneSystem:
        return machine_at(run, wanted.parameter, at)

    over = BranchRange(systems, float(values[0]), float(values[-1]))
    scale = coordinate_scale(point[np.newaxis, np.newaxis])[0]
    curve = over.curve(run.plan, control.period, scale)
    share = over.share(np.array(wanted.found_at))
    start = curve.corrected(np.append(point / scale, share), along_the_way(point.size))
    if start is None:
        raise ConfigurationError(
            f"{run.config.source}: the orbit{wanted.place} cannot be followed from there; choose "
            "another control.found_at"
        )
    return trace(curve, start, located=ROUGH)


def _fill(run: RunPlan, wanted: TargetOrbits, branch: TracedBranch) -> None:
    """Write the points of a branch at all values; of several the least unstable one."""
    values = wanted.values
    numbers, guesses = crossings(branch.places, (values - values[0]) / (values[-1] - values[0]))
    if not numbers.size:
        return
    system = machine_at(run, wanted.parameter, values[numbers])
    periods = np.full(numbers.size, branch.period, dtype=np.int32)
    found = polish(system, guesses * branch.curve.scale, periods, run.plan)
    there = np.flatnonzero(found.converged)
    least_last = there[np.argsort(-np.abs(found.multipliers[there, 0]), kind="stable")]
    wanted.points[numbers[least_last]] = found.points[least_last]


def crossings(places: Floats, shares: Floats) -> tuple[Integers, Floats]:
    """Return where a line through places (places, states + 1) has some shares, its last column.

    Returns the number of the share of each crossing (crossings,), and the states (crossings,
    states) on the line.
    """
    one, other = places[:-1], places[1:]
    run = other[:, -1] - one[:, -1]
    part = np.divide(
        shares[:, np.newaxis] - one[:, -1],
        run,
        out=np.full((shares.size, run.size), np.nan),
        where=run != 0.0,
    )
    numbers, stretches = np.nonzero((part >= 0.0) & (part <= 1.0))
    between = part[numbers, stretches][:, np.newaxis]
    states = one[stretches] + between * (other - one)[stretches]
    return numbers, states[:, :-1]
