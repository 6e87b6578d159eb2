"""Requirements of the excitation: whole periods of transient and record, and remarks."""

import math
from collections.abc import Mapping

import numpy as np

from gearchaos.configuration.run_tables import DEFAULT_STEPS
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.steps import PILOT_LANES
from gearchaos.errors import ConfigurationError
from gearchaos.records.period import LONGEST_PERIOD, RETURNS

LONGEST_EXCITATION = 50_000
"""Largest excitation period in mesh periods; a record contains several."""


def whole_lengths(lanes: Lanes) -> dict[str, int]:
    """Return transient and record in whole excitation periods, enough to find a period.

    The lengths are in mesh periods, by key. Raises ConfigurationError if the excitation period is
    too long, or if the record does not have whole cycles of an order whose amplitude is requested.
    """
    integration, repeats = lanes.config.integration, lanes.repeats_after
    if repeats > LONGEST_EXCITATION:
        raise ConfigurationError(
            f"{lanes.config.source}: the {lanes.model.excitation_words} after {repeats} mesh "
            f"periods only, more than {LONGEST_EXCITATION}; {lanes.model.shorter_excitation}"
        )
    least = {"transient_periods": 0, "recorded_periods": 1 if repeats == 1 else RETURNS}
    lengths = {
        name: repeats * max(math.ceil(getattr(integration, name) / repeats), count)
        for name, count in least.items()
    }
    orders, record = lanes.config.outputs.mesh_orders, lengths["recorded_periods"]
    # A chosen number of steps is never smaller.
    most = (integration.fixed_steps or DEFAULT_STEPS) / 2
    if unfit := [str(one) for one in orders if record % one.denominator or one >= most]:
        whole = math.lcm(repeats, *(order.denominator for order in orders))
        raise ConfigurationError(
            f"{lanes.config.source}: outputs.orders: {', '.join(unfit)}: must have whole cycles in "
            f"the record of {record} mesh periods and more than two steps in each; set "
            f"integration.recorded_periods to a multiple of {whole}, such as "
            f"{whole * math.ceil(record / whole)}, and keep to orders below {most:g}"
        )
    return lengths


def remarks(lanes: Lanes, lengths: Mapping[str, int]) -> list[str]:
    """Return remarks for the user before the sweep; ``lengths`` from `whole_lengths`."""
    system = lanes.system_of(lanes.spread(PILOT_LANES))
    parameters = {name: np.asarray(one.values) for name, one in lanes.parameters.items()}
    of_model = lanes.model.remarks(lanes.config, system, parameters)
    return [_longer(lanes, lengths), *of_model]


def _longer(lanes: Lanes, lengths: Mapping[str, int]) -> str:
    """Return a remark about transient and record that the excitation makes longer."""
    repeats = lanes.repeats_after
    if repeats == 1:
        return ""
    changed = [
        f"integration.{name} raised from {asked} to {length}"
        for name, length in lengths.items()
        if length != (asked := getattr(lanes.config.integration, name))
    ]
    longest = min(lengths["recorded_periods"] // (RETURNS * repeats), LONGEST_PERIOD)
    shorter = " and shorter ones" if longest > 1 else ""
    text = (
        f"the {lanes.model.excitation_words} after {repeats} mesh periods, the excitation period; "
        f"the record is long enough to find period {longest}{shorter}"
    )
    return f"{text}; {', '.join(changed)}, whole ones of it" if changed else text
