"""The variables of a sweep, for results that tests make by hand."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.records.contact import CONTACT_STATES
from gearchaos.results.variables import (
    EXPONENT_NUMBER,
    ORDER,
    RECORD,
    SECTION_POINT,
    STATE,
    STATUS,
    Variable,
    listed,
)


def parameter(
    name: str,
    values: ArrayLike,
    origin: str,
    units: str = "1",
    long_name: str = "",
    symbol: str = "",
    dims: tuple[str, ...] = (),
) -> Variable:
    """Give a parameter of the model."""
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

    The axes are second swept parameter, first swept parameter, realisation, start, direction, those
    there are; ``states`` those of the scene in its order, ``section`` those recorded at so many
    section points, ``contact`` and ``loads`` the ways of which they are told, ``chosen`` the
    states of which extremes are told, ``orders`` those of their amplitudes. Meanings are those
    of 0, 1, ...: of ``status``, of ``motion_changed`` where lanes are computed twice to measure
    their error, and of ``motion`` and ``record`` where they are labelled. A motion repeats after
    whole excitation periods, of so many mesh periods each.
    """
    periods = f"periods of the excitation, {excitation_period} mesh periods each,"
    # What stands for @ in the rows that are told with each of these.
    kept = section if section_points > 0 else ()
    subjects: dict[str, Sequence[str] | bool] = {
        "section points": bool(kept),
        "section": kept,
        "lyapunov": lyapunov,
        "motion": [periods if excitation_period > 1 else "mesh periods"] if motion_meanings else (),
        "record": bool(record_meanings),
        "exponents": exponents,
        "crossings": crossings,
        "contact": contact,
        "forces": loads,
        "loads": bool(loads),
        "chosen": chosen,
        "orders": bool(orders),
        "amplitudes": (*chosen, "transmission_error") if orders else (),
        "check": bool(check_meanings),
        "every sweep": True,
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
    return listed(axes, subjects, values, meanings)
