"""A machine as the engine sees it: systems, parameters, loads and motions."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from gearchaos_kernels import LaneSystem, evaluate, jacobian
from gearchaos_kernels.models.linear.system import LinearSystems

from gearchaos.arrays import Array, Floats, Integers
from gearchaos.configuration.tables import OF_CONTROLLERS
from gearchaos.models.linear.configuration import MachineConfiguration
from gearchaos.models.linear.machine import Kinds, Machine
from gearchaos.models.linear.outputs import FORCE, FORCES_PART, GAP, TERMS, catalogue_of
from gearchaos.models.protocol import Model, accelerations
from gearchaos.models.stiffness_table import note_of, tables_in
from gearchaos.outputs.listing import Catalogue
from gearchaos.outputs.scales import Quantity


class MachineModel(Model):
    """A piecewise-linear machine; every configuration has its own names."""

    load_parts = (FORCES_PART,)
    shared_inputs = "nothing but their start"
    units: Mapping[Quantity, str] = MappingProxyType({})
    angle = ""
    terms: Mapping[str, str] = TERMS
    rate_words = "rad per unit of time"
    free_words = "no element in contact"

    def __init__(self, config: MachineConfiguration) -> None:
        self._kinds = config.kinds_of_elements
        self.signals = tuple(f"{GAP}{name}" for name in self._kinds.elements)

    @cached_property
    def catalogue(self) -> Catalogue:  # type: ignore[override]
        """All outputs that a result may have."""
        return catalogue_of(self._kinds, self.units, self.angle, self.terms)

    def system(
        self, config: MachineConfiguration, values: Mapping[str, Floats], effects: Collection[str]
    ) -> LaneSystem:
        """Return the machines of some lanes."""
        del effects
        different, number = _different(config, values)
        machines = [config.machine(one) for one in different]
        return systems_of(machines, self._kinds).of(number)

    def actuated(
        self,
        config: MachineConfiguration,
        values: Mapping[str, Floats],
        system: LaneSystem,
        actuator: str,
    ) -> LaneSystem:
        """Return the machines of some lanes with an actuator."""
        different, number = _different(config, values)
        accelerations, steady = [], []
        for one in different:
            found, mass = config.actuator_at(one, actuator), config.machine(one).mass
            force = [found.row.get(name, 0.0) for name in self._kinds.coordinates]
            accelerations.append(np.linalg.solve(mass, np.array(force, dtype=np.float64)))
            steady.append(found.steady)
        return system.replace(
            actuator=np.array(accelerations)[number], actuated=np.array(steady)[number]
        )

    def input_unit(
        self, config: MachineConfiguration, values: Mapping[str, Floats]
    ) -> Floats | None:
        """Return 1: inputs are in the unit of the actuator."""
        del config, values
        return np.ones(())

    def elements(self, effects: Collection[str]) -> tuple[str, ...]:
        """Return the names of the clearance elements."""
        del effects
        return self._kinds.elements

    def remarks(
        self,
        config: MachineConfiguration,
        system: LaneSystem,
        parameters: Mapping[str, Floats],
    ) -> Iterator[str]:
        """Yield how well tables of stiffness are represented, and whether motions grow."""
        del parameters
        for name, _ in config:
            for path, table in tables_in(getattr(config, name), name):
                yield note_of(path, table)
                if name == "clearance" and table.unit not in (None, "1"):
                    yield (
                        f"{path}: the unit {table.unit} is not converted; a machine of kind "
                        "linear takes all numbers as they are, in units that fit each other"
                    )
        yield _growing(system)

    def loads(self, loads: Floats, system: LaneSystem) -> dict[str, Floats]:
        """Return forces and gaps of each element by name."""
        del system
        told: dict[str, Floats] = {}
        count = len(self._kinds.elements)
        for number, name in enumerate(self._kinds.elements):
            largest, smallest, mean, square = np.moveaxis(loads[:, number], 1, 0)
            told |= {f"force_largest_{name}": largest, f"force_smallest_{name}": smallest}
            told |= {f"force_mean_{name}": mean, f"force_rms_{name}": np.sqrt(square)}
            largest, smallest, mean, square = np.moveaxis(loads[:, count + number], 1, 0)
            told |= {f"gap_mean_{name}": mean, f"gap_peak_to_peak_{name}": largest - smallest}
            told[f"gap_rms_{name}"] = np.sqrt(np.maximum(square - mean**2, 0.0))
        return told

    def motion(
        self, system: LaneSystem, states: Floats, steps_per_period: int, first_period: int
    ) -> dict[str, Array]:
        """Return accelerations, forces and contact along a motion, by name."""
        found = evaluate(system, states, steps_per_period, first_period)
        motion = accelerations(system, found.accelerations)
        for number, name in enumerate(self._kinds.elements):
            motion[f"{FORCE}{name}"] = found.forces[:, :, number].copy()
            motion[f"contact_{name}"] = found.contact[:, :, number].copy()
        return motion


def _different(
    config: MachineConfiguration, values: Mapping[str, Floats]
) -> tuple[list[dict[str, float]], Integers]:
    """Return the different values of the machine's parameters, and the number of each lane's."""
    given = {
        name: value
        for name, value in values.items()
        if name in config.parameters and name not in OF_CONTROLLERS
    }
    lanes = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
    if not given:
        return [{}], np.zeros(lanes, dtype=np.intp).reshape(-1)
    columns = np.stack([np.broadcast_to(value, lanes) for value in given.values()], axis=-1)
    different, number = np.unique(columns.reshape(-1, len(given)), axis=0, return_inverse=True)
    rows = [dict(zip(given, row.tolist(), strict=True)) for row in different]
    return rows, number.reshape(-1)


def _growing(system: LaneSystem) -> str:
    """Return whether the machine in contact is unstable, an empty text if it is not."""
    held = jacobian(system, np.ones((system.lanes, system.elements)))
    values = np.linalg.eigvals(held)
    largest = values.real.max(axis=1)
    # Eigenvalues of undamped machines are imaginary up to rounding.
    growing = largest > 1e-9 * np.abs(values).max(axis=1)
    if not growing.any():
        return ""
    return (
        f"with all elements in contact the machine is unstable in {growing.mean():.0%} of the "
        f"lanes that were examined: an eigenvalue has the real part {largest.max():.3g}, so that "
        "motions may grow until they diverge; check the signs of the stiffness and damping matrices"
    )


def systems_of(machines: Sequence[Machine], kinds: Kinds) -> LinearSystems:
    """Return machines as lanes; the mass matrices must not be singular."""
    columns: Any = Machine._make(map(np.array, zip(*machines, strict=True)))
    over_mass = {
        "position": columns.stiffness,
        "rate": columns.damping,
        "reaction": columns.reaction,
        "force": columns.force,
    }
    solved: Any = {n: np.linalg.solve(columns.mass, matrix) for n, matrix in over_mass.items()}
    return LinearSystems(
        frequency=columns.frequency,
        **solved,
        gap=columns.gap,
        motion=columns.motion,
        stiffness=columns.contact_stiffness,
        damping=columns.contact_damping,
        half_clearance=columns.half_clearance,
        orders=kinds.orders,
        one_sided=kinds.one_sided,
        damped_in_contact=kinds.damped_in_contact,
        names=kinds.coordinates,
    )
