"""Reading a targets file, with one message for every fault."""

import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from gearchaos.configuration import Configuration, load_config
from gearchaos.configuration.keys import keys_of
from gearchaos.configuration.messages import Fault, faults_of, texts
from gearchaos.configuration.toml_text import (
    tables_from_toml,
    text_of_file,
    toml_literal,
    with_overrides,
)
from gearchaos.errors import ConfigurationError
from gearchaos.identification.targets import Targets
from gearchaos.records.period import LONGEST_PERIOD, POINTS_NEEDED

MOTION = re.compile(r"(?P<kind>period|bands) (?P<number>[1-9]\d?)|chaotic|aperiodic")
"""The motions that a stage may have."""

OBSERVATIONS = ("stage", "jump", "crisis", "exponent", "increment")  # Tables of what was observed.


class Problem(NamedTuple):
    """What is to be found: the targets, and the configuration that computes them."""

    targets: Targets
    config: Configuration
    text: str


def load_targets(file: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Problem:
    """Read a targets file and the configuration that it names.

    ``overrides`` replace keys of the targets file, such as ``search.seed=2``. Raises FileError if
    one of the two cannot be read, ConfigurationError if one is not sound: one message per fault.
    """
    source = os.fspath(file)
    text = text_of_file(source)
    tables = with_overrides(tables_from_toml(text, source), overrides, source)
    try:
        targets = Targets.model_validate(tables)
    except ValidationError as error:
        worded, more = faults_of(error, {one.path: one for one in keys_of(Targets)})
        raise ConfigurationError(texts(worded, source, more)) from None
    if faults := list(_faults(targets)):
        raise ConfigurationError(texts(faults, source))
    # What is observed is kept, and no more: the axial pair, which is driven one way, is computed
    # only where somebody looks at it.
    section = [*dict.fromkeys(("delta_5", *(one.coordinate for one in targets.increment)))]
    outputs = {"section": section, "section_points": 1, "lyapunov": bool(targets.exponent)}
    replaced = [*targets.set, f"outputs={toml_literal(outputs)}"]
    config = load_config(Path(source).parent / targets.configuration, replaced)
    if problems := list(_unfit(config, targets, source)):
        raise ConfigurationError(problems)
    return Problem(targets, config, text)


def _faults(targets: Targets) -> Iterator[Fault]:
    for name, times in Counter(one.name for one in targets.parameter).items():
        if times > 1:
            yield Fault("parameter.name", f"comes {times} times", "name it once", name)
    for table, low, high in (("parameter", "low", "high"), ("stage", "from", "to")):
        for number, one in enumerate(getattr(targets, table)):
            ends = one.model_dump()
            if ends[high] <= ends[low]:
                rule = f"must be greater than {table}[{number}].{low} = {ends[low]}"
                yield Fault(f"{table}[{number}].{high}", rule, "exchange the two", ends[high])
    for number, free in enumerate(targets.parameter):
        if free.logarithmic and free.low <= 0.0:
            remedy = "raise it, or drop logarithmic"
            yield Fault(f"parameter[{number}].low", "has no logarithm", remedy, free.low)
    for number, stage in enumerate(targets.stage):
        motion = MOTION.fullmatch(stage.motion)
        if motion is None or int(motion["number"] or 1) > LONGEST_PERIOD:
            rule = 'must be "period n" or "bands n" with n up to 16, "chaotic" or "aperiodic"'
            yield Fault(f"stage[{number}].motion", rule, 'such as "period 2"', stage.motion)
    for table in ("jump", "crisis"):
        for number, place in enumerate(getattr(targets, table)):
            if not place.within[0] < place.at < place.within[1]:
                rule = f"must hold {table}.at = {place.at}, low end first"
                yield Fault(f"{table}[{number}].within", rule, "widen it", place.within)
    if not any(getattr(targets, table) for table in OBSERVATIONS):
        rule = "is missing, and so are the other observations"
        yield Fault("stage", rule, f"give at least one of {', '.join(OBSERVATIONS)}")
    search = targets.search
    if not search.population <= search.drawn <= search.candidates:
        rule = (
            f"must be at least search.population = {search.population} and at most "
            f"search.candidates = {search.candidates}"
        )
        yield Fault("search.drawn", rule, "it is a part of the candidates", search.drawn)


def _unfit(config: Configuration, targets: Targets, source: str) -> Iterator[str]:
    for key, several in {
        "second_sweep": config.second_sweep is not None,
        "start.count": config.start.count > 1,
        'start.carry = "both"': config.start.carry == "both",
    }.items():
        if several:
            yield f"{source}: configuration: {config.source} has {key}; observations have one axis"
    if config.pitch_error is not None and config.pitch_error.kind != "sine":
        yield (
            f"{source}: configuration: {config.source} has pitch_error.kind = "
            f'"{config.pitch_error.kind}"; candidates are compared once a mesh period, as a sine '
            'at mesh frequency repeats; give kind = "sine"'
        )
    if config.integration.recorded_periods < POINTS_NEEDED:
        yield (
            f"{source}: integration.recorded_periods = {config.integration.recorded_periods}: must "
            f"be at least {POINTS_NEEDED}, to tell every period; raise it in `set`"
        )
    if config.second_sweep is not None:
        return
    # A second sweep over the bounds obeys the rules that a free parameter must obey.
    for number, free in enumerate(targets.parameter):
        bounds = {"parameter": free.name, "from": free.low, "to": free.high, "count": 2}
        names = {"parameter": "name", "from": "low", "to": "high"}
        own = {f"second_sweep.{key}": f"parameter[{number}].{name}" for key, name in names.items()}
        yield from _refusals(config, source, "second_sweep", bounds, own)
    for key, value in _places(targets):
        place = {"parameter": config.sweep.parameter, "values": [value]}
        yield from _refusals(config, source, "sweep", place, {"sweep.values": key})


def _refusals(
    config: Configuration, source: str, table: str, value: Any, own: dict[str, str]
) -> Iterator[str]:
    """Word why a configuration cannot have such a table, with the file's own names of its keys."""
    try:
        config.replace(table, value)
    except ConfigurationError as error:
        for problem in error.problems:
            told = problem.removeprefix(f"{config.source}: ")
            for name, mine in own.items():
                told = told.replace(name, mine)
            yield f"{source}: {told}"


def _places(targets: Targets) -> Iterator[tuple[str, float]]:
    """Yield where on the axis of the sweep something is looked at, each place with its key."""
    for table in OBSERVATIONS:
        for number, one in enumerate(getattr(targets, table)):
            for name, value in one.model_dump().items():
                if name in ("from", "to", "at", "within"):
                    for place in value if name == "within" else [value]:
                        yield f"{table}[{number}].{name}", place
