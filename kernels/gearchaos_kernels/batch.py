"""Integrate a batch: split lanes into blocks, run the blocks in parallel, return arrays."""

from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import get_num_threads, prange
from numpy.typing import NDArray

from gearchaos_kernels.block import Batch, integrate_block
from gearchaos_kernels.compilation import count_up, driver
from gearchaos_kernels.control import Actuation, Feedback
from gearchaos_kernels.memory.rows import LANES, line_of
from gearchaos_kernels.methods.protocol import Share, with_periods
from gearchaos_kernels.methods.registry import METHODS
from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.plan import Floats, Outcome, Plan, Schedule, Status
from gearchaos_kernels.recorders.contact import ROWS as CONTACT_ROWS
from gearchaos_kernels.recorders.loads import SIGNAL_ROWS, signals_of
from gearchaos_kernels.recorders.registry import RECORDERS, Recorded
from gearchaos_kernels.requests import require_fitting
from gearchaos_kernels.scene import Scene, flag, provider_of

LARGEST_GROWTH = 200.0
"""Logarithm of the growth or decay allowed between two scalings; numbers overflow near 700."""


@driver
def _integrate_blocks(threads, next_block, batch, tables, plan, outcome, control, scene):
    """Integrate all blocks; ``next_block``, shape (1,), counts those that threads have taken.

    Every thread takes the next block when it has finished one. Blocks take different times: some
    cross clearance boundaries far more often, and another program may be using a core.
    """
    # The number of threads is an argument: code that reads it itself contains an address of this
    # process and cannot be cached.
    for _ in prange(threads):
        number = count_up(next_block)
        while number < batch.blocks.shape[0]:
            integrate_block(number, batch, tables, plan, outcome, control, scene)
            number = count_up(next_block)


def scene_of(system: LaneSystem, plan: Plan) -> Scene:
    """Return the scene that a system, with its controllers, and a plan need."""
    feedback = system.control and system.control.flags()
    return _scene_of(system.flags(), system.clearance, plan, feedback)


@lru_cache(maxsize=256)
def _scene_of(flags: Any, clearance: bool, plan: Plan, feedback: Feedback | None) -> Scene:
    """Return the scene of a model with flags; kept, because short calls follow each other."""
    method, model = METHODS[plan.method], provider_of(flags)
    switches = model.switches(flags)
    resolved = clearance and (plan.resolved or method.always_resolved)
    wanted = [one for one in RECORDERS if one.wanted(plan, resolved)]
    scene = Scene(
        model=flags,
        method=method.flags(),
        recorders=Recorded(*(flag(one in wanted) for one in RECORDERS)),
        clearance=flag(clearance),
        resolved=flag(resolved),
        tangent=flag(plan.tangent),
        before=flag(resolved or any(one.reads_before for one in wanted)),
        switches=flag(switches),
        traced=flag(method.traces and plan.loads and not plan.records_steps),
        jumps=flag(resolved and any(kind.damped_in_contact for kind in model.kinds_of(flags))),
        control=flag(feedback),
        feedback=feedback,
    )
    return replace(scene, stops=flag(method.stops(scene)))


def integrate(
    system: LaneSystem,
    start: Floats,
    plan: Plan,
    *,
    tangent_start: Floats | None = None,
    periods: NDArray[np.integer] | None = None,
) -> Outcome:
    """Integrate a batch of lanes from tau = 0.

    Parameters
    ----------
    system : LaneSystem
        The equations of motion of every lane, with its controllers if it has any.
    start : array, shape (lanes, states)
        States at tau = 0, in the units of the equations.
    plan : Plan
        Method, steps, periods, and what is recorded.
    tangent_start : array, shape (lanes, states), optional
        Tangent vectors at tau = 0; by default all components are equal and the length is 1.
    periods : array of int, shape (lanes,), optional
        At most those of the plan, the default; shorter sections begin with NaN, growth ends with 0.

    Returns
    -------
    Outcome
        Identical bit for bit for any number of threads and any split or order of the lanes.

    Raises
    ------
    ValueError
        If an array does not have its shape, if a number of the plan is out of its range, or if
        method, model or kernels do not support the request, see `LaneSystem.refuses_maps`.

    Examples
    --------
    ::

        outcome = integrate(pairs, start, Plan(200, 300, 100, 100, tangent=True))
    """
    require_fitting(system, plan, {"start": start, "tangent_start": tangent_start}, periods)
    (lanes, states), scene = np.shape(start), scene_of(system, plan)
    outcome, steps_taken = _allocated(lanes, states, plan, scene), np.empty(lanes, dtype=np.intp)
    recorded = _recorded_periods(plan, periods, outcome)
    for prepared in METHODS[plan.method].prepare(system, plan, scene, recorded):
        share = with_periods(prepared, recorded, plan.lanes_together(states))
        steps_taken[share.order] = share.steps[share.order]
        _integrate_share(system, share, _Begin(start, tangent_start), plan, outcome, scene)
    return _per_tau(system, plan, outcome, steps_taken, recorded, scene)


def _tangents(shape: tuple[int, ...], given: Floats | None) -> Floats:
    """Return tangent vectors at tau = 0, (lanes, states)."""
    return np.full(shape, 1.0 / np.sqrt(shape[1])) if given is None else given


def _recorded_periods(
    plan: Plan, periods: NDArray[np.integer] | None, outcome: Outcome
) -> NDArray[np.intp]:
    """Return the recorded periods of every lane; fill what shorter records leave unwritten."""
    recorded = np.full(outcome.status.shape, plan.recorded_periods, dtype=np.intp)
    if periods is not None:
        recorded[:] = periods
        for kept, rest in (outcome.section, np.nan), (outcome.history, np.nan), (outcome.growth, 0):
            kept.fill(rest)
    return recorded


def _require_supported(scene: Scene, plan: Plan, states: int) -> None:
    """Raise ValueError if the model or the kernels cannot record what a plan requests."""
    if plan.orders and not provider_of(scene.model).observed:
        raise ValueError("amplitudes need a model with an observed signal")
    if plan.frame and states > LANES:
        raise ValueError(f"a frame of {states} states is larger than a block of {LANES} lanes")
    if scene.control and not provider_of(scene.model).actuated:
        raise ValueError("control needs a model with a steady input")


class _Begin(NamedTuple):
    """States and tangent vectors at tau = 0, both (lanes, states).

    Tangent vectors that are None have equal components.
    """

    start: Floats
    tangent_start: Floats | None


def _integrate_share(
    system: LaneSystem,
    share: Share,
    begins: _Begin,
    plan: Plan,
    outcome: Outcome,
    scene: Scene,
) -> None:
    """Integrate some lanes and write what is recorded of them into an outcome."""
    given = begins.start, _tangents(begins.start.shape, begins.tangent_start)
    start, tangent_start = (np.ascontiguousarray(one, dtype=np.float64) for one in given)
    chosen = np.array([*_columns(system, plan), _observed_row(scene)], dtype=np.intp)
    orders = np.array([float(order) for order in plan.orders])
    step = system.mesh_period / share.steps
    batch = Batch(
        system.coefficients(step),
        system.scales(step),
        start,
        tangent_start,
        steps_between_scalings(system, share.steps),
        share.order,
        share.blocks,
        share.maps,
        share.lacked,
        share.progress,
        chosen,
        _turns(orders, share.steps),
    )
    control = _actuation(system, step, plan, batch.coefficients, outcome.inputs)
    schedule = Schedule(
        plan.steps_per_period,
        plan.transient_periods,
        plan.first_period,
        plan.more_rows,
    )
    if share.progress.size:
        # Blocks may have begun before, with fewer steps.
        anew = share.order[np.repeat(share.progress[:, 0] == 0.0, share.blocks[:, 1])]
        outcome.status[anew], outcome.diverged_period[anew] = Status.OK, -1
    tables, next_block = system.tables(plan.steps_per_period), np.zeros(1, dtype=np.intp)
    used = _used(batch, scene), tables, schedule, _used(outcome, scene)
    _integrate_blocks(get_num_threads(), next_block, *used, control, scene)
    if share.maps.size:
        unmapped = np.isnan(share.maps[share.blocks[:, 3]])
        lost = np.repeat(unmapped, share.blocks[:, 1])
        outcome.status[share.order[lost]] = Status.TOO_FAST


def _used(arrays: Any, scene: Scene) -> Any:
    """Return a `Batch` or an `Outcome` with None for the arrays that a scene does not use.

    An array among the arguments takes time to compile in every function that passes it on.
    """
    # The controllers have the inputs themselves.
    unused = {"inputs"} if scene.stops else {"inputs", "lacked", "progress"}
    for one in RECORDERS:
        if not getattr(scene.recorders, one.name):
            unused.update(one.arrays)
    return arrays._replace(**dict.fromkeys(unused.intersection(arrays._fields)))


def _actuation(
    system: LaneSystem, step: Floats, plan: Plan, coefficients: Floats, inputs: Floats
) -> Actuation | Floats:
    """Return controllers with how their input acts on lanes; an empty array if there are none.

    ``step`` (lanes,): length of a step in units of tau; ``coefficients``: see `Batch`; ``inputs``:
    see `Outcome`.
    """
    control = system.control
    if control is None:
        return np.zeros(0)
    model = provider_of(system.flags())
    column = model.lane._fields.index(model.actuated)
    noisy = int(np.any(control.noise > 0.0))
    about = np.array([column, plan.first_period, control.begins, control.repeats, noisy])
    given = {name: getattr(control, name) for name in Actuation._fields if name in control._fields}
    given |= {name: _lines(getattr(control, name)) for name in ("points", "gain", "response")}
    for name in "transition", "correction":
        given[f"columns_of_{name}"] = _lines(getattr(control, name).swapaxes(2, 3))
    given["measured"] = np.ascontiguousarray(control.measured)
    # A column of its own: lanes are neighbours in it.
    steady = np.ascontiguousarray(coefficients[:, column])
    strength = system.input_strength(step)
    return Actuation(**given, steady=steady, strength=strength, inputs=inputs, about=about)


def _lines(vectors: Floats) -> Floats:
    """Return vectors of all states as lines, see `line_of`."""
    states = vectors.shape[-1]
    lines = np.zeros((*vectors.shape[:-1], line_of(states)))
    lines[..., :states] = vectors
    return lines


def _turns(orders: Floats, steps: NDArray[np.intp]) -> Floats:
    """Return cosine and sine of the phases by which orders advance in a step; see `Batch`."""
    turns = np.empty((steps.size, orders.size, 2))
    if orders.size:
        phases = 2.0 * np.pi * orders / steps[:, np.newaxis]
        turns[..., 0], turns[..., 1] = np.cos(phases), np.sin(phases)
    return turns


def _columns(system: LaneSystem, plan: Plan) -> list[int]:
    """Return the numbers of the states of a plan."""
    return [system.states.index(name) for name in plan.states]


def _allocated(lanes: int, states: int, plan: Plan, scene: Scene) -> Outcome:
    """Return an outcome whose arrays have the shapes of what is recorded.

    Raises ValueError if the model or the kernels do not support that.
    """
    _require_supported(scene, plan, states)
    elements = provider_of(scene.model).elements(scene.model)
    kept, loads = plan.history_periods, scene.recorders.loads
    in_contact = elements if plan.contact and scene.resolved else 0
    total = plan.transient_periods + plan.recorded_periods
    return Outcome(
        # The threads write every element, so zero-filling would be wasted.
        section=np.empty((lanes, plan.section_points, states)),
        growth=np.empty((lanes, plan.recorded_periods if plan.tangent else 0)),
        end_state=np.empty((lanes, states)),
        end_tangent=np.empty((lanes, states)),
        status=np.full(lanes, Status.OK, dtype=np.uint8),
        diverged_period=np.full(lanes, -1, dtype=np.int32),
        crossings=np.zeros(lanes, dtype=np.int64),
        slowest_crossing=np.full(lanes, np.inf),
        overflows=np.zeros(lanes, dtype=np.int64),
        contact=np.zeros((lanes, in_contact, CONTACT_ROWS)),
        loads=np.full((lanes, signals_of(scene) if loads else 0, SIGNAL_ROWS), np.nan),
        extremes=np.full((lanes, len(plan.states), 2), np.nan),
        amplitudes=np.full((lanes, (len(plan.states) + 1) * len(plan.orders)), np.nan),
        inputs=np.zeros((lanes, total if scene.control else 0)),
        history=np.empty((lanes, kept and kept * plan.steps_per_period + 1, states)),
    )


def _observed_row(scene: Scene) -> int:
    """Return the row of the first observed signal of the model."""
    elements: int = provider_of(scene.model).elements(scene.model)
    row: int = provider_of(scene.recorders).first_row("loads", scene)
    return row + elements


def _per_tau(
    system: LaneSystem,
    plan: Plan,
    outcome: Outcome,
    steps_taken: NDArray[np.intp],
    recorded: NDArray[np.intp],
    scene: Scene,
) -> Outcome:
    """Return an outcome in the units of the equations, from one that is recorded per step.

    ``recorded``: recorded periods of every lane, (lanes,).
    """
    columns = _columns(system, plan)
    sums = outcome.amplitudes.reshape(len(steps_taken), len(columns) + 1, len(plan.orders))
    if not outcome.loads.size:
        return outcome._replace(amplitudes=sums)
    step = system.mesh_period / steps_taken
    samples = (steps_taken * np.maximum(1, recorded))[:, np.newaxis, np.newaxis]
    elements = provider_of(scene.model).elements(scene.model)
    # Forces are per step squared; means are sums of Simpson's rule, six times too large.
    outcome.loads[:, :, 2:] /= 6.0 * samples
    outcome.loads[:, :elements] /= step[:, np.newaxis, np.newaxis] ** 2
    outcome.loads[:, :elements, 3] /= step[:, np.newaxis] ** 2
    scales = np.pad(system.scales(step)[:, columns], ((0, 0), (0, 1)), constant_values=1.0)
    scales = scales[..., np.newaxis]
    return outcome._replace(
        # A negative scale swaps minimum and maximum.
        extremes=np.sort(outcome.extremes * scales[:, :-1], axis=2),
        amplitudes=np.abs(scales) * sums * (2.0 / samples),
    )


def steps_between_scalings(
    system: LaneSystem, steps_per_period: int | NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the number of steps between two scalings of a tangent vector, shape (lanes,).

    Between two scalings it must neither overflow nor vanish.
    """
    scalings = system.growth_rates() * system.mesh_period / LARGEST_GROWTH
    if (scalings <= 1.0).all():
        return np.full(scalings.shape, steps_per_period, dtype=np.intp)
    # Powers of two, so that the shortest interval of a block divides all others.
    interval = np.exp2(np.floor(np.log2(np.maximum(1.0, steps_per_period / scalings))))
    return np.where(scalings > 1.0, interval, steps_per_period).astype(np.intp)


def maps_memory(system: LaneSystem, plan: Plan, stable: NDArray[np.int64]) -> int:
    """Estimate the memory of what a method prepares for lanes that are integrated together.

    Parameters
    ----------
    system : LaneSystem
        The lanes.
    plan : Plan
        How they are integrated.
    stable : array of int, shape (lanes,)
        Steps per period with which RK4 is stable.

    Returns
    -------
    int
        Bytes; 0 for RK4.

    Examples
    --------
    ::

        stable = np.full(pairs.lanes, 60)
        maps_memory(pairs, Plan(12, 300, 100, 100, method="flow_map"), stable)
    """
    return METHODS[plan.method].memory(system, plan, scene_of(system, plan), stable)


def maps_are_kept(system: LaneSystem, plan: Plan) -> bool:
    """Return whether all that a method prepares for a system stays in memory between calls.

    Parameters
    ----------
    system : LaneSystem
        The lanes.
    plan : Plan
        How they are integrated.

    Returns
    -------
    bool
        Always True for RK4; for flow maps, whether those of all lanes fit into the memory.

    Examples
    --------
    ::

        if maps_are_kept(pairs, plan):
            integrate(pairs, start, plan)  # the flow maps of the last call are used again
    """
    return METHODS[plan.method].is_kept(system, plan, scene_of(system, plan))
