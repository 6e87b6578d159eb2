"""Signals along a step as polynomials: the forces of the elements, then the observed signals.

On a set of contact branches a signal is linear in state, inputs and offsets, like a gap. Its terms
are therefore a part of the maps. The force of an element is K(s) times its deflection, plus that of
its damper. Constant parts of observed signals have no column; see `steps.store_means`.
"""

import numpy as np

from gearchaos_kernels.compilation import compact, maker, scalar
from gearchaos_kernels.contact.kinds import kinds
from gearchaos_kernels.methods.flow_map.layout import TERMS, layout
from gearchaos_kernels.methods.flow_map.quadrature import PLACES, POINTS
from gearchaos_kernels.models.interfaces import (
    elements_at,
    mobility_forces,
    observed_at,
    point_of_waves,
)

_POWERS = np.vander(np.array(PLACES), TERMS, increasing=True)
"""Matrix from the terms of a signal to its values at the points of a step."""

APART, ENGAGED, SHARE = range(3)
"""Columns of the array ``forces`` of `differentiate_signals`."""


@scalar
def differentiate_signals(state, lane, acting, waves, of_lane, column, scene):
    """Write the observed signals of a unit vector, and what the forces of a lane consist of.

    ``of_lane``: the arrays ``observed`` (signals, states + 1 + waves + 1), whose last column is the
    constant part of a signal, and ``forces`` (elements, 3): the damping of an element apart and
    engaged, and its stiffness relative to the shared one.
    """
    observed, forces = of_lane
    signals = observed_at(state, lane, point_of_waves(waves, scene), scene)
    for number in range(len(signals)):
        # Unit vectors that do not belong to state, drive or waves leave the constant part.
        observed[number, min(column, observed.shape[1] - 1)] = signals[number]
    elements, shares = elements_at(lane, acting, scene), mobility_forces(lane, scene)
    for element in range(layout(scene).elements):
        damping = elements[element].damping
        forces[element, APART] = 0.0 if kinds(scene)[element].damped_in_contact else damping
        forces[element, ENGAGED] = damping
        forces[element, SHARE] = shares[element]


@maker
def observed_series(psi, observed, terms):
    """Return the series of the observed signals, shape (terms, signals, columns * width).

    ``psi``: the series of the motion, drive and waves; see `series.motion_series`.
    """
    compact()
    series = np.zeros((terms, observed.shape[0], psi.shape[2]))
    constant = observed.shape[1] - 1
    for signal in range(observed.shape[0]):
        for source in range(constant):
            factor = observed[signal, source] - observed[signal, constant]
            if factor != 0.0:
                for term in range(terms):
                    for column in range(psi.shape[2]):
                        series[term, signal, column] += factor * psi[term, source, column]
    return series


@maker
def add_dampers(springs, gaps, engaged, forces):
    """Turn K times the deflections into forces, in place.

    ``springs``: K times the deflections along a step, and ``gaps``: the gaps, both of shape
    (terms * elements, columns, width).
    """
    compact()
    elements = engaged.size
    for element in range(elements):
        stiffness = engaged[element] * forces[element, SHARE]
        damping = forces[element, ENGAGED if engaged[element] != 0.0 else APART]
        for term in range(TERMS):
            # Slopes are by s, and a step has length 2 in s.
            rate = 2.0 * (term + 1) * damping if term + 1 < TERMS else 0.0
            row = term * elements + element
            following = min(row + elements, TERMS * elements - 1)
            for column in range(gaps.shape[1]):
                for at in range(gaps.shape[2]):
                    force = stiffness * springs[row, column, at]
                    springs[row, column, at] = force + rate * gaps[following, column, at]


@maker
def write_signals(along, first, target, place):
    """Write terms and values of signals along some steps into a table, from number ``first`` on.

    ``along``: their terms, shape (terms * signals, columns, steps).
    """
    compact()
    table, begin = target
    signals = along.shape[0] // TERMS
    for at in range(along.shape[2]):
        piece = table[at, begin:]
        for signal in range(signals):
            for column in range(place.columns):
                number = (first + signal) * place.columns + column
                for term in range(TERMS):
                    part = along[term * signals + signal, column, at]
                    piece[place.signal + number * TERMS + term] = part
                for point in range(POINTS):
                    value = 0.0
                    for term in range(TERMS):
                        value += _POWERS[point, term] * along[term * signals + signal, column, at]
                    piece[place.values + number * POINTS + point] = value
