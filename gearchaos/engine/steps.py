"""The number of steps per mesh period of a sweep: stable in every lane, and accurate enough."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import LaneSystem, Outcome, Plan, Status, integrate, maps_are_kept

from gearchaos.arrays import Integers, Mask
from gearchaos.configuration.messages import Fault
from gearchaos.configuration.methods import DEFAULT, METHODS
from gearchaos.configuration.run_tables import DEFAULT_STEPS, MOST_STEPS_PER_PERIOD
from gearchaos.dynamics import stability
from gearchaos.dynamics.hidden_modes import hidden_error
from gearchaos.dynamics.labelling import Labelled
from gearchaos.dynamics.largest_exponents import largest_exponents
from gearchaos.dynamics.plans import plan_of
from gearchaos.dynamics.remainders import EPSILON
from gearchaos.engine.claims import columns_of
from gearchaos.engine.lanes import Lanes
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.outputs.names import REALISATION
from gearchaos.records.difference import Difference, Solution, bound, difference
from gearchaos.records.label import PERIODIC, UNRESOLVED
from gearchaos.records.period import POINTS_NEEDED, RETURNS, motion_period

LANES_AT_ONCE = 2**14
"""Number of lanes whose stability is examined together."""
PILOT_LANES = 48
"""Largest number of lanes on which the error is measured, spread over the sweep."""

MOST_BIAS = 0.05
"""Largest shift of an exponent by the step that is ignored, relative to the exponent."""

SURELY_FINE = 8
"""Multiple of the stability limit at which steps shift no exponent that matters."""

PILOT_PERIODS = 150
"""Mesh periods in which a lane settles on its grid, and mesh periods that are compared."""

FINEST_GRID = 25_600
"""Largest number of steps of the search, where the method needs a limit."""


class Candidate(NamedTuple):
    """A number of steps per period and its errors against a finer grid.

    Attributes
    ----------
    steps : int
        Steps per mesh period.
    section_error, exponent_error : float
        Errors that 95 % of the lanes with a common period do not exceed.
    changed_share : float
        Share of the lanes that settle on a different motion.
    periodic_share : float
        Share of the lanes that are periodic on all grids.
    mode : str
        Description of the integration, if given.
    seconds : float
        Duration of the integration in seconds, NaN if not measured.
    """

    steps: int
    section_error: float
    exponent_error: float
    changed_share: float
    periodic_share: float
    mode: str = ""
    seconds: float = math.nan

    @property
    def error(self) -> float:
        """The larger of the two errors; NaN where no lane is periodic."""
        return float(np.fmax(self.section_error, self.exponent_error))


def stable_steps(lanes: Lanes, given: int | None) -> tuple[int, str]:
    """Return a stable number of steps, and a note.

    By default the number is 200, doubled until it is stable in all lanes. Raises ConfigurationError
    if the given number is unstable in some lanes and must not be raised, or not far enough.
    """
    # Starts, realisations and directions of one value have the same stability.
    every = np.arange(0, len(lanes), lanes.repeats)
    parts = np.split(every, range(LANES_AT_ONCE, every.size, LANES_AT_ONCE))
    needed = [_fewest_stable_steps(lanes.system_of(part)) for part in parts]
    fewest = np.concatenate(needed)
    limit = int(fewest.max())
    steps = _doubled(DEFAULT_STEPS, limit) if given is None else given
    unstable = every[fewest > steps]
    if limit <= steps:
        return steps, ""
    integration, beyond = lanes.config.integration, limit > MOST_STEPS_PER_PERIOD
    method = METHODS[integration.method]
    if method.exact and not beyond:
        if integration.steps_per_period is None and limit <= DEFAULT_STEPS:
            return steps, ""
        return steps, (
            f"integration.steps_per_period = {steps}: {DEFAULT.title} would need {limit} steps to "
            f"be stable; {method.title} have no such limit"
        )
    if integration.unstable == "refuse" or beyond:
        raise ConfigurationError(_fault(lanes, limit, unstable, given).text(lanes.config.source))
    return limit, (
        f"integration.steps_per_period raised from {steps} to {limit}, the stability limit "
        f"of {unstable.size * lanes.repeats} of {len(lanes)} lanes"
    )


def _fewest_stable_steps(system: LaneSystem) -> Integers:
    """Return the smallest stable number of steps of every lane, (lanes,).

    Where only the excitation differs, such as its amplitude, all lanes have the modes of the first.
    """
    stiffnesses, numbers = system.branch_stiffnesses(), system.map_parameters()
    alike = (numbers == numbers[:1]).all() and (stiffnesses == stiffnesses[:, :1]).all()
    fewest = stability.fewest_stable_steps(system.of([0]) if alike else system)
    return np.broadcast_to(fewest, system.lanes)


def _doubled(steps: int, limit: int) -> int:
    """Double a number of steps until it reaches a limit, up to the largest valid number."""
    while steps < min(limit, MOST_STEPS_PER_PERIOD):
        steps *= 2
    return min(steps, MOST_STEPS_PER_PERIOD)


def coarse_steps(lanes: Lanes, steps: int) -> str:
    """Return a note that stable steps are too coarse for exponents; empty if they are not.

    A standard error does not show this, because it describes the length of the record.
    """
    system = lanes.system_of(lanes.spread(PILOT_LANES))
    method = lanes.config.integration.method
    if METHODS[method].exact:
        return ""
    if steps >= SURELY_FINE * np.max(stability.fewest_stable_steps(system)):
        return ""
    bias, true = stability.exponent_bias(system, steps, method)
    worst = int(np.argmax(np.abs(bias) - MOST_BIAS * np.abs(true)))
    if abs(bias[worst]) <= MOST_BIAS * abs(true[worst]):
        return ""
    return (
        f"{steps} steps per period shift Lyapunov exponents by about {bias[worst]:.1g} (that of "
        f"the system in contact is {true[worst]:.2g}), and no standard error shows it; raise "
        "integration.steps_per_period, or measure it with integration.error_check"
    )


def needless_maps(lanes: Lanes, plan: Plan) -> str:
    """Return a note that there are more maps than can be kept, and fewer would be enough."""
    method, enough = METHODS[plan.method], METHODS[plan.method].steps
    if enough is None or plan.records_steps or plan.steps_per_period <= enough:
        return ""
    if maps_are_kept(lanes.system_of(np.arange(min(len(lanes), LANES_AT_ONCE))), plan):
        return ""
    return (
        f"integration.steps_per_period = {plan.steps_per_period}: lanes that differ in more than "
        f"{lanes.model.shared_inputs} do not share {method.title}, and there are too many to keep: "
        f"each integration makes them again; {enough} steps are as exact and much faster"
    )


def _fault(lanes: Lanes, limit: int, unstable: Integers, steps: int | None) -> Fault:
    """Return the fault of an unstable number of steps in the lanes ``unstable``."""
    places = []
    swept = lanes.values_of(unstable)
    swept.pop(REALISATION, None)
    for parameter, values in swept.items():
        low, high = np.min(values), np.max(values)
        places.append(
            f"{parameter} " + (f"= {low:.6g}" if low == high else f"from {low:.6g} to {high:.6g}")
        )
    remedy = f'raise it to {limit} or more, or set integration.unstable = "raise"'
    if limit > MOST_STEPS_PER_PERIOD:
        remedy = f"check the magnitudes behind it: there are at most {MOST_STEPS_PER_PERIOD} steps"
    return Fault(
        "integration.steps_per_period",
        f"{DEFAULT.title} is unstable below {limit} steps per period for "
        f"{unstable.size * lanes.repeats} of {len(lanes)} lanes ({', '.join(places)})",
        remedy,
        steps,
    )


def solution_of(
    system: LaneSystem,
    outcome: Outcome,
    plan: Plan,
    kept: Sequence[str],
    labelled: Labelled | None = None,
) -> Solution:
    """Return the quantities of integrated lanes that are compared between grids.

    These are the sections of the kept states, or of all states if none is kept. Without labels, the
    period follows from the section and other motions are not distinguished. Every error is at least
    one rounding error per step of a mesh period.
    """
    outcome = outcome.every(system.repeats_after)
    if labelled is None:
        period, state = motion_period(outcome.section), outcome.end_state
        motion = np.where(period > 0, PERIODIC, UNRESOLVED)
    else:
        period, state, motion = labelled.labels.period, labelled.state, labelled.labels.motion
    exponent = np.full(period.shape, np.nan)
    if plan.tangent:
        exponent = largest_exponents(system, outcome, plan, period, state).values
    section = outcome.section[..., columns_of(system, kept)]
    size = np.max(np.abs(outcome.section), axis=(1, 2), initial=0.0)
    rounding = EPSILON * plan.steps_per_period
    return Solution(
        section,
        exponent,
        outcome.status != Status.OK,
        motion,
        period,
        section_rounding=rounding * size,
        exponent_rounding=rounding / system.mesh_period,
    )


def pilot(lanes: Lanes, plan: Plan, count: int, finest: int) -> tuple[int, Callable[..., Solution]]:
    """Prepare the integration of some lanes of a sweep on several grids, for comparison.

    ``count``: number of lanes; ``finest``: steps per period of the common transient, after which a
    lane settles on the same one of several coexisting motions on each grid. Returns the number of
    lanes that exist, and a function of ``(steps, resolved, method)`` that returns the `Solution`;
    with ``hidden=True`` it includes the errors that a comparison of grids does not show.
    """
    numbers = lanes.spread(count)
    system = lanes.system_of(numbers)
    # With the tangent of the plan: the kernel is then the one that is used next.
    settling = Plan(finest, plan.transient_periods, 0, 0, tangent=plan.tangent, method=plan.method)
    check()
    common = integrate(system, lanes.start_of(numbers), settling).end_state

    repeats = system.repeats_after
    periods = repeats * max(RETURNS, math.ceil(PILOT_PERIODS / repeats))

    def solution(steps: int, resolved: bool, method: str, hidden: bool = False) -> Solution:
        check()
        # Loads and summaries of states are not compared.
        grid = plan_of(
            lanes.config,
            steps_per_period=steps,
            transient_periods=periods,
            recorded_periods=periods,
            section_points=min(POINTS_NEEDED * repeats, periods),
            resolved=resolved,
            method=method,
            tangent=plan.tangent,
        )
        outcome = integrate(system, common, grid)
        found = solution_of(system, outcome, grid, lanes.config.outputs.section)
        if not hidden:
            return found
        ended = outcome.end_state
        error = hidden_error(system, grid, found.period, ended, found.exponent)
        return found._replace(hidden=error)

    return numbers.size, solution


def choose_steps(
    solution: Callable[[int], Solution],
    coarsest: int,
    tolerance: float,
    source: str,
    finest: int = FINEST_GRID,
    left: float = 0.0,
) -> list[Candidate]:
    """Double the steps until the error is small enough; the last candidate is the choice.

    ``solution`` integrates the trial lanes with a number of steps per period from a common state;
    ``tolerance``: largest error of section and exponent; ``source``: name of the configuration in
    messages; ``finest``: limit of the steps beyond the first comparison; ``left``: distance of the
    section from its orbit after the transient. Raises ConfigurationError, with the error that was
    reached, if the tolerance is not reached, or if no lane is periodic.
    """
    found: dict[int, Solution] = {}
    candidates: list[Candidate] = []
    steps = coarsest
    while not candidates or 4 * steps <= finest:
        for grid in (steps, 2 * steps, 4 * steps):
            if grid not in found:
                found[grid] = solution(grid)
        coarse, middle = (difference(found[n * steps], found[4 * steps]) for n in (1, 2))
        periodic = (coarse.period > 0) & (middle.period > 0)
        tried = candidate(steps, coarse, periodic)
        candidates.append(tried._replace(section_error=tried.section_error + left))
        if np.isnan(candidates[-1].section_error):
            raise ConfigurationError(
                f"{source}: integration.tolerance = {tolerance:g}: none of the lanes that were "
                "tried moves periodically, so that no error can be measured; give "
                "integration.steps_per_period alone"
            )
        if candidates[-1].error <= tolerance:
            return candidates
        steps *= 2
    raise ConfigurationError(
        f"{source}: integration.tolerance = {tolerance:g}: is not reached, but "
        f"{candidates[-1].error:.1e} with {candidates[-1].steps} steps per period; raise the "
        "tolerance"
    )


def candidate(steps: int, found: Difference, periodic: Mask) -> Candidate:
    """Return the errors of steps from their difference to a finer grid; ``periodic`` (lanes,)."""
    return Candidate(
        steps,
        bound(found.section_error[periodic]),
        bound(found.exponent_error[periodic]),
        float(np.mean(found.changed)),
        float(np.mean(periodic)),
    )
