"""Pitch errors tooth by tooth, measured or drawn by a grade: their files and their rules."""

import csv
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gearchaos.arrays import Floats
from gearchaos.configuration.messages import Fault
from gearchaos.configuration.methods import DEFAULT, METHODS
from gearchaos.configuration.named_files import CsvText, fault_of, text_beside
from gearchaos.configuration.tables import swept_values
from gearchaos.errors import GearchaosError
from gearchaos.models.gear_pair.physical_tables import (
    GearDeviations,
    GradeError,
    SineError,
    TeethError,
)
from gearchaos.models.gear_pair.rules import RULES
from gearchaos.models.gear_pair.tables import SWEEPABLE_KEYS, GearPairTables
from gearchaos.models.gear_pair.tooth_deviations import counted_deviations, tooth_deviations

LISTS = {"cumulative": "cumulative_um", "single": "single_um"}
"""Keys of the lists of deviations by what a column holds."""

_IN_ENGLISH = ("tooth", "tooth no", "tooth number", "no", "number")
_IN_GERMAN = ("zahn", "zahn nr", "zahn-nr", "zahnnr", "zahnnummer", "nr", "nummer")
TOOTH_HEADINGS = frozenset((*_IN_ENGLISH, *_IN_GERMAN))
"""Headings of tooth numbers, in small letters and without a point at the end."""

OF_DRAWN_GEARS = ("pitch_error.grade", "pitch_error.eccentricity")
"""Keys that change the drawn gears, but no group."""

_OTHER_UNIT = re.compile(r"(?:[\[(] *|_)(mm|in|inch|mil) *[\])]?$", re.IGNORECASE)
"""The end of a heading that names a unit other than um."""

_OF_SINGLE = re.compile(r"f_?pt?(?![A-Za-z])|(?i:.*(?:single|einzel))")
"""A heading of single deviations, which ISO 1328-1 writes with a small f, in words or symbols."""

_LARGEST_SUM_UM, _LARGEST_SUM_SHARE = 0.1, 0.01
"""Largest sum of all single deviations that rounding in a list can leave."""


def with_deviation_files(
    tables: Mapping[str, Any], folder: str | None
) -> tuple[Mapping[str, Any], list[Fault]]:
    """Return the tables of a configuration with the deviations in the files they name, and faults.

    The numbers go into the table of the gear, where none are listed, and the text into ``files``,
    from which it is taken when it is needed again. Other files are read from ``folder`` only, none
    without it: a result from elsewhere must not open files of this machine.
    """
    faults = []
    for gear in ("driving", "driven"):
        error, files = _table(tables, "pitch_error"), _table(tables, "files")
        table = _table(error, gear)
        name = table.get("file")
        if not isinstance(name, str) or not table.keys().isdisjoint(LISTS.values()):
            continue
        read = LISTS.get(str(table.get("holds")), LISTS["cumulative"])
        try:
            if not isinstance(files.get(name), str):
                files[name] = text_beside(folder, name, "file of pitch deviations")
            table[read] = _column(files[name], table)
            tables = {**tables, "pitch_error": {**error, gear: table}, "files": files}
        except (GearchaosError, ValueError, csv.Error) as fault:
            faults.append(fault_of(f"pitch_error.{gear}.file", fault, name))
    return tables, faults


def _column(text: str, table: Mapping[str, Any]) -> list[float]:
    """Return the deviations in the text of an inspection sheet, in the order of the teeth."""
    name, numbers = table.get("column"), table.get("tooth_column")
    if unit := _OTHER_UNIT.search(str(name)):
        rule = f"column {name} is headed in {unit[1]}, and deviations are read in um"
        raise ValueError(rule, "convert the column, and name um in its heading")
    if _OF_SINGLE.match(str(name)) and "holds" not in table:
        rule = f"column {name} is headed as single deviations, and cumulative ones are the default"
        raise ValueError(rule, 'set holds = "single", or holds = "cumulative" if they are added up')
    sheet = CsvText(text, decimal_comma=True, heading=name)
    if isinstance(numbers, str):
        return sheet.numbered_column(name, numbers, "tooth")
    others = [one for one in sheet.headings if one != name and sheet.headings.count(one) == 1]
    known = [one for one in others if one.lower().rstrip(".") in TOOTH_HEADINGS]
    if len(known) == 1:
        return sheet.numbered_column(name, known[0], "tooth")
    orders = {one: values for one in known or others if (values := _numbered(sheet, name, one))}
    if len({*orders.values()}) > 1:
        rule = f"columns {', '.join(orders)} number the teeth in different orders"
        raise ValueError(rule, "choose one of them with tooth_column")
    return [*next(iter(orders.values()))] if orders else sheet.column(name, "tooth")


def _numbered(sheet: CsvText, name: object, numbers: str) -> tuple[float, ...]:
    """Return the numbers of a column in the order of another one, if that numbers all of them."""
    try:
        every, ordered = sheet.column(name), sheet.numbered_column(name, numbers, "tooth")
    except ValueError:
        return ()
    return tuple(ordered) if 1 < len(ordered) == len(every) else ()


def _table(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = tables.get(name)
    return dict(found) if isinstance(found, Mapping) else {}


def _kind(config: GearPairTables) -> str:
    return "sine" if config.pitch_error is None else config.pitch_error.kind


@RULES.reads("pitch_error", "pair")
def _every_tooth_has_one_sound_deviation(config: GearPairTables) -> Iterator[Fault]:
    error, pair = config.pitch_error, config.pair
    if pair is None and _kind(config) != "sine":
        rule = f'is missing, and pitch_error.kind = "{_kind(config)}" takes teeth and angles of it'
        yield Fault("pair", rule, "give [pair]")
    if not isinstance(error, TeethError):
        return
    if error.driving is None and error.driven is None:
        remedy = "give [pitch_error.driving], [pitch_error.driven] or both"
        yield Fault("pitch_error", 'kind = "teeth" needs the deviations of a gear', remedy)
    for gear, name in enumerate(("driving", "driven")):
        table, here = getattr(error, name), f"pitch_error.{name}"
        given = [one for one in LISTS.values() if getattr(table, one, None) is not None]
        if table is not None and len(given) != 1:
            remedy = "give cumulative_um, or single_um, or file and column"
            yield Fault(here, f"holds {len(given)} lists of deviations, must be one", remedy)
        elif table is not None and pair is not None:
            file = "" if table.file is None else f"{table.file}, column {table.column}: "
            for rule, remedy in _unsound(table, pair.teeth[gear], pair.normal_module_mm):
                yield Fault(f"{here}.{given[0]}", file + rule, remedy)


def _unsound(table: GearDeviations, teeth: int, module_mm: float) -> Iterator[tuple[str, str]]:
    """Yield the rule that a list of deviations breaks, with its remedy."""
    given = table.cumulative_um or table.single_um or ()
    if len(given) != teeth:
        yield f"holds {len(given)} values for {teeth} teeth", "give one for every tooth"
        return
    if table.cumulative_um is None:
        total, largest = sum(given), max(map(abs, given))
        if abs(total) > max(_LARGEST_SUM_UM, _LARGEST_SUM_SHARE * largest):
            rule = f"sum to {total:.6g} um, and single deviations around a circle sum to zero"
            yield rule, "look for a missing or a wrong one, or give cumulative_um"
            return
    with np.errstate(all="ignore"):
        found = counted_deviations(table)
    worst = found[np.argmax(np.abs(found))]
    # A tenth of the module in micrometres.
    if not abs(worst) <= 100.0 * module_mm:
        rule = f"place a tooth {worst:.6g} um off tooth 0, more than a tenth of the module"
        yield rule, "give deviations, not places, in micrometres"


@RULES.reads("pitch_error", "integration")
def _maps_know_the_sine(config: GearPairTables) -> Iterator[Fault]:
    if _kind(config) != "sine" and METHODS[config.integration.method].shares_maps:
        rule = f'cannot be computed with integration.method = "{config.integration.method}"'
        remedy = f'set integration.method = "{DEFAULT.name}"'
        yield Fault("pitch_error.kind", rule, remedy, _kind(config))


@RULES.reads("pitch_error", "groups")
def _keys_belong_to_the_kind(config: GearPairTables) -> Iterator[Fault]:
    kind, of_a_sine = _kind(config), ("pitch_error_amplitude", "pitch_error_phase_deg")
    own = SineError if config.pitch_error is None else type(config.pitch_error)
    named = {f"groups.{name}": name for name in config.groups.given()}
    named |= {f"{table}.parameter": sweep.parameter for table, sweep in config.sweeps.items()}
    rule = f'has no meaning with pitch_error.kind = "{kind}"'
    for key, name in named.items():
        table, _, field = name.partition(".")
        if name in of_a_sine and kind != "sine":
            yield Fault(key, rule, "drop it: the teeth decide, and pitch_error multiplies them")
        if table == "pitch_error" and name in SWEEPABLE_KEYS and field not in own.model_fields:
            yield Fault(key, rule, "choose another pitch_error.kind, or sweep pitch_error", name)


def grade_faults(config: GearPairTables, swept: Mapping[str, Floats]) -> Iterator[Fault]:
    """Yield the faults of the grades of the lanes; ``swept`` has both ends of every sweep."""
    if not isinstance(config.pitch_error, GradeError):
        return
    for table, sweep in config.sweeps.items():
        if sweep.parameter == "pitch_error.grade" and np.any(swept_values(sweep) % 1.0 != 0.0):
            rule = "grades are whole numbers, and it sweeps others"
            yield Fault(table, rule, "choose from, to and count to meet them, or list values")
            return
    ends = np.ix_(*(values[[0, -1]] for values in swept.values()))
    try:
        tooth_deviations(config.pitch_error, config.pair, dict(zip(swept, ends, strict=True)))
    except ValueError as error:
        yield Fault("pitch_error", str(error), 'choose within, or give kind = "teeth"')
