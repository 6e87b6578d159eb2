"""Reference motions of piecewise-linear systems, exact to double precision, and random systems.

An adaptive method of order 8 integrates on one contact branch at a time. It locates crossings as
events and restarts there. It uses the original matrices; the kernels use the matrices multiplied by
the inverse of the mass matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate
from gearchaos_kernels.models.linear.system import LinearSystems
from scipy.integrate import solve_ivp

TOLERANCE = 1e-13

LONGEST_STEP = 0.05
"""Events are found from the signs at both ends of a step: longer steps miss short excursions."""

SIZES = [(1, 1), (3, 2), (6, 4)]
SIZES_OF_MAPS = [(1, 1, 6), (3, 2, 6), (5, 6, 4)]
"""Numbers of coordinates, elements and machines.

There are only four machines with six elements: references of others may be accurate to 1e-10 only.
"""

PERIODS = 3
WITH_LOADS = {
    "transient_periods": 0,
    "recorded_periods": PERIODS,
    "section_points": PERIODS,
    "tangent": True,
    "contact": True,
    "loads": True,
}


@dataclass
class Piecewise:
    """M x'' + C x' + K x = f - sum_j r_j [k_j D(y_j) + c_j y_j'], y_j = n_j x - e_j.

    ``force``, ``stiffness`` and ``motion`` have the columns 1, cos(phi) and sin(phi) of the mesh
    phase phi = frequency * tau.
    """

    frequency: float
    mass: np.ndarray
    rate: np.ndarray
    position: np.ndarray
    reaction: np.ndarray
    gap: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    motion: np.ndarray
    damping: np.ndarray
    half_clearance: np.ndarray
    one_sided: tuple[bool, ...]
    damped_in_contact: tuple[bool, ...]

    @property
    def size(self) -> int:
        return len(self.mass)

    def waves(self, tau: float) -> tuple[np.ndarray, np.ndarray]:
        phase, speed = self.frequency * tau, self.frequency
        cosine, sine = np.cos(phase), np.sin(phase)
        return np.array([1.0, cosine, sine]), np.array([0.0, -speed * sine, speed * cosine])

    def gaps(self, tau: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        waves, rates = self.waves(tau)
        x, v = z[: self.size], z[self.size : 2 * self.size]
        return self.gap @ x - self.motion @ waves, self.gap @ v - self.motion @ rates

    def flanks(self, tau: float, z: np.ndarray) -> list[int]:
        value, _ = self.gaps(tau, z)
        return [
            self._flank(*one)
            for one in zip(value, self.half_clearance, self.one_sided, strict=True)
        ]

    @staticmethod
    def _flank(value: float, limit: float, one_sided: bool) -> int:
        if value >= limit:
            return 1
        return -1 if value <= -limit and not one_sided else 0

    def acting(self, flanks: list[int]) -> np.ndarray:
        """Return the damping coefficients that act on these flanks."""
        apart = np.array(
            [bool(f == 0 and only) for f, only in zip(flanks, self.damped_in_contact, strict=True)]
        )
        return np.where(apart, 0.0, self.damping)

    def change(self, tau: float, z: np.ndarray, flanks: list[int]) -> np.ndarray:
        """Return d/dtau of x and x', and of the tangent vector if z contains one."""
        n, waves = self.size, self.waves(tau)[0]
        x, v = z[:n], z[n : 2 * n]
        value, rate = self.gaps(tau, z)
        flank = np.array(flanks)
        spring = self.stiffness @ waves * np.abs(flank)
        pushes = spring * (value - flank * self.half_clearance) + self.acting(flanks) * rate
        forces = self.force @ waves - self.rate @ v - self.position @ x - self.reaction @ pushes
        parts = [v, np.linalg.solve(self.mass, forces)]
        if z.size > 2 * n:
            a, b = z[2 * n : 3 * n], z[3 * n :]
            pushes = spring * (self.gap @ a) + self.acting(flanks) * (self.gap @ b)
            forces = -self.rate @ b - self.position @ a - self.reaction @ pushes
            parts += [b, np.linalg.solve(self.mass, forces)]
        return np.concatenate(parts)

    def periods(self, start: np.ndarray, count: int) -> tuple[np.ndarray, int]:
        """Return z after each period, shape (periods, states), and the number of crossings."""
        period, z, crossings, found = 2.0 * np.pi / self.frequency, start.copy(), 0, []
        flanks = self.flanks(0.0, z)
        for number in range(count):
            tau, end = number * period, (number + 1) * period
            while tau < end:
                tau, z, element, meets = self.piece(tau, end, z, flanks)
                if element >= 0:
                    z = self.jumped(tau, z, flanks, element, meets)
                    flanks[element] = meets
                    crossings += 1
            found.append(z)
        return np.array(found), crossings

    def piece(self, tau: float, end: float, z: np.ndarray, flanks: list[int]):
        """Integrate to the next crossing or the end; return time, z, element (or -1) and flank."""
        events, targets = [], []
        for element, flank in enumerate(flanks):
            limit = self.half_clearance[element]
            sides = [flank] if flank else [1] if self.one_sided[element] else [1, -1]
            for side in sides:

                def event(t, y, element=element, side=side, limit=limit):
                    return side * self.gaps(t, y)[0][element] - limit

                event.terminal, event.direction = True, -1 if flank else 1
                events.append(event)
                targets.append((element, 0 if flank else side))
        done = solve_ivp(
            lambda t, y: self.change(t, y, flanks),
            (tau, end),
            z,
            method="DOP853",
            rtol=TOLERANCE,
            atol=TOLERANCE,
            max_step=LONGEST_STEP,
            events=events,
        )
        for times, target in zip(done.t_events, targets, strict=True):
            if times.size:
                return done.t[-1], done.y[:, -1], *target
        return end, done.y[:, -1], -1, 0

    def jumped(self, tau: float, z: np.ndarray, flanks: list[int], element: int, meets: int):
        """Apply the saltation matrix of a crossing to the tangent vector, if z contains one."""
        n = self.size
        if z.size == 2 * n:
            return z
        following = [meets if at == element else flank for at, flank in enumerate(flanks)]
        before, after = (self.change(tau, z, given) for given in (flanks, following))
        rate = self.gaps(tau, z)[1][element]
        moved = (after - before)[: 2 * n] * (self.gap[element] @ z[2 * n : 3 * n]) / rate
        return np.concatenate([z[: 2 * n], z[2 * n :] + moved])


def random_machine(seed: int, coordinates: int, elements: int, held: float = 1.0) -> Piecewise:
    """Return a random system with contact loss, elements of different kinds and no zero entries.

    ``held``: factor of the springs to the ground; if it is not positive, only the elements hold the
    system.
    """
    draw = np.random.default_rng(seed)
    rows = draw.normal(size=(elements, coordinates))
    half = draw.normal(size=(coordinates, coordinates))
    springs = half @ half.T / coordinates * draw.choice([0.2, 1.0])
    stiffness = np.zeros((elements, 3))
    stiffness[:, 0] = draw.uniform(0.5, 3.0, elements)
    stiffness[:, 1:] = 0.3 * stiffness[:, :1] * draw.uniform(-1.0, 1.0, (elements, 2))
    return Piecewise(
        frequency=draw.uniform(0.6, 1.5),
        mass=np.diag(draw.uniform(0.5, 2.0, coordinates)) + 0.05,
        rate=0.05 * springs + 0.05 * np.eye(coordinates),
        position=held * springs,
        reaction=rows.T.copy(),
        gap=rows,
        force=draw.normal(size=(coordinates, 3)),
        stiffness=stiffness,
        motion=0.1 * draw.normal(size=(elements, 3)),
        damping=draw.uniform(0.02, 0.2, elements),
        half_clearance=draw.uniform(0.1, 0.5, elements),
        one_sided=tuple(bool(at % 2) for at in range(elements)),
        damped_in_contact=tuple(bool(at % 3 == 1 or elements == 1) for at in range(elements)),
    )


def lanes_of(machines: list[Piecewise]) -> LinearSystems:
    """Return machines of one size as lanes."""

    def stacked(name: str, over_mass: bool = False) -> np.ndarray:
        arrays = [np.asarray(getattr(one, name), dtype=float) for one in machines]
        if over_mass:
            arrays = [
                np.linalg.solve(one.mass, array)
                for one, array in zip(machines, arrays, strict=True)
            ]
        return np.stack(arrays)

    return LinearSystems(
        frequency=stacked("frequency"),
        **{name: stacked(name, True) for name in ("position", "rate", "reaction", "force")},
        **{name: stacked(name) for name in ("gap", "motion", "stiffness")},
        **{name: stacked(name) for name in ("damping", "half_clearance")},
        orders=(1,),
        one_sided=machines[0].one_sided,
        damped_in_contact=machines[0].damped_in_contact,
    )


def alternating(z: np.ndarray, size: int) -> np.ndarray:
    """Reorder states, displacements before rates, to the order of lanes: each x before its x'."""
    return np.stack([z[..., :size], z[..., size : 2 * size]], axis=-1).reshape(*z.shape[:-1], -1)


@cache
def exact(coordinates, elements, count=6):
    """Return machines and starts, with reference sections, growths and numbers of crossings."""
    machines = [random_machine(seed, coordinates, elements) for seed in range(count)]
    starts, sections, growths, crossings = [], [], [], []
    for seed, machine in enumerate(machines):
        start = np.random.default_rng(seed).normal(size=2 * coordinates) * 0.5
        tangent = np.full(2 * coordinates, 1.0 / np.sqrt(2 * coordinates))
        found, crossed = machine.periods(np.concatenate([start, tangent]), PERIODS)
        lengths = np.linalg.norm(found[:, 2 * coordinates :], axis=1)
        starts.append(alternating(start, coordinates))
        sections.append(alternating(found[:, : 2 * coordinates], coordinates))
        growths.append(np.diff(np.log(lengths), prepend=0.0))
        crossings.append(crossed)
    return machines, np.array(starts), np.array(sections), np.array(growths), np.array(crossings)


def assert_exact(machine: Piecewise, seed: int, plan: Plan) -> None:
    """Integrate a machine from a random start, and compare the motion with the adaptive method."""
    count = len(machine.mass)
    start = np.random.default_rng(seed).normal(size=2 * count) * 0.5
    tangent = np.full(2 * count, 1.0 / np.sqrt(2 * count))
    motion, crossed = machine.periods(
        np.concatenate([start, tangent]), plan.transient_periods + plan.recorded_periods
    )
    found = integrate(lanes_of([machine]), alternating(start, count)[np.newaxis], plan)
    assert found.crossings[0] == crossed
    section = alternating(motion[:, : 2 * count], count)
    scale = max(1.0, np.abs(section).max())
    assert found.section[0] == pytest.approx(section, abs=1e-10 * scale)
    lengths = np.log(np.linalg.norm(motion[:, 2 * count :], axis=1))
    assert found.growth[0] == pytest.approx(np.diff(lengths, prepend=0.0), abs=1e-10)
