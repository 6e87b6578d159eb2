"""Requirements of the excitation: whole periods of transient and record, and remarks."""

import math
from collections.abc import Mapping

import numpy as np
from gearchaos_kernels.methods.substeps import FEWEST_RECORDED

from gearchaos.configuration.methods import METHODS
from gearchaos.configuration.run_tables import DEFAULT_STEPS
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.steps import PILOT_LANES
from gearchaos.errors import ConfigurationError
from gearchaos.records.period import LONGEST_PERIOD, RETURNS

LONGEST_EXCITATION = 50_000
"""Largest excitation period in mesh periods; a record contains several."""


def whole_lengths(lanes: Lanes) -> dict[str, int]:
    """Return transient and record in whole excitation periods, enough to find a period.

    The lengths are in mesh periods, by key. The record also has whole cycles of the mesh orders
    whose amplitudes are requested. Raises ConfigurationError if the excitation period or the common
    period of the orders is too long, or if an order has too few steps.
    """
    integration, repeats = lanes.config.integration, lanes.repeats_after
    if repeats > LONGEST_EXCITATION:
        raise ConfigurationError(
            f"{lanes.config.source}: the {lanes.model.excitation_words} after {repeats} mesh "
            f"periods only, more than {LONGEST_EXCITATION}; {lanes.model.shorter_excitation}"
        )
    orders = lanes.config.outputs.mesh_orders
    # A chosen number of steps is never smaller, and exact methods stop at more for a recorder.
    fewest = FEWEST_RECORDED if METHODS[integration.method].exact else 1
    most = max(integration.fixed_steps or DEFAULT_STEPS, fewest) / 2
    if unfit := [str(one) for one in orders if one >= most]:
        raise ConfigurationError(
            f"{lanes.config.source}: outputs.orders: {', '.join(unfit)}: must have more than two "
            f"steps in each cycle; keep to orders below {most:g}"
        )
    cycles = math.lcm(repeats, *(order.denominator for order in orders))
    if cycles > LONGEST_EXCITATION:
        raise ConfigurationError(
            f"{lanes.config.source}: outputs.orders: only a record of {cycles} mesh periods has "
            f"whole cycles of all orders, more than {LONGEST_EXCITATION}; give fewer orders, or "
            "fractions with a common denominator"
        )
    least = 1 if repeats == 1 else RETURNS
    record = max(integration.recorded_periods, least * repeats)
    return {
        "transient_periods": repeats * math.ceil(integration.transient_periods / repeats),
        "recorded_periods": cycles * math.ceil(record / cycles),
    }


def remarks(lanes: Lanes, lengths: Mapping[str, int]) -> list[str]:
    """Return remarks for the user before the sweep; ``lengths`` from `whole_lengths`."""
    system = lanes.system_of(lanes.spread(PILOT_LANES))
    parameters = {name: np.asarray(one.values) for name, one in lanes.parameters.items()}
    of_model = lanes.model.remarks(lanes.config, system, parameters)
    return [_longer(lanes, lengths), *of_model]


def _longer(lanes: Lanes, lengths: Mapping[str, int]) -> str:
    """Return a remark about transient and record that the excitation makes longer."""
    repeats = lanes.repeats_after
    changed = [
        f"integration.{name} raised from {asked} to {length}"
        for name, length in lengths.items()
        if length != (asked := getattr(lanes.config.integration, name))
    ]
    if repeats == 1:
        return f"{', '.join(changed)}: whole cycles of outputs.orders" if changed else ""
    longest = min(lengths["recorded_periods"] // (RETURNS * repeats), LONGEST_PERIOD)
    shorter = " and shorter ones" if longest > 1 else ""
    text = (
        f"the {lanes.model.excitation_words} after {repeats} mesh periods, the excitation period; "
        f"the record is long enough to find period {longest}{shorter}"
    )
    return f"{text}; {', '.join(changed)}, whole ones of it" if changed else text
