"""Stretches of the swept parameter over which the kind of contact stays the same."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.outputs.names import CONTACT_STATE
from gearchaos.results.reading.result import Result


class ContactStretch(NamedTuple):
    """A stretch of the swept parameter with one kind of contact.

    Attributes
    ----------
    element : str
        Name of the clearance, such as "tangential".
    start, end : float
        Swept values of its outermost lanes.
    contact : str
        Kind of contact, such as "held" or "single sided impact".
    lanes : int
        Number of lanes.
    """

    element: str
    start: float
    end: float
    contact: str
    lanes: int


def contact_stretches(result: Result) -> list[ContactStretch]:
    """Return the stretches of every clearance, in order; none if contact was not recorded.

    Parameters
    ----------
    result : Result
        A result over one swept parameter, in one direction and with one start.

    Returns
    -------
    list of ContactStretch
        The clearances one after the other.

    Examples
    --------
    >>> from gearchaos.results.reading.contact_stretches import contact_stretches
    >>> contact_stretches(gearchaos.open_result("pan2021.h5"))
    []
    """
    found = []
    values = result[result.axis]
    order = np.argsort(values, kind="stable")
    for name in result:
        if not name.startswith(CONTACT_STATE) or result.variables[name].dims != result.axes:
            continue
        kinds, states = result.variables[name].flags, result[name][order]
        ends = [0, *(np.flatnonzero(np.diff(states)) + 1).tolist(), states.size]
        for first, after in pairwise(ends):
            low, high = (float(values[order[at]]) for at in (first, after - 1))
            kind = kinds[int(states[first])].replace("_", " ")
            element = name.removeprefix(CONTACT_STATE).replace("_", " ")
            found.append(ContactStretch(element, low, high, kind, after - first))
    return found
