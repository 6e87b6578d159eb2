"""The gap of an element along a step, as the series of the motion from the beginning of the step.

The same recursion as in `expansion`, with the matrices of all lanes at once. Few steps are looked
at, so that no loop has to be compiled for each structure.
"""

from math import comb
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearchaos_kernels.methods.taylor.layout import REACH, TERMS
from gearchaos_kernels.plan import Floats, Plan
from gearchaos_kernels.scene import Scene


class _Branches(NamedTuple):
    """The contact branches of all elements over a step.

    ``engaged``: 1 on an engaged flank, else 0; ``side``: 1 on the driving flank, -1 on the back
    flank; ``damping``: damping coefficients that act; all (lanes, elements).
    """

    engaged: Floats
    side: Floats
    damping: Floats

    @classmethod
    def of(cls, system: Any, flanks: NDArray[np.uint8]) -> "_Branches":
        """Return the branches of ``flanks`` (lanes, elements), see `gaps.Gaps`."""
        engaged = (flanks != 0).astype(np.float64)
        if not system.clearance:
            engaged = np.ones_like(engaged)
        idle = np.array(system.structure.damped_in_contact, dtype=bool) & (engaged == 0.0)
        damping = np.where(idle, 0.0, system.damping)
        return cls(engaged, np.where(flanks == 2, -1.0, 1.0), damping)


def gap_terms(
    system: Any,
    plan: Plan,
    _scene: Scene,
    states: Floats,
    flanks: NDArray[np.uint8],
    at: tuple[NDArray[np.intp], int],
) -> Floats:
    """Return the gap of an element over one step of each lane, (lanes, TERMS + 1).

    ``states`` (lanes, states) and ``flanks`` (lanes, elements) at the beginning of the step;
    ``at``: number of the step (lanes,), and the element. NaN where the step is longer than a piece
    of the series.
    """
    samples, element = at
    step = system.mesh_period / plan.steps_per_period
    phase = 2.0 * np.pi * (samples % plan.steps_per_period) / plan.steps_per_period
    waves = _waves(system.orders, phase, 2.0 * np.pi / plan.steps_per_period)
    branches = _Branches.of(system, flanks)
    gaps = _gaps(system, states, waves, branches, step)[:, :, element]
    gaps[:, system.fastest_rates() * step > REACH] = np.nan
    return np.asarray(_about_the_middle(gaps).T)


def _waves(orders: tuple[int, ...], phase: Floats, angle: float) -> Floats:
    """Return the series of 1 and of cosine and sine of each harmonic, (terms, lanes, waves).

    ``phase`` (lanes,): mesh phase at the beginning of the step; ``angle``: that of a step.
    """
    waves = np.zeros((TERMS + 1, phase.size, 1 + 2 * len(orders)))
    waves[0, :, 0] = 1.0
    for number, order in enumerate(orders):
        term = np.exp(1j * order * phase)
        for power in range(TERMS + 1):
            waves[power, :, 1 + 2 * number] = term.real
            waves[power, :, 2 + 2 * number] = term.imag
            term = term * (1j * order * angle) / (power + 1)
    return waves


def _gaps(system: Any, states: Floats, waves: Floats, branches: _Branches, step: Floats) -> Floats:
    """Return the series of all gaps in steps from the beginning, (terms, lanes, elements)."""
    count = states.shape[1] // 2
    positions = np.zeros((TERMS + 1, len(states), count))
    positions[0], positions[1] = states[:, ::2], states[:, 1::2] * step[:, np.newaxis]
    excited, stiffness, driven = (
        np.einsum("lmw,tlw->tlm", matrix, waves)
        for matrix in (system.motion, system.stiffness, system.force)
    )
    offset = branches.side * system.half_clearance
    once, twice = step[:, np.newaxis], step[:, np.newaxis] ** 2
    gaps = np.zeros_like(excited)
    gaps[:2] = np.einsum("lmn,tln->tlm", system.gap, positions[:2]) - excited[:2]
    for number in range(TERMS - 1):
        rate = (number + 1) * positions[number + 1] / once
        closing = (number + 1) * gaps[number + 1] / once
        held = np.einsum("tlm,tlm->lm", stiffness[number::-1], gaps[: number + 1])
        spring = branches.engaged * (held - offset * stiffness[number])
        pushes = spring + branches.damping * closing
        acceleration = driven[number]
        for matrix, vector in (
            (system.position, positions[number]),
            (system.rate, rate),
            (system.reaction, pushes),
        ):
            acceleration = acceleration - np.einsum("lij,lj->li", matrix, vector)
        after = number + 2
        positions[after] = twice * acceleration / ((number + 1) * after)
        moved = np.einsum("lmn,ln->lm", system.gap, positions[after])
        gaps[after] = moved - excited[after]
    return np.asarray(gaps)


def _about_the_middle(series: Floats) -> Floats:
    """Return series in t, from 0 to 1 over a step, as those in s = 2 t - 1; both (terms, lanes)."""
    terms = len(series)
    # t^n = sum_k C(n, k) s^k / 2^n
    factors = np.array(
        [[comb(n, k) / 2.0**n if k <= n else 0.0 for n in range(terms)] for k in range(terms)]
    )
    return np.asarray(factors @ series)
