"""The configuration of a machine that is given by its matrices."""

import csv
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cache, cached_property, partial
from io import StringIO
from itertools import product
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.configuration.base import Configuration, configuration_keys
from gearchaos.configuration.keys import Key, key
from gearchaos.configuration.messages import Fault, declared_path
from gearchaos.configuration.named_files import fault_of, text_beside
from gearchaos.configuration.ranges import Range
from gearchaos.configuration.rules import GENERIC_RULES
from gearchaos.configuration.tables import OF_CONTROLLERS, Parameter, swept_values
from gearchaos.errors import GearchaosError
from gearchaos.models.linear.machine import Actuator, Kinds, Machine, Parts
from gearchaos.models.linear.rules import RULES
from gearchaos.models.linear.tables import (
    MATRICES,
    Clearance,
    ClearanceTables,
    Force,
    ForceTables,
    Fourier,
    MachineTable,
    Shares,
    wave_of,
)
from gearchaos.models.linear.values import numbers_in, with_numbers
from gearchaos.models.stiffness_table import with_stiffness_files
from gearchaos.outputs.names import rate_of


class MachineConfiguration(Configuration):
    """A machine with any number of coordinates and clearance elements, and the sweeps of it."""

    @property
    def is_complete(self) -> bool:
        """Whether the parts of the machine are named and connected, so that its states follow."""
        return True

    @cached_property
    @abstractmethod
    def kinds_of_elements(self) -> Kinds:
        """Names, orders and kinds that all lanes share."""

    @abstractmethod
    def parts(self, values: Mapping[str, float]) -> Parts:
        """Return the machine at any frequency, with these values of the other parameters."""

    @abstractmethod
    def frequency_at(self, values: Mapping[str, float]) -> float:
        """Return the angular frequency of the excitation."""

    rate: ClassVar[str]
    """The parameter on which the frequency depends, and of the parts nothing else."""

    def machine(self, values: Mapping[str, float]) -> Machine:
        """Return the machine with these values of the swept parameters."""
        others = {path: value for path, value in values.items() if path != self.rate}
        chosen = tuple(others.items())
        # Continuation needs the same machine at other frequencies at every step. Both are replaced
        # at once, because other threads may use them.
        last, parts = self._last_parts[0]
        if parts is None or last != chosen:
            parts = self.parts(others)
            self._last_parts[0] = chosen, parts
        return parts.machine(self.frequency_at(values))

    @cached_property
    def _last_parts(self) -> list[tuple[tuple[tuple[str, float], ...], Parts | None]]:
        """One entry: the parts that were used last, with their values."""
        return [((), None)]

    @abstractmethod
    def actuator_at(self, values: Mapping[str, float], name: str) -> Actuator:
        """Return an actuator with these values of the swept parameters."""

    def is_idle(self, actuator: str) -> bool:
        """Whether an input is 0 for all values of the sweeps."""
        if actuator not in self.actuators or not self.is_complete:
            return False
        ends = [swept_values(one)[[0, -1]].tolist() for one in self.sweeps.values()]
        names = [one.parameter for one in self.sweeps.values()]
        return not any(
            self.actuator_at(dict(zip(names, values, strict=True)), actuator).steady
            for values in product(*ends)
        )

    @property
    def states(self) -> tuple[str, ...]:
        """States, each coordinate followed by its rate."""
        names = self.kinds_of_elements.coordinates
        return tuple(state for name in names for state in (name, rate_of(name)))


class LinearConfiguration(MachineConfiguration):
    """A machine that is given by its matrices, its clearance elements and its forces."""

    kind = "linear"
    rules = (*RULES, *GENERIC_RULES)
    absolute_limit = "limit_force"

    model: MachineTable = key("the matrices of the machine")
    clearance: ClearanceTables = key("the clearance elements by name", default={})
    force: ForceTables = key("the forces by name", default={})

    @classmethod
    def with_files(
        cls, tables: Mapping[str, Any], folder: str | None
    ) -> tuple[Mapping[str, Any], list[Fault]]:
        """Return tables with the contents of the files that they name, and the faults of these.

        These are matrices and tables of stiffness. The texts of the files are kept in ``files``.
        """
        tables, faults = with_stiffness_files(tables, folder)
        model = tables.get("model")
        model = dict(model) if isinstance(model, Mapping) else {}
        given = tables.get("files")
        files = dict(given) if isinstance(given, Mapping) else {}
        for name in MATRICES:
            file = model.get(name)
            if isinstance(file, str):
                try:
                    if not isinstance(files.get(file), str):
                        files[file] = text_beside(folder, file, "file with a matrix")
                    model[name] = _rows_of(files[file])
                except (GearchaosError, ValueError, csv.Error) as fault:
                    faults.append(fault_of(f"model.{name}", fault, file))
        return ({**tables, "model": model, "files": files} if files else tables), faults

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:  # type: ignore[override]
        """The numbers that a sweep can vary, by their dotted path."""
        frequency = Parameter("frequency", "model.frequency", Range(gt=0), long_name="frequency")
        found = parameters_in(type(self), {"clearance": self.clearance, "force": self.force})
        return MappingProxyType({"frequency": frequency, **found, **OF_CONTROLLERS})

    @property
    def actuators(self) -> tuple[str, ...]:  # type: ignore[override]
        """The forces, whose steady part a controller can change."""
        return tuple(self.force)

    def actuator_at(self, values: Mapping[str, float], name: str) -> Actuator:
        """Return a force with these values of the swept parameters."""
        force: Force = with_numbers({"force": self.force}, values)["force"][name]
        return Actuator(force.on, force.mean)

    @cached_property
    def kinds_of_elements(self) -> Kinds:
        """Names, orders and kinds that all lanes share."""
        return Kinds(
            self.model.coordinates,
            tuple(self.clearance),
            self._orders(),
            tuple(one.one_sided for one in self.clearance.values()),
            tuple(one.damping_acts == "in_contact" for one in self.clearance.values()),
        )

    def _orders(self) -> tuple[int, ...]:
        """Return the orders of all waves, ascending; at least the first one."""
        found = {1} | {one.order for one in self.force.values()}
        for one in self.clearance.values():
            for waves in (one.waves, one.motion):
                if waves is not None:
                    found |= set(range(1, 1 + max(len(waves.cosine), len(waves.sine))))
        return tuple(sorted(found))

    rate = "frequency"

    def frequency_at(self, values: Mapping[str, float]) -> float:
        """Return the angular frequency of the excitation."""
        return float(values.get(self.rate, self.model.frequency))

    def parts(self, values: Mapping[str, float]) -> Parts:
        """Return the machine at any frequency, with these values of the other parameters."""
        tables = with_numbers({"clearance": self.clearance, "force": self.force}, values)
        elements: list[Clearance] = [*tables["clearance"].values()]
        forces: list[Force] = [*tables["force"].values()]
        frequency = self.model.frequency
        machine = Machine(
            frequency=frequency,
            **self._constant,
            force=self._forces(forces, frequency),
            motion=self._waves([one.motion for one in elements]),
            contact_stiffness=self._waves([one.waves for one in elements]),
            contact_damping=np.array([one.damping for one in elements], dtype=np.float64),
            half_clearance=np.array([one.half_clearance for one in elements], dtype=np.float64),
        )
        changes = any(one.times_frequency_squared for one in forces)
        return Parts(machine, partial(self._forces, forces) if changes else None)

    @cached_property
    def _constant(self) -> dict[str, Floats]:
        """Matrices that are the same in every lane, by name."""
        mass, stiffness, damping = self.matrices()
        elements = [*self.clearance.values()]
        return {
            "mass": mass,
            "damping": damping,
            "stiffness": stiffness,
            "reaction": self._rows(one.reaction or one.gap for one in elements).T,
            "gap": self._rows(one.gap for one in elements),
        }

    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """Return the mass, stiffness and damping matrices as given, each of shape (n, n)."""
        mass, stiffness = (_matrix(getattr(self.model, name)) for name in MATRICES[:2])
        damping = self.model.damping
        if isinstance(damping, Shares):
            return mass, stiffness, damping.mass * mass + damping.stiffness * stiffness
        return mass, stiffness, _matrix(damping)

    def _rows(self, rows: Any) -> Floats:
        """Return rows of coordinates with factors, shape (rows, n)."""
        names = self.model.coordinates
        found = [[row.get(name, 0.0) for name in names] for row in rows]
        return np.array(found, dtype=np.float64).reshape(-1, len(names))

    def _waves(self, given: list[Fourier | None]) -> Floats:
        """Return sums of waves by order, shape (sums, w)."""
        orders = self.kinds_of_elements.orders
        waves = np.zeros((len(given), 1 + 2 * len(orders)))
        for row, one in zip(waves, given, strict=True):
            if one is not None:
                row[0] = one.mean
                for part, amplitudes in enumerate((one.cosine, one.sine)):
                    for order, amplitude in enumerate(amplitudes, 1):
                        row[1 + 2 * orders.index(order) + part] = amplitude
        return waves

    def _forces(self, given: Sequence[Force], frequency: float) -> Floats:
        """Return the forces on all coordinates, shape (n, w)."""
        orders = self.kinds_of_elements.orders
        forces = np.zeros((len(self.model.coordinates), 1 + 2 * len(orders)))
        for one in given:
            at = 1 + 2 * orders.index(one.order)
            wave = np.zeros(forces.shape[1])
            wave[0], wave[at], wave[at + 1] = wave_of(one, frequency)
            forces += np.outer(self._rows([one.on])[0], wave)
        return forces


def parameters_in(kind: type[Configuration], tables: Mapping[str, Any]) -> dict[str, Parameter]:
    """Return the numbers inside tables of a configuration as parameters, by their dotted path."""
    found = {}
    for path, _, _ in numbers_in(tables):
        key = _declared_key(kind, path)
        words = f"{key.wording} of {path.split('.')[1]}" if path.count(".") > 1 else key.wording
        found[path] = Parameter(path, path, key.valid, key.units or "1", words)
    return found


@cache
def _declared_key(kind: type[Configuration], path: str) -> Key:
    """Return the key that declares a number; kept, because continuation needs it at every step."""
    keys = configuration_keys(kind)
    return keys[declared_path(path.split("."), keys)]


def _matrix(given: Any) -> Floats:
    """Return the matrix of a diagonal or of rows."""
    array = np.array(given, dtype=np.float64)
    return np.diag(array) if array.ndim == 1 else array


def _rows_of(text: str) -> list[list[float]]:
    """Return the rows of numbers in CSV text."""
    rows = [row for row in csv.reader(StringIO(text)) if any(cell.strip() for cell in row)]
    try:
        return [[float(cell) for cell in row] for row in rows]
    except ValueError as fault:
        rule = f"has a cell that is not a number ({fault})"
        raise ValueError(rule, "give one row of the matrix per line, with commas between") from None
