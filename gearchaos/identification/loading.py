"""Reading a targets file, with one message per fault."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from gearchaos.arrays import Floats
from gearchaos.configuration.keys import keys_of
from gearchaos.configuration.messages import fault_texts, faults_of
from gearchaos.configuration.toml_text import (
    tables_from_toml,
    text_of_file,
    toml_literal,
    with_overrides,
)
from gearchaos.engine.method_choice import with_method
from gearchaos.errors import ConfigurationError
from gearchaos.identification.observations import Observation, observations_of
from gearchaos.identification.targets import Targets
from gearchaos.models import Configuration, load_config
from gearchaos.models.gear_pair.scene import states_of
from gearchaos.records.period import POINTS_NEEDED


class Problem(NamedTuple):
    """A search problem: the targets, and the configuration that computes them.

    Attributes
    ----------
    targets : Targets
        The targets file.
    config : Configuration
        The configuration it names, with the outputs that the observations need.
    text : str
        Text of the targets file.
    observations : list of Observation
        All observations in the order of the file.
    values : (values,)
        Swept values that the observations use, ascending.
    """

    targets: Targets
    config: Configuration
    text: str
    observations: list[Observation]
    values: Floats


def load_targets(file: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Problem:
    """Read a targets file and the configuration that it names.

    Parameters
    ----------
    file : str or PathLike
        The targets file.
    overrides : iterable of str
        Keys of the targets file to replace, such as ``search.seed=2``.

    Raises
    ------
    FileError
        If one of the two files cannot be read.
    ConfigurationError
        If one of them is invalid, with one message per fault.
    """
    source = os.fspath(file)
    text = text_of_file(source)
    tables = with_overrides(tables_from_toml(text, source), overrides, source)
    try:
        targets = Targets.model_validate(tables)
    except ValidationError as error:
        worded, more = faults_of(error, {one.path: one for one in keys_of(Targets)})
        raise ConfigurationError(fault_texts(worded, source, more)) from None
    # Only observed coordinates: axial motion does not act back, and is computed only if observed.
    section = [*dict.fromkeys(("delta_5", *(one.coordinate for one in targets.increment)))]
    outputs = {"section": section, "section_points": 1, "lyapunov": bool(targets.exponent)}
    replaced = [*targets.set, f"outputs={toml_literal(outputs)}"]
    config, _ = with_method(load_config(Path(source).parent / targets.configuration, replaced))
    observations = observations_of(targets, states_of(config.needed_effects)[::2])
    if not observations:
        rule = "observes nothing; give at least one of stage, jump, crisis, exponent, increment"
        raise ConfigurationError(f"{source}: {rule}")
    values = np.unique(np.concatenate([one.values for one in observations]))
    if problems := list(_unfit(config, targets, source, values)):
        raise ConfigurationError(problems)
    return Problem(targets, config, text, observations, values)


def _unfit(config: Configuration, targets: Targets, source: str, values: Floats) -> Iterator[str]:
    kind = getattr(getattr(config, "pitch_error", None), "kind", "sine")
    for key, unfit in {
        "second_sweep": config.second_sweep is not None,
        "start.count": config.start.count > 1,
        'start.carry = "both"': config.start.carry == "both",
        f'pitch_error.kind = "{kind}"': kind != "sine",
    }.items():
        if unfit:
            rule = "observations have one axis, and a sine as pitch error; replace it in `set`"
            yield f"{source}: configuration: {config.source} has {key}; {rule}"
    if config.integration.recorded_periods < POINTS_NEEDED:
        yield (
            f"{source}: integration.recorded_periods = {config.integration.recorded_periods}: must "
            f"be at least {POINTS_NEEDED}, to find every period; raise it in `set`"
        )
    if config.second_sweep is not None:
        return
    # A second sweep over the bounds is subject to the same rules as a free parameter.
    for number, free in enumerate(targets.parameter):
        what = f"{source}: parameter[{number}]"
        if free.name == config.sweep.parameter:
            rule = f"is what {config.source} sweeps; name another parameter"
            yield f'{what}: name = "{free.name}": {rule}'
            continue
        bounds = {"parameter": free.name, "values": [free.low, free.high]}
        for text in _refusals(config, what, "second_sweep", bounds):
            own = text.replace("second_sweep.parameter", "name")
            yield own.replace("second_sweep.values", "low and high")
    places = {"parameter": config.sweep.parameter, "values": values.tolist()}
    yield from _refusals(config, f"{source}: observed places", "sweep", places)


def _refusals(config: Configuration, what: str, table: str, value: Any) -> Iterator[str]:
    """Word why a configuration rejects a value of a table."""
    try:
        config.replace(table, value)
    except ConfigurationError as error:
        yield from (
            f"{what}: {problem.removeprefix(f'{config.source}: ')}" for problem in error.problems
        )
