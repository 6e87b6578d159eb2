"""Piecewise-linear systems of any size against an adaptive method with events."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from gearchaos_kernels import Plan, Status, evaluate, gaps_along, integrate, jacobian
from gearchaos_kernels.methods.flow_map import on_demand, store
from gearchaos_kernels.models.lane_system import LaneSystem
from gearchaos_kernels.models.linear.system import LinearSystems
from hypothesis import given, settings
from hypothesis import strategies as st

from .oscillator import Oscillators
from .piecewise import (
    PERIODS,
    SIZES,
    SIZES_OF_MAPS,
    WITH_LOADS,
    assert_exact,
    exact,
    lanes_of,
    random_machine,
)
from .reference import assert_same_bits, lanes_out_of


def mean_order(coarse, fine):
    """Return the mean order from a step to its quarter, of the errors above rounding.

    The order is a mean, because machines that nearly graze need smaller steps to reach order 4.
    """
    resolved = coarse > 1e-10
    return np.log2(coarse[resolved] / fine[resolved]).mean() / 2


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_the_order_is_4_where_elements_of_every_kind_cross(size):
    machines, start, section, growth, crossings = exact(*size)
    assert crossings.sum() >= 20
    errors, growth_errors = [], []
    for steps in (400, 1600):
        plan = Plan(steps, **WITH_LOADS)
        found = integrate(lanes_of(machines), start, plan)
        assert found.crossings.tolist() == crossings.tolist()
        errors.append(np.abs(found.section - section).max(axis=(1, 2)))
        growth_errors.append(np.abs(found.growth - growth).max(axis=1))
    assert mean_order(*errors) > 3.8, errors
    assert mean_order(*growth_errors) > 3.8, growth_errors
    assert errors[1].max() < 1e-7 and growth_errors[1].max() < 1e-6


@pytest.mark.parametrize("compiled", [False, True])
def test_the_jacobian_is_that_of_the_matrices(compiled, monkeypatch):
    machines = [random_machine(seed, 3, 2) for seed in range(4)]
    system = lanes_of(machines)
    if compiled:
        # Evaluate the compiled formulas, as for other models.
        monkeypatch.setattr(LinearSystems, "branch_jacobian", LaneSystem.branch_jacobian)
    apart = np.zeros((4, 2))
    for share in (apart, apart + 1.0):
        found = jacobian(system, share)
        for lane, machine in enumerate(machines):
            spring = share[lane] * machine.stiffness[:, 0]
            damper = np.where(
                np.array(machine.damped_in_contact) & (share[lane] == 0.0), 0.0, machine.damping
            )
            positions = machine.position + machine.reaction @ (spring[:, np.newaxis] * machine.gap)
            rates = machine.rate + machine.reaction @ (damper[:, np.newaxis] * machine.gap)
            expected = np.zeros((6, 6))
            expected[::2, 1::2] = np.eye(3)
            expected[1::2, ::2] = -np.linalg.solve(machine.mass, positions)
            expected[1::2, 1::2] = -np.linalg.solve(machine.mass, rates)
            assert found[lane] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("clearance", [True, False])
def test_gaps_and_forces_of_the_matrices_are_those_of_the_compiled_formulas(clearance, monkeypatch):
    system = lanes_of([random_machine(seed, 3, 2) for seed in range(4)])
    if not clearance:
        system = replace(system, half_clearance=np.zeros((4, 2)), one_sided=(False, False))
    random = np.random.default_rng(7)
    states = random.uniform(-2.0, 2.0, (4, 37, 6))
    found = gaps_along(system, states, 16), evaluate(system, states, 16)
    for name in "known_gaps", "known_motion":
        monkeypatch.setattr(LinearSystems, name, getattr(LaneSystem, name))
    compiled = gaps_along(system, states, 16), evaluate(system, states, 16)
    assert {*np.unique(compiled[0].flank)} == ({0, 1, 2} if clearance else {1, 2})
    for ours, theirs in zip(found, compiled, strict=True):
        for one, other in zip(ours, theirs, strict=True):
            assert one == pytest.approx(other, rel=1e-12, abs=1e-12)


def test_a_system_with_one_coordinate_is_the_oscillator():
    frequency = np.linspace(0.4, 1.8, 9)
    lanes, one = frequency.size, np.ones((9, 1, 1))
    force, spring = np.zeros((lanes, 1, 3)), np.zeros((lanes, 1, 3))
    force[:, 0, 0], force[:, 0, 1], spring[:, 0, 0] = 0.1, 0.1 * frequency**2, 1.0
    system = LinearSystems(
        frequency=frequency,
        position=0.0 * one,
        rate=0.0 * one,
        reaction=one,
        force=force,
        gap=one,
        motion=0.0 * spring,
        stiffness=spring,
        damping=np.full((lanes, 1), 0.1),
        half_clearance=np.ones((lanes, 1)),
        orders=(1,),
    )
    alike = (np.full(lanes, value) for value in (0.05, 1.0, 0.1))
    oscillators = Oscillators(frequency, *alike, 0.1 * frequency**2)
    start = np.tile([1.3, 0.0], (lanes, 1))
    plan = Plan(100, 0, 4, 4, tangent=True, contact=True)
    found, expected = (integrate(one, start, plan) for one in (system, oscillators))
    assert found.section == pytest.approx(expected.section, abs=1e-12)
    assert found.growth == pytest.approx(expected.growth, abs=1e-11)
    assert found.contact == pytest.approx(expected.contact, abs=1e-9)
    assert (found.crossings == expected.crossings).all() and found.crossings.sum() > 20


def test_the_state_in_contact_is_at_rest():
    excited = ("force", "motion", "stiffness")
    machines = [random_machine(seed, 3, 2) for seed in range(4)]
    still = [
        replace(one, **{name: getattr(one, name) * [1, 0, 0] for name in excited})
        for one in machines
    ]
    for machine, state in zip(still, lanes_of(still).contact_state(), strict=True):
        z = np.concatenate([state[::2], state[1::2]])
        flanks = np.where(machine.one_sided, 1.0, np.sign(machine.gaps(0.0, z)[0]))
        assert machine.change(0.0, z, flanks) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("load", [20.0, -20.0])
def test_the_state_in_contact_is_on_the_flank_that_carries_the_load(load):
    machine = replace(random_machine(3, 1, 1), force=np.array([[load, 0.0, 0.0]]))
    (state,) = lanes_of([machine]).contact_state()
    gap = machine.gap[0, 0] * state[0] - machine.motion[0, 0]
    deflection = gap - np.sign(gap) * machine.half_clearance[0]
    assert gap * deflection > 0.0
    push = machine.reaction[0, 0] * machine.stiffness[0, 0] * deflection
    assert machine.position[0, 0] * state[0] + push == pytest.approx(load, rel=1e-12)


@settings(max_examples=6)
@given(
    size=st.sampled_from([one[:2] for one in SIZES_OF_MAPS]),
    seed=st.integers(100, 10_000),
    # Not 0: terms that are zero in all lanes are left out, which would need another loop.
    held=st.sampled_from([1.0, 0.01, -0.05]),
    step=st.sampled_from([24, 60]),
)
def test_flow_maps_are_exact_for_random_systems_with_and_without_springs_to_the_ground(
    size, seed, held, step
):
    shorter = WITH_LOADS | {"recorded_periods": 2, "section_points": 2}
    plan = Plan(step, **shorter, method="flow_map")
    assert_exact(random_machine(seed, *size, held), seed, plan)


@pytest.mark.parametrize("size", SIZES_OF_MAPS, ids=str)
def test_flow_maps_are_exact_where_elements_of_every_kind_cross(size):
    machines, start, section, growth, crossings = exact(*size)
    plan = Plan(60, **WITH_LOADS, method="flow_map")
    found = integrate(lanes_of(machines), start, plan)
    assert found.crossings.tolist() == crossings.tolist()
    assert found.section == pytest.approx(section, abs=1e-11)
    assert found.growth == pytest.approx(growth, abs=1e-11)


@pytest.mark.parametrize("size", SIZES_OF_MAPS, ids=str)
def test_flow_maps_record_the_loads_of_fine_steps_where_dampers_act_in_contact(size):
    machines, start, _, _, _ = exact(*size)
    system = lanes_of(machines)
    coarse, wanted = (integrate(system, start, Plan(n, **WITH_LOADS)).loads for n in (3200, 6400))
    found = integrate(system, start, Plan(60, **WITH_LOADS, method="flow_map")).loads
    size = np.abs(wanted[..., :2]).max(axis=2)
    error, double = (np.abs(found - one)[..., :2].max(axis=2) / size for one in (wanted, coarse))
    # A force may be largest where it jumps. Fine steps sample it at their ends only. This error is
    # proportional to the step, whereas other extremes have order 4.
    at_jumps = error > 1e-8
    assert (at_jumps.sum(axis=1) <= 1).all()
    assert (error[at_jumps] <= 5e-5).all()
    assert (error[at_jumps] < double[at_jumps]).all()
    halved = Plan(120, **WITH_LOADS, method="flow_map")
    extremes = integrate(system, start, halved).loads[..., :2]
    assert (np.abs(found[..., :2] - extremes).max(axis=2) <= 1e-11 * size).all()
    # Means and mean squares contain the same error of the fine steps.
    assert (np.abs(found[..., 2] - wanted[..., 2]) <= 1e-5 * size).all()
    assert (np.abs(found[..., 3] - wanted[..., 3]) <= 1e-5 * size**2).all()


@pytest.mark.parametrize("size", SIZES_OF_MAPS, ids=str)
def test_lanes_of_flow_maps_do_not_depend_on_their_neighbours(size):
    machines, start, _, _, _ = exact(*size)
    plan = Plan(60, **WITH_LOADS, method="flow_map")
    # All lanes have the same maps. Many lanes move eight at a time, a single lane moves alone.
    system = lanes_of(machines[:1] * 9)
    starts = start[0] * np.linspace(0.5, 1.0, 9)[:, np.newaxis]
    together = integrate(system, starts, plan)
    for lane in (0, 4, 8):
        alone = integrate(system.of([lane]), starts[lane : lane + 1], plan)
        assert np.array_equal(alone.section[0], together.section[lane])
        assert np.array_equal(alone.growth[0], together.growth[lane])
        assert np.array_equal(alone.loads[0], together.loads[lane])


# The first size has maps made in advance, the second one maps made on demand.
@pytest.mark.parametrize("size", SIZES_OF_MAPS[1:], ids=str)
def test_maps_of_scenes_with_loads_and_without_are_kept_apart(size, monkeypatch):
    machines, start, _, _, _ = exact(*size)
    system, with_loads = lanes_of(machines), Plan(60, **WITH_LOADS, method="flow_map")
    plans = with_loads._replace(loads=False), with_loads

    def forget_maps():
        for module in (store, on_demand):
            monkeypatch.setattr(module, "_kept", module._Kept(0))

    wanted = []
    for plan in plans:
        forget_maps()
        wanted.append(integrate(system, start, plan))
    forget_maps()
    for number in (0, 1, 0):
        assert_same_bits(integrate(system, start, plans[number]), wanted[number])


def test_flow_maps_refuse_more_elements_than_a_number_can_list():
    system = lanes_of([random_machine(1, 2, 53)])
    plan = Plan(60, 0, 1, 1, method="flow_map")
    with pytest.raises(ValueError, match="take up to 52 clearance elements; this system has 53"):
        integrate(system, np.zeros((1, 4)), plan)


@pytest.fixture(scope="module")
def crowd():
    """Lanes of machines with six elements, many with the same maps; start, plan and outcome."""
    machines = [random_machine(seed, 5, 6) for seed in range(3)]
    system = lanes_of([machines[n % 3] for n in range(108)])
    # Machine 2 has only two lanes, the others have more lanes than a block.
    system = system.of([n for n in range(108) if n % 3 < 2 or n < 6])
    start = 0.5 * np.random.default_rng(3).normal(size=(system.lanes, 10))
    start[5] = np.nan
    # 3 steps are too few. The number is doubled for each lane as often as necessary.
    plan = Plan(3, 0, PERIODS, PERIODS, tangent=True, contact=True, method="flow_map")
    return system, start, plan, integrate(system, start, plan)


def test_lanes_of_the_crowd_cross_and_enter_different_sets(crowd):
    _, _, _, whole = crowd
    assert np.flatnonzero(whole.status).tolist() == [5]
    assert np.unique(whole.crossings).size > 5 and whole.crossings.max() > 20
    assert max(len(places) for places in on_demand._kept.places.values()) > 10


@pytest.mark.parametrize("map_bytes", [0, 2**27])
def test_maps_made_on_demand_in_any_order_give_the_same_bits(crowd, monkeypatch, map_bytes):
    system, start, plan, whole = crowd
    for chosen in (np.arange(system.lanes)[::-1], [3, 70, 1], [4]):
        monkeypatch.setattr(on_demand, "_kept", on_demand._Kept(0))
        few = plan._replace(map_bytes=map_bytes)
        some = integrate(system.of(chosen), start[chosen], few)
        assert_same_bits(some, lanes_out_of(whole, chosen))


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="needs two threads")
@pytest.mark.parametrize("threads", [1, 2])
def test_maps_made_on_demand_give_the_same_bits_on_any_threads(crowd, monkeypatch, threads):
    system, start, plan, whole = crowd
    monkeypatch.setattr(on_demand, "_kept", on_demand._Kept(0))
    before = numba.get_num_threads()
    numba.set_num_threads(threads)
    try:
        assert_same_bits(integrate(system, start, plan), whole)
    finally:
        numba.set_num_threads(before)


def test_maps_made_on_demand_serve_lanes_with_their_own_periods(crowd):
    system, start, plan, _ = crowd
    own = np.resize([1, 3, 2, 3, 1], system.lanes)
    together = integrate(system, start, plan, periods=own)
    for periods in (1, 2, 3):
        chosen = np.flatnonzero(own == periods)
        shorter = plan._replace(recorded_periods=periods, section_points=periods)
        separate = integrate(system.of(chosen), start[chosen], shorter)
        found = lanes_out_of(together, chosen)
        section, growth = found.section[:, -periods:].copy(), found.growth[:, :periods].copy()
        assert_same_bits(found._replace(section=section, growth=growth), separate)


@pytest.mark.parametrize("map_bytes", [0, 2**27])
def test_maps_made_on_demand_carry_frames(crowd, monkeypatch, map_bytes):
    system, start, plan, _ = crowd
    chosen, states = [0, 1, 2, 3, 4, 6, 7], 10
    lanes, starts = system.of(chosen).repeated(states), np.repeat(start[chosen], states, axis=0)
    vectors = np.tile(np.eye(states), (len(chosen), 1))
    monkeypatch.setattr(on_demand, "_kept", on_demand._Kept(0))
    framed = plan._replace(frame=True, map_bytes=map_bytes)
    found = integrate(lanes, starts, framed, tangent_start=vectors)
    growth = found.growth.reshape(len(chosen), states, PERIODS)
    single = integrate(lanes, starts, plan, tangent_start=vectors)
    assert np.array_equal(found.section, single.section)
    assert growth[:, 0] == pytest.approx(single.growth[::states], abs=1e-12)
    columns = single.end_tangent * np.exp(single.growth.sum(axis=1))[:, np.newaxis]
    volume = np.linalg.slogdet(columns.reshape(-1, states, states)).logabsdet
    assert growth.sum(axis=(1, 2)) == pytest.approx(volume, abs=1e-9)


def test_maps_that_no_steps_suffice_for_stop_their_lanes_only(crowd):
    system, start, plan, whole = crowd
    wild = system.of(np.arange(4))
    wild.rate[1] *= 1e7
    some = integrate(wild, start[:4], plan)
    assert some.status.tolist() == [0, Status.TOO_FAST, 0, 0]
    assert np.isnan(some.section[1]).all() and np.isnan(some.growth[1]).all()
    assert np.array_equal(some.section[[0, 2, 3]], whole.section[[0, 2, 3]])


def test_a_lane_may_lack_a_term_that_its_neighbours_have():
    machines = [random_machine(seed, 3, 2) for seed in range(3)]
    machines[1] = replace(machines[1], motion=np.zeros_like(machines[1].motion))
    system = lanes_of(machines)
    start = 0.3 * np.random.default_rng(5).normal(size=(3, 6))
    for method in ("rk4", "flow_map"):
        together = integrate(system, start, Plan(240, **WITH_LOADS, method=method))
        alone, plan = lanes_of(machines[1:2]), Plan(240, 0, PERIODS, PERIODS, method=method)
        expected = integrate(alone, start[1:2], plan)
        assert together.section[1] == pytest.approx(expected.section[0], abs=1e-12)
