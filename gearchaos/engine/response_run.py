"""The time response: the motion at every step, after the transient."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from gearchaos_kernels import STATE_ROWS, Outcome, Plan, Status
from numpy.typing import NDArray
from tqdm import tqdm

from gearchaos.configuration import Configuration
from gearchaos.dynamics.mesh_forces import CONTACTS, accelerations, excitation, mesh_forces
from gearchaos.engine.running import choose_threads, metadata
from gearchaos.engine.simulation import Simulation
from gearchaos.errors import ConfigurationError
from gearchaos.results.response_variables import (
    MESH_PERIOD,
    NO_CONTACT_STATE,
    acceleration_of,
    response_variables,
)
from gearchaos.results.result import Result
from gearchaos.results.variables import Variable

DEFAULT_PERIODS = 32
LARGEST_RESPONSE = 4 * 2**30
"""Bytes that a response may take in memory."""


def respond(
    config: Configuration, periods: int = DEFAULT_PERIODS, threads: int | None = None
) -> Result:
    """Compute the motion at every step of the last mesh periods, for every value of the sweep.

    Parameters
    ----------
    config : Configuration
        From `load_config`; transient, recorded periods, start and scene are as configured.
    periods : int
        Mesh periods at the end of the recorded ones.
    threads : int, optional
        Threads to use; by default all that there are.

    Returns
    -------
    Result
        The variables of a sweep, and the motion along ``time``; its sections hold all states of
        the scene in all recorded periods.

    Raises
    ------
    ConfigurationError
        If fewer periods are recorded, the motion does not fit into memory or there are not so many
        threads.
    """
    choose_threads(threads)
    run = ResponseRun(config, periods)
    run.choose_steps()
    return run.result()


class ResponseRun(Simulation):
    """A sweep of which the motion is kept as well.

    Parameters
    ----------
    config : Configuration
    periods : int
        Mesh periods at the end of the recorded ones.
    """

    def __init__(self, config: Configuration, periods: int = DEFAULT_PERIODS) -> None:
        recorded = config.integration.recorded_periods
        if not 1 <= periods <= recorded:
            raise ConfigurationError(
                f"{config.source}: periods = {periods}: must be between 1 and "
                f"integration.recorded_periods = {recorded}; ask for fewer or record more"
            )
        self.periods = periods
        self._text = config.text
        # A scene whose axial pair acts on nothing that a sweep keeps is computed as a whole here.
        whole = config.replace("outputs.section", config.scene.states)
        super().__init__(whole.replace("outputs.section_points", recorded))

    @property
    def variables(self) -> list[Variable]:
        """What the response yields."""
        return super().variables + response_variables(
            self.axis,
            states=self.states,
            periods=self.periods,
            steps_per_period=self.plan.steps_per_period,
            axial=self.scene.axial,
            contacts=CONTACTS,
        )

    @property
    def recording(self) -> Plan:
        """The plan with all that is recorded, the motion included."""
        return super().recording._replace(history_periods=self.periods)

    def compile(self) -> None:
        """Compile the kernel that keeps the motion of this scene, or load it from the cache."""
        plan = self.recording._replace(
            transient_periods=0, recorded_periods=1, section_points=0, history_periods=1
        )
        lanes = np.arange(1)
        self.integrate(lanes, self.start_of(lanes), plan)

    def result(self) -> Result:
        """Compute all lanes.

        Raises
        ------
        ConfigurationError
            If the motion does not fit into memory.
        """
        self._check_size()
        began = time.monotonic()
        arrays = self.compute(0, self.lanes)
        facts = {
            **metadata(self, time.monotonic() - began),
            "kind": "response",
            "response_periods": self.periods,
            "configuration": self._text,
        }
        return Result(self.axis, self.variables, arrays, self.parameters, facts)

    def _check_size(self) -> None:
        samples = self.periods * self.plan.steps_per_period + 1
        columns = len(STATE_ROWS) + 2 * len(self.states)
        numbers = samples * columns + self.plan.section_points * len(self.states)
        size = 8 * self.lanes * numbers
        if size > LARGEST_RESPONSE:
            most, wanted = (tqdm.format_sizeof(s, "B", 1024) for s in (LARGEST_RESPONSE, size))
            raise ConfigurationError(
                f"{self.config.source}: the response of {self.lanes} lanes over {self.periods} "
                f"mesh periods of {self.plan.steps_per_period} steps takes {wanted}, more than "
                f"{most}; ask for fewer periods or values"
            )

    def _arrays(self, first: int, outcome: Outcome) -> dict[str, Any]:
        arrays = super()._arrays(first, outcome)
        assert outcome.history is not None
        sound = outcome.status == Status.OK
        lanes = np.arange(first, first + sound.size)
        arrays[MESH_PERIOD] = self.periods_of(lanes)
        for name, motion in self._motion(lanes, outcome.history).items():
            nothing = NO_CONTACT_STATE if motion.dtype == np.uint8 else np.nan
            motion[~sound] = nothing
            arrays[name] = motion
        return arrays

    def _motion(
        self, lanes: NDArray[np.intp], states: NDArray[np.float64]
    ) -> dict[str, NDArray[Any]]:
        model = self.model_of(lanes)
        imposed = excitation(
            self.scene, model, *self.harmonics(), self.plan.steps_per_period, states.shape[1]
        )
        rederived = self.config.formulation == "rederived"
        forces = mesh_forces(self.scene, model, imposed, states, rederived=rederived)
        motion: dict[str, NDArray[Any]] = {
            name: states[..., STATE_ROWS[name]].copy() for name in self.states
        }
        for name, values in accelerations(self.scene, model, imposed, states, forces).items():
            motion[acceleration_of(name)] = values
        motion["mesh_force_tangential"] = forces.tangential
        motion["contact_tangential"] = forces.contact_tangential
        if self.scene.axial:
            motion["mesh_force_axial"] = forces.axial
            motion["contact_axial"] = forces.contact_axial
        return motion
