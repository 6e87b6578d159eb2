"""The lanes of a configured sweep: their groups and starts, and how any of them is integrated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from gearchaos_kernels import Model, Outcome, Plan, Scene, Status, integrate
from numpy.typing import NDArray

from gearchaos.configuration import Configuration, lane_groups
from gearchaos.configuration.run_tables import states_of
from gearchaos.dynamics.stability import joined_limit, stability_limit
from gearchaos.engine.lanes import model, select, start_states
from gearchaos.engine.step_choice import PILOT_LANES, PILOT_PERIODS, Candidate, choose_steps
from gearchaos.errors import ConfigurationError
from gearchaos.gear.mesh_stiffness import FourierStiffness
from gearchaos.interrupts import check
from gearchaos.records.difference import Motion
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.records.period import POINTS_NEEDED
from gearchaos.results.variables import Variable, axis_name, step_choice_variables

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

LANES_AT_ONCE = 2**14
"""Lanes whose stability is looked at together."""

PHASES = 1001
"""Mesh phases at which the sign of the mesh stiffness is looked at."""


class SweepLanes:
    """The lanes of one configured sweep.

    Lanes are ordered by the swept value; where a value has several starts, these follow one
    another. A lane's result depends on its number in the sweep and nothing else.

    Parameters
    ----------
    config : Configuration

    Raises
    ------
    ConfigurationError
        If the number of steps per period is unstable and may not be raised.
    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self.values, self.groups = lane_groups(config)
        self.starts = config.start.count
        self.lanes = self.values.size * self.starts
        self.effects = config.needed_effects
        self.states = states_of(self.effects)
        self.scene = Scene(**{effect: effect in self.effects for effect in Scene._fields})
        self.plan = Plan(
            steps_per_period=config.integration.steps_per_period,
            transient_periods=config.integration.transient_periods,
            recorded_periods=config.integration.recorded_periods,
            section_points=config.outputs.section_points if config.outputs.section else 0,
            section_states=config.outputs.section,
            tangent=config.outputs.lyapunov,
            resolved=config.integration.crossings == "resolved",
        )
        self._choice: list[Variable] = []
        self.notes: list[str] = []
        """What a user should know before the sweep begins."""
        self._keep_stable()
        self._look_at_stiffness()

    @property
    def axis(self) -> str:
        """Name of the dimension of the lanes."""
        return axis_name(self.config.sweep.parameter)

    @property
    def carried(self) -> bool:
        """Whether each value starts from the end state of its neighbour."""
        return self.config.start.carry != "none"

    @property
    def splits_steps(self) -> bool:
        """Whether steps are split where they cross a clearance boundary."""
        return self.plan.resolved and self.scene.backlash

    def periods_of(self, lanes: Numbers) -> Floats:
        """Return the mesh period of each lane in units of tau."""
        frequency = select(self.groups, lanes // self.starts).mesh_frequency
        return np.broadcast_to(2.0 * np.pi / np.float64(frequency), lanes.shape)

    def model_of(self, lanes: Numbers) -> Model:
        """Return the groups of some lanes as the kernels take them."""
        return model(select(self.groups, lanes // self.starts), lanes.size)

    def start_of(self, lanes: Numbers, carried: Floats | None = None) -> Floats:
        """Return the start states of some lanes, or those carried over where they are numbers."""
        start = start_states(self.config, self.model_of(lanes), lanes)
        if carried is None:
            return start
        # A lane that diverged hands nothing on: its successor begins anew.
        return np.where(np.isfinite(carried).all(axis=1, keepdims=True), carried, start)

    def harmonics(self) -> tuple[Floats, Floats]:
        """Return cosine and sine coefficients of the mesh stiffness relative to its mean."""
        nothing = np.zeros(0)
        cosine, sine = self.groups.stiffness_cosine, self.groups.stiffness_sine
        return nothing if cosine is None else cosine, nothing if sine is None else sine

    def integrate(self, lanes: Numbers, start: Floats, plan: Plan | None = None) -> Outcome:
        """Integrate some lanes as the sweep does, or by another plan."""
        check()
        return integrate(
            self.scene,
            self.model_of(lanes),
            *self.harmonics(),
            start,
            plan or self.plan,
            rederived=self.config.formulation == "rederived",
        )

    def motion_of(self, lanes: Numbers, start: Floats, plan: Plan) -> Motion:
        """Integrate some lanes and keep what tells two motions apart."""
        outcome = self.integrate(lanes, start, plan)
        exponent = None
        if outcome.growth is not None:
            exponent, _ = largest_exponent(outcome.growth, self.periods_of(lanes))
        return Motion(outcome.section, exponent, outcome.status != Status.OK)

    def pilot(self, lanes: int, finest: int) -> tuple[int, Callable[..., Motion]]:
        """Prepare to integrate some lanes of the sweep on several grids, to compare them.

        Parameters
        ----------
        lanes : int
            Lanes wanted, spread evenly over the sweep.
        finest : int
            Steps per period of the transient that all grids go on from, so that a lane comes to
            the same one of several coexisting motions on each of them.

        Returns
        -------
        lanes : int
            Number of lanes that there are.
        motion : callable
            ``motion(steps, resolved)`` settles on that grid and returns the `Motion`.
        """
        count = min(lanes, self.lanes)
        numbers = np.unique(np.linspace(0, self.lanes - 1, count).round().astype(np.intp))
        transient = self.plan._replace(
            steps_per_period=finest,
            recorded_periods=0,
            section_points=0,
            tangent=False,
            resolved=True,
        )
        common = self.integrate(numbers, self.start_of(numbers), transient).end_state

        def motion(steps: int, resolved: bool) -> Motion:
            plan = self.plan._replace(
                steps_per_period=steps,
                transient_periods=PILOT_PERIODS,
                recorded_periods=PILOT_PERIODS,
                section_points=min(POINTS_NEEDED, PILOT_PERIODS),
                resolved=resolved,
            )
            return self.motion_of(numbers, common, plan)

        return numbers.size, motion

    def choose_steps(self) -> None:
        """Measure which number of steps the configured tolerance needs, and take it."""
        tolerance = self.config.integration.tolerance
        if tolerance is None:
            return
        coarsest = self.plan.steps_per_period
        lanes, motion = self.pilot(PILOT_LANES, 4 * coarsest)
        candidates = choose_steps(
            partial(motion, resolved=self.plan.resolved), coarsest, tolerance, self.config.source
        )
        steps, *measured = zip(*candidates, strict=True)
        self._choice = step_choice_variables(
            steps, dict(zip(Candidate._fields[1:], measured, strict=True))
        )
        self.plan = self.plan._replace(steps_per_period=candidates[-1].steps)
        best = candidates[-1]
        self.notes.append(
            f"{best.steps} steps per period: on the {best.periodic_share * lanes:.0f} of {lanes} "
            f"lanes that move periodically the error is {best.error:.1e}, wanted is {tolerance:g}; "
            f"{best.changed_share * lanes:.0f} move in another way with finer steps"
        )

    def _look_at_stiffness(self) -> None:
        """Note where the variation of the mesh stiffness exceeds its mean."""
        if not self.scene.stiffness_variation:
            return
        variation = FourierStiffness(*self.harmonics()).table(PHASES) - 1.0
        scale = np.float64(self.groups.stiffness_variation_scale)
        lowest = 1.0 + np.min(np.outer([np.min(scale), np.max(scale)], variation))
        if lowest < 0.0:
            self.notes.append(
                f"the mesh stiffness falls to {lowest:.2g} of its mean within a mesh period, below "
                "zero; groups.stiffness_variation_scale is too large for these harmonics"
            )

    def _keep_stable(self) -> None:
        """Refuse or raise a number of steps with which the method itself would blow up."""
        steps = self.plan.steps_per_period
        limits = []
        # In parts: only the swept group is known for all lanes at once.
        for first in range(0, self.values.size, LANES_AT_ONCE):
            numbers = np.arange(first, min(first + LANES_AT_ONCE, self.values.size))
            part = model(select(self.groups, numbers), numbers.size)
            limit = stability_limit(self.scene, part, *self.harmonics(), steps=steps)
            if limit is not None:
                limits.append(replace(limit, lanes=limit.lanes + first))
        if not limits:
            return
        limit = joined_limit(limits)
        fault = limit.fault(steps, self.config.sweep.parameter, self.values)
        if self.config.integration.unstable == "refuse":
            raise ConfigurationError(fault.text(self.config.source))
        self.plan = self.plan._replace(steps_per_period=limit.steps)
        self.notes.append(
            f"integration.steps_per_period raised from {steps} to {limit.steps}, the stability "
            f"limit of {limit.lanes.size} of {self.values.size} values"
        )
