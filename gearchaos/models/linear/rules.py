"""Rules that tie several keys of a machine together."""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.configuration.messages import Fault, suggestion
from gearchaos.configuration.methods import DEFAULT, METHODS
from gearchaos.configuration.rules import Rules
from gearchaos.models.linear.machine import without_drift
from gearchaos.models.linear.tables import MATRICES, Row, Shares

if TYPE_CHECKING:
    from gearchaos.models.linear.configuration import LinearConfiguration, MachineConfiguration

RULES = Rules()


@RULES.reads("model")
def _matrices_have_the_size_of_the_machine(config: "LinearConfiguration") -> Iterator[Fault]:
    """Every matrix has one row and one column for each coordinate."""
    count = len(config.model.coordinates)
    for name in MATRICES:
        given = getattr(config.model, name)
        if isinstance(given, Shares):
            continue
        lengths = {len(row) for row in given if isinstance(row, tuple)}
        if len(given) != count or lengths - {count}:
            rule = f"must have {count} rows and columns, one for each of model.coordinates"
            yield Fault(f"model.{name}", rule, "give its rows, or its diagonal", given)


@RULES.reads("model", "clearance", "force")
def _rows_name_coordinates(config: "LinearConfiguration") -> Iterator[Fault]:
    """Gaps, reactions and forces are rows of coordinates that exist."""
    names = config.model.coordinates
    rows: list[tuple[str, Row | None]] = []
    for name, one in config.clearance.items():
        rows += [(f"clearance.{name}.gap", one.gap), (f"clearance.{name}.reaction", one.reaction)]
    rows += [(f"force.{name}.on", one.on) for name, one in config.force.items()]
    for path, row in rows:
        for unknown in (row or {}).keys() - set(names):
            rule = "is none of model.coordinates"
            remedy = suggestion(unknown, names) or f"there are {', '.join(names)}"
            yield Fault(path, f"names {unknown}, which {rule}", remedy, row)
        if row is not None and not any(row.values()):
            remedy = f"give a factor to one of {', '.join(names)}"
            yield Fault(path, "has no coordinate with a factor other than 0", remedy, row)


@RULES.reads("model", "clearance", "force")
def _the_machine_can_move_and_is_held(config: "LinearConfiguration") -> Iterator[Fault]:
    """The mass matrix is not singular, and springs hold every coordinate."""
    faults = (_matrices_have_the_size_of_the_machine, _rows_name_coordinates)
    if any(True for check in faults for _ in check(config)):
        return
    machine, names = config.machine({}), config.model.coordinates
    if np.linalg.matrix_rank(machine.mass) < len(names):
        rule = "is singular, so that some acceleration is not determined"
        yield Fault("model.mass", rule, "give every coordinate a mass", config.model.mass)
        return
    if np.linalg.eigvals(machine.mass).real.min() < 0.0:
        rule = "is not positive definite: some motion would have a negative mass"
        yield Fault("model.mass", rule, "check its entries", config.model.mass)
        return
    for name, one in config.clearance.items():
        mean = one.waves.mean
        if mean <= 0.0:
            rule = "must be greater than 0, otherwise the element is no spring"
            yield Fault(f"clearance.{name}.stiffness", rule, "give it a stiffness", mean)
    loose = without_drift(machine, names)
    if loose:
        rule = f"no spring holds {', '.join(loose)}, even with all elements in contact"
        remedy = "tie one of them to the ground, or describe the machine by relative coordinates"
        yield Fault("model.stiffness", rule, remedy)


@RULES.reads("scene")
def _there_are_no_effects(config: "LinearConfiguration") -> Iterator[Fault]:
    """A machine that is given by its matrices has no effects that could be left out."""
    if config.scene.effects:
        rule = "has no meaning for a machine that is given by its matrices"
        yield Fault("scene.effects", rule, "leave it out", config.scene.effects)


def _known_states(table: str, name: str) -> Callable[["LinearConfiguration"], Iterator[Fault]]:
    """Return a rule that the states named by a key exist."""

    def check(config: "LinearConfiguration") -> Iterator[Fault]:
        if not config.is_complete:
            return
        states = config.states
        given = tuple(getattr(getattr(config, table), name))
        for unknown in dict.fromkeys(one for one in given if one not in states):
            remedy = suggestion(unknown, states) or f"there are {', '.join(states)}"
            yield Fault(f"{table}.{name}", f"the machine has no state `{unknown}`", remedy, given)

    return check


def _sets_of_branches_are_numbers(config: "MachineConfiguration") -> Iterator[Fault]:
    """A machine has at most as many clearance elements as the method can integrate."""
    method = config.integration.method
    most = METHODS[method].most_elements
    if most is None or not config.is_complete:
        return
    count = len(config.kinds_of_elements.elements)
    if count > most:
        rule = f"takes up to {most} clearance elements; this machine has {count}"
        yield Fault("integration.method", rule, f'set it to "{DEFAULT.name}"', method)


def add_rules_of_machines(rules: Rules, tables: Sequence[str]) -> None:
    """Add rules on the states that [outputs] and [start] name, and on the number of elements.

    ``tables``: those on which states and elements depend.
    """
    rules.reads(*tables, "integration")(_sets_of_branches_are_numbers)
    named = (("outputs", ("section", "states")), ("start", ("state", "box", "drawn")))
    for table, keys in named:
        for key in keys:
            rules.reads(*tables, table)(_known_states(table, key))


add_rules_of_machines(RULES, ["model"])
