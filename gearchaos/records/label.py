"""The label of a motion: periodic, quasi-periodic, chaotic, or unresolved."""

from typing import Any, NamedTuple, Self

import numpy as np

from gearchaos.arrays import Codes, Counts, Floats, Integers, Mask
from gearchaos.records.bands import smooth_weights
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.records.period import POINTS_NEEDED, period_of, return_distances

PERIODIC, QUASI_PERIODIC, CHAOTIC, UNRESOLVED, DIVERGED, GROWS = range(6)
MOTION_MEANINGS = ("periodic", "quasi_periodic", "chaotic", "unresolved", "diverged", "grows")
"""Meanings of the values of ``motion``."""

MOST_LABEL_POINTS = 512
"""Section points used for a label, counted from the end."""
STANDARD_ERRORS = 3.0
"""An exponent within this number of standard errors counts as zero."""
CERTAIN = 6.0
"""Number of standard errors above which a positive exponent is certain."""

CHAOTIC_GROWTH = 2.0
"""Logarithm of growth over the record above which a disturbance grows."""

FEWEST_TO_GROW = 32
"""Fewest section points that show, by their first and last quarter, that a motion grows.

The largest of a few points of a bounded motion differs by chance as much as in growth.
"""

NEUTRAL_GROWTH = 1.0
"""Logarithm of growth or decay over the record up to which a disturbance is neutral."""

AGREEMENT = 0.05
"""Largest difference between the weighted averages of two halves of a quasi-periodic record."""

NEAR_RETURN = (
    0.01  # Return distance below which a motion that was chaotic may be settling on an orbit.
)
"""Return distance below which a chaotic motion may be settling on an orbit."""

SETTLING = 0.1
"""Return distance below which a motion with decreasing distance may settle on an orbit."""

LATEST = 16
"""Section points at the end of a chaotic record in which it may have settled."""


class Record(NamedTuple):
    """The record of some lanes after their transient.

    Attributes
    ----------
    section : array, shape (lanes, points, states)
        All states of the scene, once per excitation period.
    growth : array, shape (lanes, periods)
        Logarithm of the tangent vector's growth over each mesh period, or shape (lanes, 0).
    diverged : array of bool, shape (lanes,)
        Lanes that diverged.
    torus : array of bool, shape (lanes,)
        Whether quasi-periodic motion is possible.
    """

    section: Floats
    growth: Floats
    diverged: Mask
    torus: Mask


class Labels(NamedTuple):
    """Labels of some lanes.

    Attributes
    ----------
    motion : array of int, shape (lanes,)
        See `MOTION_MEANINGS`.
    period : array of int, shape (lanes,)
        Period in excitation periods, 0 where the motion is not periodic.
    return_distance : array, shape (lanes,)
        Return distance after the period, or the smallest return distance without a period.
    bands : array of int, shape (lanes,)
        Number of bands of a chaotic or quasi-periodic section, see `band_count`; 0 for other
        motions or where it was not determined.
    """

    motion: Codes
    period: Counts
    return_distance: Floats
    bands: Counts

    def of(self, lanes: Integers) -> Self:
        """Return the labels of some lanes."""
        some: Any = (label[lanes] for label in self)
        return type(self)(*some)


def label(record: Record) -> Labels:
    """Label the motion at the end of every lane; docs/numerics.md gives the rule and its reasons.

    The first rule that holds counts:

    - *diverged*;
    - *periodic* with the smallest period whose return distance is within the tolerance, see
      `motion_period`;
    - *chaotic* if the largest exponent is positive by three standard errors, a disturbance grows by
    a
      factor of exp(2) over the record, and grows at least as fast in the later half; but *grows* if
      the motion itself grows in this way;
    - *quasi-periodic* if the scene admits it, the exponent is zero within its error, and the
    weighted
      averages of both halves agree, see `halves_differ_by`;
    - *unresolved*.
    """
    distances = return_distances(record.section)
    period = period_of(distances)
    period[record.diverged] = 0
    motion = np.full(period.shape, UNRESOLVED, dtype=np.uint8)
    motion[period > 0] = PERIODIC
    motion[record.diverged] = DIVERGED
    rest = np.flatnonzero(motion == UNRESOLVED)
    if record.growth.size and rest.size:
        motion[rest] = _aperiodic(record.section[rest], record.growth[rest], record.torus[rest])
    own = distances[np.arange(period.size), np.maximum(period, 1) - 1]
    distance = np.where(period > 0, own, np.fmin.reduce(distances, axis=1))
    distance[record.diverged] = np.nan
    return Labels(motion, period, distance, np.zeros_like(period))


def settling_periods(record: Record, labels: Labels) -> Counts:
    """Return the period of the orbit on which a lane may be settling, 0 for none, (lanes,).

    A lane may settle if its return distance after some period is small and smaller than in the
    middle of the record, and if the exponent of the later half, where known, is negative. All
    periods are tried in unresolved lanes, and proper divisors of the period in periodic lanes:
    close to a period doubling a motion approaches its orbit from alternating sides, and returns
    after twice the period long before it returns after one. In a chaotic lane only the last 16
    points count. Newton's method then decides whether there is an orbit with this period or a
    divisor of it, and whether it is stable. In periodic lanes the returned period is smaller than
    the period of the label.
    """
    found = np.zeros(labels.motion.shape, dtype=np.int32)
    chaotic = np.flatnonzero(labels.motion == CHAOTIC)
    if chaotic.size:
        latest = return_distances(record.section[chaotic, -LATEST:])
        latest = np.where(np.isnan(latest), np.inf, latest)
        nearest = np.argmin(latest, axis=1)
        settling = latest[np.arange(chaotic.size), nearest] <= NEAR_RETURN
        found[chaotic[settling]] = nearest[settling] + 1
    lanes = np.flatnonzero((labels.motion == UNRESOLVED) | (labels.period > 1))
    if not lanes.size:
        return found
    section = record.section[lanes]
    half = section.shape[1] // 2
    whole, late, before = map(return_distances, (section, section[:, half:], section[:, :half]))
    periods = np.arange(1, before.shape[1] + 1)
    own = labels.period[lanes, np.newaxis]
    looked_at = (own == 0) | ((own > periods) & (own % periods == 0))
    falling = np.ones(lanes.size, dtype=np.bool_)
    if record.growth.size:
        later = record.growth[lanes, record.growth.shape[1] // 2 :]
        falling = largest_exponent(later, np.ones(lanes.size))[0] < 0.0
    # A short record may return no better than its beginning; half a record holds fewer periods.
    for now in (whole, late):
        now = np.where(looked_at & (now < before), now, np.inf)
        nearest = np.argmin(now, axis=1)
        settling = falling & (now.min(axis=1) <= SETTLING) & (found[lanes] == 0)
        found[lanes[settling]] = periods[nearest[settling]]
    return found


def doubtful(growth: Floats, labels: Labels) -> Mask:
    """Whether a longer record may lead to another label, (lanes,).

    Some lanes are unresolved because their record is too short: next to a resonance one turn of a
    torus may take more than a hundred periods, next to a bifurcation an orbit attracts by less than
    a factor e over the record, and weak chaos develops slowly. A period above 16 may be labelled as
    a torus. A torus, or chaos that is about to end, may be labelled as chaos while the exponent
    lies within six standard errors of zero.
    """
    found = np.zeros(labels.motion.shape, dtype=np.bool_)
    if growth.size:
        exponent, error = largest_exponent(growth, np.ones(found.size))
        weak = ~(exponent > CERTAIN * error)
        found = np.isin(labels.motion, (UNRESOLVED, QUASI_PERIODIC))
        found |= (labels.motion == CHAOTIC) & weak
    return found


def halves_differ_by(section: Floats) -> Floats:
    """Return the difference between the averages of the two halves of every section, (lanes,).

    The averages are those of every state, centred and scaled to variance 1, and of its square, with
    weights exp(-1/(t(1-t))) over each half. Their convergence is faster than any power of the
    number of points for quasi-periodic motion, and like its square root for chaos; they do not
    converge for a transient (Das, Sander, Yorke 2017). NaN with fewer than two points.
    """
    half = section.shape[1] // 2
    if half == 0:
        return np.full(section.shape[0], np.nan)
    size = np.max(np.abs(section), axis=1, keepdims=True)
    section = section / np.maximum(size, np.finfo(np.float64).tiny)
    centred = section - np.mean(section, axis=1, keepdims=True)
    deviation = np.std(section, axis=1, keepdims=True)
    # A constant state has no difference.
    scaled = centred / np.where(deviation > 0.0, deviation, 1.0)
    weights = smooth_weights(half)[:, np.newaxis]
    differences = [
        np.sum(weights * (values[:, :half] - values[:, -half:]), axis=1)
        for values in (scaled, scaled**2)
    ]
    largest: Floats = np.max(np.abs(differences), axis=(0, 2))
    return largest


def _aperiodic(section: Floats, growth: Floats, torus: Mask) -> Codes:
    """Label chaotic, quasi-periodic, growing and unresolved lanes, shape (lanes,)."""
    periods = growth.shape[1]
    one = np.ones(growth.shape[0])
    exponent, error = largest_exponent(growth, one)
    later, _ = largest_exponent(growth[:, periods // 2 :], one)
    pace = CHAOTIC_GROWTH / periods
    chaotic = (exponent > STANDARD_ERRORS * error) & (exponent > pace) & (later > pace)
    neutral = np.abs(exponent) <= np.minimum(STANDARD_ERRORS * error, NEUTRAL_GROWTH / periods)
    # Far beyond the clearances the system is linear: motion and disturbance grow alike.
    quarter = max(1, section.shape[1] // 4)
    first, last = section[:, :quarter], section[:, -quarter:]
    ratio = np.max(np.abs(last), axis=(1, 2)) / np.max(np.abs(first), axis=(1, 2))
    grows = chaotic & (np.log(ratio) > exponent * (section.shape[1] - quarter) / 2.0)
    grows &= section.shape[1] >= FEWEST_TO_GROW
    quasi_periodic = torus & neutral & (section.shape[1] >= 2 * POINTS_NEEDED)
    quasi_periodic[quasi_periodic] = halves_differ_by(section[quasi_periodic]) <= AGREEMENT
    motion = np.where(chaotic, CHAOTIC, np.where(quasi_periodic, QUASI_PERIODIC, UNRESOLVED))
    motion[grows] = GROWS
    return motion.astype(np.uint8)
