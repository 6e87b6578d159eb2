"""Variables of a sweep, for results that tests make by hand."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.models.gear_pair.outputs import (
    CATALOGUE,
    FORCES_PART,
    LOADS_PART,
    TRANSMISSION_ERROR,
)
from gearchaos.outputs import catalogue
from gearchaos.outputs.entries import Part
from gearchaos.outputs.listing import Details
from gearchaos.outputs.names import EXPONENT_NUMBER, ORDER, RECORD, SECTION_POINT, STATE, STATUS
from gearchaos.outputs.variable import Variable
from gearchaos.records.contact import CONTACT_STATES


def parameter(
    name: str,
    values: ArrayLike,
    origin: str,
    units: str = "1",
    long_name: str = "",
    symbol: str = "",
    dims: tuple[str, ...] = (),
) -> Variable:
    """Return a parameter of the model."""
    return Variable(
        name, dims, "float64", units, long_name or name, symbol, values=values, origin=origin
    )


def sweep_variables(
    axes: Sequence[Variable],
    *,
    states: Sequence[str],
    section: Sequence[str],
    section_points: int,
    lyapunov: bool,
    status_meanings: Sequence[str],
    crossings: bool = False,
    contact: Sequence[str] = (),
    loads: Sequence[str] = (),
    chosen: Sequence[str] = (),
    orders: Sequence[Fraction] = (),
    exponents: bool = False,
    check_meanings: Sequence[str] = (),
    motion_meanings: Sequence[str] = (),
    record_meanings: Sequence[str] = (),
    excitation_period: int = 1,
) -> list[Variable]:
    """List the variables of a sweep in the order of the file.

    The axes are those present of: second swept parameter, first swept parameter, realisation,
    start, direction. ``states``: all states of the scene in its order; ``section``: states recorded
    at the section points; ``contact`` and ``loads``: directions with contact and load outputs;
    ``chosen``: states with extremes; ``orders``: orders of their amplitudes. Meanings belong to the
    values 0, 1, ... of ``status``, of ``motion_changed`` (if lanes are computed twice to measure
    their error), and of ``motion`` and ``record`` (if lanes are labelled). Periods are counted in
    excitation periods, each of ``excitation_period`` mesh periods.
    """
    kept = section if section_points > 0 else ()
    parts: dict[Part, bool | Sequence[str]] = {
        catalogue.SECTION_POINTS_PART: bool(kept),
        catalogue.SECTION_PART: kept,
        catalogue.LYAPUNOV_PART: lyapunov,
        catalogue.MOTION_PART: bool(motion_meanings),
        catalogue.RECORD_PART: bool(record_meanings),
        catalogue.EXPONENTS_PART: exponents,
        catalogue.CROSSINGS_PART: crossings,
        catalogue.CONTACT_PART: contact,
        FORCES_PART: loads,
        LOADS_PART: bool(loads),
        catalogue.EXTREMES_PART: chosen,
        catalogue.ORDERS_PART: bool(orders),
        catalogue.AMPLITUDES_PART: (*chosen, TRANSMISSION_ERROR) if orders else (),
        catalogue.CHECK_PART: bool(check_meanings),
        catalogue.EVERY_SWEEP_PART: True,
    }
    values: dict[str, ArrayLike] = {
        SECTION_POINT: np.arange(section_points),
        EXPONENT_NUMBER: np.arange(1, len(states) + 1),
        ORDER: [float(order) for order in orders],
        STATE: np.arange(len(states)),
    }
    meanings = {
        "motion": motion_meanings,
        RECORD: record_meanings,
        "contact_state_@": CONTACT_STATES,
        "motion_changed": check_meanings,
        STATUS: status_meanings,
        STATE: states,
    }
    periods = f"periods of the excitation, {excitation_period} mesh periods each,"
    wordings = {"period": periods if excitation_period > 1 else "mesh periods"}
    return CATALOGUE.variables(axes, parts, Details(values, meanings, wordings))
