"""The configuration of a gear train or a planetary set."""

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import cached_property
from types import MappingProxyType
from typing import Any

from gearchaos.configuration.keys import key
from gearchaos.configuration.messages import Fault, suggestion
from gearchaos.configuration.rules import GENERIC_RULES, Rules
from gearchaos.configuration.tables import OF_CONTROLLERS, Parameter
from gearchaos.models.linear.configuration import MachineConfiguration, parameters_in
from gearchaos.models.linear.machine import Actuator, Kinds, Parts, without_drift
from gearchaos.models.linear.rules import add_rules_of_machines
from gearchaos.models.linear.values import with_numbers
from gearchaos.models.stiffness_table import IN_N_PER_UM, with_stiffness_files
from gearchaos.models.train import geometry, planetary, shafts
from gearchaos.models.train.assembly import Assembly
from gearchaos.models.train.tables import (
    Gears,
    Meshes,
    MeshStiffness,
    ModelTable,
    Operation,
    Planetary,
    Scene,
    Shafts,
)
from gearchaos.models.train.waves import MOST_ORDER

RULES = Rules()

MOST_SHIFTED_TEETH = 2
"""Teeth of a planet more or fewer than fit, for which profile shift can make up."""

PARTS = ("operation", "shaft", "gear", "mesh", "planetary")
"""Tables that describe the train."""


class TrainConfiguration(MachineConfiguration):
    """A gear train of shafts, gears and meshes, or a planetary set."""

    kind = "train"
    rules = RULES

    model: ModelTable = key("which model the file describes")
    scene: Scene = key("which effects exist", default=Scene())
    operation: Operation = key("how the train runs")
    shaft: Shafts = key("the shafts by name", default={})
    gear: Gears = key("the gears by name", default={})
    mesh: Meshes = key("the meshes by name", default={})
    planetary: Planetary | None = key("a planetary set", default=None)

    @classmethod
    def with_files(
        cls, tables: Mapping[str, Any], folder: str | None
    ) -> tuple[Mapping[str, Any], list[Fault]]:
        """Return tables with the tables of stiffness in the files that they name, and faults."""
        return with_stiffness_files(tables, folder)

    @property
    def meshes(self) -> Iterator[tuple[str, MeshStiffness]]:
        """The meshes by the path of their table."""
        for name, mesh in self.mesh.items():
            yield f"mesh.{name}", mesh
        if self.planetary is not None:
            yield "planetary.sun_mesh", self.planetary.sun_mesh
            yield "planetary.ring_mesh", self.planetary.ring_mesh

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:  # type: ignore[override]
        """The numbers that a sweep can vary, by their dotted path."""
        # A table with a fault of its own is missing; its speed is a parameter nevertheless.
        operation = Operation.model_construct(speed_rpm=1.0)
        tables = {"operation": operation} | {
            name: getattr(self, name) for name in PARTS if hasattr(self, name)
        }
        return MappingProxyType(parameters_in(type(self), tables) | dict(OF_CONTROLLERS))

    @property
    def actuators(self) -> tuple[str, ...]:  # type: ignore[override]
        """The shafts that can turn, or the loaded member, whose torque a controller can change."""
        if self.planetary is not None:
            return (self.planetary.loaded,)
        return tuple(name for name, one in self.shaft.items() if not one.uniform)

    def actuator_at(self, values: Mapping[str, float], name: str) -> Actuator:
        """Return the torque of a shaft or member in N m with these values of the parameters."""
        tables = with_numbers({"shaft": self.shaft, "planetary": self.planetary}, values)
        if self.planetary is None:
            return Actuator({f"{name}_angle": shafts.TORQUE}, tables["shaft"][name].torque_Nm)
        given = tables["planetary"]
        return Actuator(
            {f"{name}_u": planetary.force_of_torque(given, name)}, planetary.torques(given)[name]
        )

    @property
    def is_complete(self) -> bool:
        """Whether the parts of the train are named and connected, so that its states follow."""
        checks = (_there_is_one_train, _names_exist, _the_train_is_connected)
        return not any(True for check in checks for _ in check(self))

    @cached_property
    def kinds_of_elements(self) -> Kinds:
        """Names, orders and kinds that all lanes share."""
        return self._assembled({}).kinds()

    rate = "operation.speed_rpm"

    def parts(self, values: Mapping[str, float]) -> Parts:
        """Return the machine at any frequency, with these values of the other parameters."""
        return Parts(self._assembled(values).machine(self.frequency_at(values)))

    def frequency_at(self, values: Mapping[str, float]) -> float:
        """Return the angular frequency of the excitation in rad/ms."""
        speed = values.get(self.rate, self.operation.speed_rpm)
        return 2.0 * math.pi * self.common_rate * speed / 60.0 * 1e-3

    @cached_property
    def common_rate(self) -> float:
        """Return the common periods of all meshes in a turn of the input member."""
        if self.planetary is not None:
            return planetary.mesh_rate(self.planetary)
        rate = shafts.first_mesh_rate(self.gear, self.mesh, self.speeds())
        return float(rate / self.orders()[next(iter(self.mesh))])

    @property
    def has_one_mesh_frequency(self) -> bool:
        """Whether all meshes have the same frequency."""
        return self.planetary is not None or {*self.orders().values()} == {1}

    def _assembled(self, values: Mapping[str, float]) -> Assembly:
        """Return the parts of the train with these values of the swept parameters."""
        tables = with_numbers({name: getattr(self, name) for name in PARTS}, values)
        effects = self.scene.effects
        if self.planetary is not None:
            return planetary.assembled(tables["planetary"], effects)
        gears = geometry.completed(tables["gear"], tables["mesh"])
        return shafts.assembled(tables["shaft"], gears, tables["mesh"], self.orders(), effects)

    def speeds(self) -> dict[str, Fraction]:
        """Return the speed of each shaft relative to the input shaft."""
        first = next((name for name, one in self.shaft.items() if one.uniform), "")
        first = first or next(iter(self.shaft), "")
        return shafts.speeds_of(self.shaft, self.gear, self.mesh, first)

    def orders(self) -> dict[str, int]:
        """Return for each mesh its mesh periods within the common period."""
        return shafts.mesh_orders(self.gear, self.mesh, self.speeds())


@RULES.reads("shaft", "gear", "mesh", "planetary")
def _there_is_one_train(config: TrainConfiguration) -> Iterator[Fault]:
    """The file describes either shafts and meshes, or a planetary set."""
    if config.planetary is None and not config.mesh:
        rule = "is missing: the train has no mesh"
        yield Fault("mesh", rule, "give [shaft.NAME], [gear.NAME] and [mesh.NAME], or [planetary]")
    elif config.planetary is not None and (config.shaft or config.gear or config.mesh):
        rule = "cannot be combined with [shaft], [gear] and [mesh]"
        yield Fault("planetary", rule, "keep one of the two")


@RULES.reads("shaft", "gear", "mesh")
def _names_exist(config: TrainConfiguration) -> Iterator[Fault]:
    """Gears name shafts, and meshes name gears; the meshes connect all shafts."""
    for name, gear in config.gear.items():
        if gear.shaft not in config.shaft:
            remedy = suggestion(gear.shaft, config.shaft) or f"there are {', '.join(config.shaft)}"
            yield Fault(f"gear.{name}.shaft", "is the name of no shaft", remedy, gear.shaft)
    for name, mesh in config.mesh.items():
        for one in mesh.gears:
            if one not in config.gear:
                remedy = suggestion(one, config.gear) or f"there are {', '.join(config.gear)}"
                yield Fault(f"mesh.{name}.gears", f"names {one}, which is no gear", remedy)


@RULES.reads("shaft", "mesh")
def _parts_are_there_once(config: TrainConfiguration) -> Iterator[Fault]:
    """One shaft is the input, and a mesh has two gears that no other mesh has."""
    inputs = [name for name, one in config.shaft.items() if one.uniform]
    if len(inputs) > 1:
        rule = f"uniform = true is given for {', '.join(inputs)}, and one shaft is the input"
        yield Fault("shaft", rule, "keep it for one of them")
    known: dict[frozenset[str], str] = {}
    for name, mesh in config.mesh.items():
        pair = frozenset(mesh.gears)
        if len(pair) == 1:
            rule = "names one gear twice"
            yield Fault(f"mesh.{name}.gears", rule, "give two gears", list(mesh.gears))
        elif pair in known:
            rule = f"names the gears of mesh.{known[pair]}"
            yield Fault(f"mesh.{name}.gears", rule, "remove one of the two", list(mesh.gears))
        known.setdefault(pair, name)


@RULES.reads("shaft", "gear", "mesh")
def _the_train_is_connected(config: TrainConfiguration) -> Iterator[Fault]:
    """Meshes connect all shafts, let them turn, and repeat after a reasonable time."""
    if not config.mesh or any(True for _ in _names_exist(config)):
        return
    apart = config.shaft.keys() - config.speeds().keys()
    if apart:
        rule = f"no mesh connects {', '.join(sorted(apart))} with the other shafts"
        yield Fault("mesh", rule, "add the mesh, or remove the shaft")
        return
    blocked = shafts.blocked_mesh(config.gear, config.mesh, config.speeds())
    if blocked:
        rule = "cannot turn with the other meshes: they give its gears different pitch line speeds"
        remedy = "correct the numbers of teeth, or remove the mesh"
        yield Fault(f"mesh.{blocked}.gears", rule, remedy, list(config.mesh[blocked].gears))
        return
    orders = config.orders()
    highest = max(config.mesh[name].kept_harmonics * order for name, order in orders.items())
    if highest > MOST_ORDER:
        periods = ", ".join(f"{order} of {name}" for name, order in orders.items())
        rule = f"the meshes repeat together only after {periods} mesh periods"
        remedy = f"choose numbers of teeth with common factors, or fewer harmonics; {highest} times"
        yield Fault("mesh", rule, f"{remedy} the common frequency exceed {MOST_ORDER}")


@RULES.reads("gear", "mesh")
def _gears_fit_each_other(config: TrainConfiguration) -> Iterator[Fault]:
    """Every gear has one size, and gears in mesh have the same base pitch."""
    gears = geometry.completed(config.gear, config.mesh)
    faults = [
        fault
        for name, gear in gears.items()
        for fault in geometry.faults_of_gear(f"gear.{name}", gear)
    ]
    yield from faults
    if faults or any(True for _ in _names_exist(config)):
        return
    for name, mesh in config.mesh.items():
        yield from geometry.faults_of_mesh(f"mesh.{name}", mesh, gears)
    for path, table in config.swept.items():
        if mate := geometry.fault_of_sweep(path, config.gear, config.mesh):
            rule = f"would change one gear of a mesh, and gear.{mate} has its own tooth data"
            remedy = f"leave out normal_module_mm of gear.{mate}, which then has those of its mate"
            if path.endswith(geometry.RADIUS):
                remedy = "give normal_module_mm in place of base radii, and sweep that"
            yield Fault(table, rule, remedy, path)


@RULES.reads("mesh", "planetary")
def _every_mesh_has_one_stiffness(config: TrainConfiguration) -> Iterator[Fault]:
    """A mesh has either a mean stiffness or a table, whose unit is that of a stiffness."""
    for path, mesh in config.meshes:
        given = mesh.stiffness_N_per_um
        if mesh.stiffness is None and given is None:
            remedy = "give it, or stiffness with a table"
            yield Fault(f"{path}.stiffness_N_per_um", "is missing", remedy)
        elif mesh.stiffness is not None and given is not None:
            rule = "is given beside a table of the stiffness"
            yield Fault(f"{path}.stiffness_N_per_um", rule, "keep one of the two", given)
        elif mesh.stiffness is not None and mesh.stiffness.unit not in IN_N_PER_UM:
            rule = f"must be one of {', '.join(IN_N_PER_UM)}"
            remedy = "give the unit, or name it in the heading of the column"
            yield Fault(f"{path}.stiffness.unit", rule, remedy, mesh.stiffness.unit or "missing")


@RULES.reads("operation", "shaft", "gear", "mesh", "planetary", "scene")
def _the_train_is_held(config: TrainConfiguration) -> Iterator[Fault]:
    """Something keeps every part of the train in place."""
    faults = (_planets_can_be_assembled, _every_mesh_has_one_stiffness, _gears_fit_each_other)
    if not config.is_complete or any(True for check in faults for _ in check(config)):
        return
    loose = without_drift(config.machine({}), config.kinds_of_elements.coordinates)
    if loose:
        rule = f"nothing holds {', '.join(loose)}, even with all teeth in contact"
        remedy = "set uniform = true for the input shaft"
        where = "planetary" if config.planetary is not None else "shaft"
        yield Fault(where, rule, remedy if where == "shaft" else "give rotation_N_per_um")


@RULES.reads("planetary")
def _planets_can_be_assembled(config: TrainConfiguration) -> Iterator[Fault]:
    """Equally spaced planets fit between sun and ring, and the members have different tasks."""
    given = config.planetary
    if given is None:
        return
    both = given.sun_teeth + given.ring_teeth
    if both % given.planets:
        rule = f"{given.planets} equally spaced planets need sun_teeth + ring_teeth = {both} to be "
        fitting = [n for n in range(2, 13) if both % n == 0]
        remedy = f"choose {', '.join(map(str, fitting)) or 'other'} planets, or other teeth"
        yield Fault("planetary.planets", rule + "a multiple of their number", remedy, given.planets)
    yield from _planets_fit(given)
    tasks = (given.input, given.fixed, given.loaded)
    if len(set(tasks)) < len(tasks):
        rule = "input, fixed and loaded must be three different members"
        yield Fault("planetary", rule, "give each of sun, ring and carrier one of them", tasks)


def _planets_fit(given: Planetary) -> Iterator[Fault]:
    """A planet fills the space between sun and ring, and has room beside its neighbours."""
    wanted = (given.ring_teeth - given.sun_teeth) / 2.0
    if abs(given.planet_teeth - wanted) > MOST_SHIFTED_TEETH:
        rule = f"leaves no common axis of sun and ring: (ring_teeth - sun_teeth) / 2 = {wanted:g}"
        remedy = f"choose about {wanted:g}; profile shift makes up for {MOST_SHIFTED_TEETH} teeth"
        yield Fault("planetary.planet_teeth", rule, remedy, given.planet_teeth)
    elif given.planets > 1:
        apart = (given.sun_teeth + wanted) * math.sin(math.pi / given.planets)
        if apart < wanted:
            rule = "equally spaced planets overlap: their pitch circles cut each other"
            remedy = "choose fewer planets, or a larger sun"
            yield Fault("planetary.planets", rule, remedy, given.planets)


@RULES.reads("shaft")
def _bearings_need_a_mass(config: TrainConfiguration) -> Iterator[Fault]:
    """A shaft that a bearing lets move has a mass."""
    for name, shaft in config.shaft.items():
        if shaft.bearing_N_per_um is not None and shaft.mass_kg is None:
            rule = "is missing for a shaft with a bearing"
            yield Fault(f"shaft.{name}.mass_kg", rule, "give the mass of the shaft with its gears")


add_rules_of_machines(RULES, PARTS)
RULES.extend(GENERIC_RULES)
