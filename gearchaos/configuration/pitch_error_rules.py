"""Rules of pitch errors tooth by tooth, measured or drawn by a grade."""

from __future__ import annotations

import typing
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.configuration.deviation_files import LISTS
from gearchaos.configuration.messages import Fault
from gearchaos.configuration.physical_tables import (
    PHYSICAL_TABLES,
    GearDeviations,
    GradeError,
    TeethError,
)
from gearchaos.configuration.rules import reads
from gearchaos.configuration.sweep_values import FloatArray, swept_values
from gearchaos.gear.tooth_deviations import counted_deviations, tooth_deviations

if TYPE_CHECKING:
    from gearchaos.configuration.models import Configuration

_GRADE = "pitch_error.grade"
_LARGEST_SUM_UM = 0.1
_LARGEST_SUM_SHARE = 0.01
"""What rounding in a list leaves of the sum of all single deviations, at most."""

_LARGEST_SHARE_OF_MODULE = 0.1


def _kind(config: Configuration) -> str:
    return "sine" if config.pitch_error is None else config.pitch_error.kind


def _gears(config: Configuration) -> Iterator[tuple[int, str, GearDeviations]]:
    """Yield of each gear with deviations its number, the path of its table, and the table."""
    if isinstance(config.pitch_error, TeethError):
        tables = (config.pitch_error.driving, config.pitch_error.driven)
        for gear, (name, table) in enumerate(zip(("driving", "driven"), tables, strict=True)):
            if table is not None:
                yield gear, f"pitch_error.{name}", table


@reads("pitch_error")
def _deviations_are_given_once(config: Configuration) -> Iterator[Fault]:
    gears = list(_gears(config))
    if _kind(config) == "teeth" and not gears:
        rule = 'kind = "teeth" needs the deviations of a gear'
        yield Fault("pitch_error", rule, "give [pitch_error.driving], [pitch_error.driven] or both")
    for _, here, table in gears:
        given = [name for name in LISTS.values() if getattr(table, name) is not None]
        if not given:
            remedy = "give cumulative_um, or single_um, or file and column"
            yield Fault(here, "has no deviations", remedy)
        elif len(given) > 1:
            yield Fault(f"{here}.{given[1]}", f"{here}.{given[0]} is given as well", "keep one")


@reads("pitch_error", "pair")
def _every_tooth_has_a_sound_deviation(config: Configuration) -> Iterator[Fault]:
    if config.pair is None:
        if _kind(config) != "sine":
            rule = (
                f'is missing, and pitch_error.kind = "{_kind(config)}" needs its teeth and angles'
            )
            yield Fault("pair", rule, "give [pair]")
        return
    for gear, here, table in _gears(config):
        for name in LISTS.values():
            values: tuple[float, ...] | None = getattr(table, name)
            if values is not None:
                file = "" if table.file is None else f"{table.file}, column {table.column}: "
                for rule, remedy in _unsound(values, name, gear, config):
                    yield Fault(f"{here}.{name}", file + rule, remedy)


def _unsound(
    values: tuple[float, ...], name: str, gear: int, config: Configuration
) -> Iterator[tuple[str, str]]:
    """Yield the rules that a list of deviations breaks, with their remedies."""
    assert config.pair is not None
    teeth, module = config.pair.teeth[gear], config.pair.normal_module_mm
    if len(values) != teeth:
        rule = f"holds {len(values)} values, and pair.teeth[{gear}] = {teeth}"
        yield rule, "give one for every tooth"
        return
    single = name == LISTS["single"]
    total, largest = sum(values), max(map(abs, values))
    if single and abs(total) > max(_LARGEST_SUM_UM, _LARGEST_SUM_SHARE * largest):
        rule = f"sum to {total:.6g} um, and single deviations around a circle sum to zero"
        yield rule, "look for a missing or a wrong one, or give cumulative_um"
        return
    found = counted_deviations(None, values) if single else counted_deviations(values, None)
    worst, limit = int(np.argmax(np.abs(found))), 1e3 * _LARGEST_SHARE_OF_MODULE * module
    if abs(found[worst]) > limit:
        rule = (
            f"places tooth {worst} {found[worst]:.6g} um from where tooth 0 puts it, more than a "
            f"tenth of the module, {limit:.6g} um"
        )
        yield rule, "give deviations from the nominal place, in micrometres"


@reads("pitch_error", "integration")
def _flow_maps_know_the_sine(config: Configuration) -> Iterator[Fault]:
    if _kind(config) != "sine" and config.integration.method == "flow_map":
        rule = 'cannot be computed with integration.method = "flow_map"'
        yield Fault("pitch_error.kind", rule, 'set integration.method = "rk4"', _kind(config))


@reads("pitch_error", "scene")
def _drawn_gears_act(config: Configuration) -> Iterator[Fault]:
    error = config.pitch_error
    several = isinstance(error, GradeError) and error.realisations > 1
    if several and "pitch_error" not in config.scene.effects:
        rule = "drawn gear pairs differ in their pitch error only, and that effect is off"
        yield Fault("pitch_error.realisations", rule, 'add "pitch_error" to scene.effects')


@reads("pitch_error", "groups")
def _keys_belong_to_the_kind(config: Configuration) -> Iterator[Fault]:
    kind, of_a_sine = _kind(config), ("pitch_error_amplitude", "pitch_error_phase_deg")
    swept = {f"{table}.parameter": sweep.parameter for table, sweep in config.sweeps.items()}
    given = {f"groups.{name}": name for name in config.groups.given()}
    rule = f'has no meaning with pitch_error.kind = "{kind}"'
    for key, name in (given | swept).items():
        if name in of_a_sine and kind != "sine":
            yield Fault(key, rule, "drop it: the teeth decide, and pitch_error multiplies them")
    for key, parameter in swept.items():
        table, _, name = parameter.partition(".")
        kinds = [
            typing.get_args(model.model_fields["kind"].annotation)[0]
            for model in PHYSICAL_TABLES["pitch_error"]
            if name in model.model_fields
        ]
        if table == "pitch_error" and kinds and kind not in kinds:
            yield Fault(key, rule, f'it goes with kind = "{kinds[0]}"', parameter)


def moves_drawn_gears(config: Configuration, parameter: str) -> bool:
    """Whether other gears are drawn when a physical key is swept."""
    acting = isinstance(config.pitch_error, GradeError) and "pitch_error" in config.scene.effects
    return acting and parameter in (_GRADE, "pitch_error.eccentricity")


def grade_faults(config: Configuration, swept: Mapping[str, FloatArray]) -> Iterator[Fault]:
    """Yield what is wrong with the grades of the lanes; ``swept`` has both ends of every sweep."""
    if not isinstance(config.pitch_error, GradeError):
        return
    for table, sweep in config.sweeps.items():
        values = swept_values(sweep) if sweep.parameter == _GRADE else np.zeros(0)
        for value in values[values % 1.0 != 0.0][:1]:
            remedy = "choose from, to and count so that they meet whole numbers, or list values"
            yield Fault(table, f"sweeps grade {value:g}, and grades are whole numbers", remedy)
            return
    ends = np.ix_(*(values[[0, -1]] for values in swept.values()))
    try:
        tooth_deviations(config.pitch_error, config.pair, dict(zip(swept, ends, strict=True)))
    except ValueError as error:
        remedy = 'choose another grade or edition, or give the deviations with kind = "teeth"'
        yield Fault(_GRADE, str(error), remedy, config.pitch_error.grade)
