"""What kind of motion a lane has come to: periodic, quasi-periodic, chaotic, or not to be told."""

from typing import Any, NamedTuple, Self

import numpy as np

from gearchaos.arrays import Codes, Counts, Floats, Integers, Mask
from gearchaos.records.bands import smooth_weights
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.records.period import POINTS_NEEDED, period_of, return_distances

PERIODIC, QUASI_PERIODIC, CHAOTIC, UNRESOLVED, DIVERGED, GROWS = range(6)
MOTION_MEANINGS = ("periodic", "quasi_periodic", "chaotic", "unresolved", "diverged", "grows")
"""Meanings of the values of ``motion``."""

MOST_LABEL_POINTS = 512  # Section points with which a motion is labelled: the last ones.
STANDARD_ERRORS = 3.0  # An exponent within so many of its standard errors is not told from zero.
CERTAIN = 6.0  # Standard errors beyond which a positive exponent is not doubted.

CHAOTIC_GROWTH = 2.0
"""Logarithm of the growth over the record beyond which a disturbance counts as growing."""

NEUTRAL_GROWTH = 1.0
"""Logarithm of growth or decay over the record up to which a disturbance counts as neutral."""

AGREEMENT = 0.05
"""Largest difference of the weighted averages of two halves of a quasi-periodic record."""

NEAR_RETURN = (
    0.01  # Return distance below which a motion that was chaotic may be settling on an orbit.
)

SETTLING = 0.1
"""Return distance below which a motion that comes ever closer may be settling on an orbit."""

LATEST = 16  # Section points at the end of a chaotic record that may have settled.


class Record(NamedTuple):
    """What is known of some lanes after their transient.

    ``section`` (lanes, points, states): all states of the scene, once an excitation period;
    ``growth`` (lanes, mesh periods): logarithm of the tangent vector's growth, or (lanes, 0);
    ``diverged`` (lanes,); ``torus`` (lanes,): whether the scene admits quasi-periodic motion.
    """

    section: Floats
    growth: Floats
    diverged: Mask
    torus: Mask


class Labels(NamedTuple):
    """Labels of some lanes.

    ``motion`` (lanes,) of `MOTION_MEANINGS`; ``period`` (lanes,) in excitation periods, 0 where the motion
    is not periodic; ``return_distance`` (lanes,): that of the period, or else the smallest one;
    ``bands`` (lanes,): on how many a chaotic or quasi-periodic section lies, see `band_count`, 0
    where it is neither or has not been looked at.
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

    In this order: *diverged*; *periodic* with the smallest period whose return distance is within
    the tolerance, see `motion_period`; *chaotic* where the largest exponent is positive by three
    standard errors, a disturbance grows by a factor exp(2) over the record, and its later half
    goes on at this pace, but *grows* where the motion itself does so; *quasi-periodic* where the
    scene admits it, the exponent is zero within its error, and the weighted averages of both halves
    agree, see `halves_differ_by`;
    *unresolved* otherwise.
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
    """Return the period of the orbit on which a lane may still be settling, 0 for none.

    A lane settles where its return distance after some period is small and smaller than in the
    middle of the record, and the exponent of the later half, if known, is negative. Looked at are
    the periods of unresolved lanes, and in periodic ones those that divide the period: close to a
    period doubling a motion approaches its orbit from alternating sides, and returns after twice
    the period long before it does after one. A chaotic lane may settle at the very end of its
    record: there the return of the last 16 points counts alone. Whether there is such an orbit, of
    the period or a divisor of it, and whether it is stable is for Newton's method to tell. In
    periodic lanes the period returned is smaller than that of the label.
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
    # All of a short record may return no better than its begin, and half of it tells fewer periods.
    for now in (whole, late):
        now = np.where(looked_at & (now < before), now, np.inf)
        nearest = np.argmin(now, axis=1)
        settling = falling & (now.min(axis=1) <= SETTLING) & (found[lanes] == 0)
        found[lanes[settling]] = periods[nearest[settling]]
    return found


def doubtful(growth: Floats, labels: Labels) -> Mask:
    """Whether a longer record may tell another motion than this one did.

    Next to a resonance one turn of a torus may take more than a hundred periods, next to a
    bifurcation an orbit attracts by less than a factor e over the record, and weak chaos takes long
    to show: such lanes are unresolved. A period beyond 16 may pass for a torus, a torus or chaos
    that is about to end for chaos as long as the exponent is within six standard errors of zero.
    """
    found = np.zeros(labels.motion.shape, dtype=np.bool_)
    if growth.size:
        exponent, error = largest_exponent(growth, np.ones(found.size))
        weak = ~(exponent > CERTAIN * error)
        found = np.isin(labels.motion, (UNRESOLVED, QUASI_PERIODIC))
        found |= (labels.motion == CHAOTIC) & weak
    return found


def halves_differ_by(section: Floats) -> Floats:
    """Return how far the averages of the two halves of every section lie apart.

    Averaged are every coordinate, centred and scaled to variance 1, and its square, with the
    weight exp(-1/(t(1-t))) over each half. On a quasi-periodic motion these averages converge
    faster than any power of the number of points, on a chaotic one like its square root, and on a
    transient not at all (Das, Sander, Yorke 2017). NaN with fewer than two points.
    """
    half = section.shape[1] // 2
    if half == 0:
        return np.full(section.shape[0], np.nan)
    size = np.max(np.abs(section), axis=1, keepdims=True)
    section = section / np.maximum(size, np.finfo(np.float64).tiny)
    centred = section - np.mean(section, axis=1, keepdims=True)
    deviation = np.std(section, axis=1, keepdims=True)
    # A coordinate at rest has nothing that could differ.
    scaled = centred / np.where(deviation > 0.0, deviation, 1.0)
    weights = smooth_weights(half)[:, np.newaxis]
    differences = [
        np.sum(weights * (values[:, :half] - values[:, -half:]), axis=1)
        for values in (scaled, scaled**2)
    ]
    largest: Floats = np.max(np.abs(differences), axis=(0, 2))
    return largest


def _aperiodic(section: Floats, growth: Floats, torus: Mask) -> Codes:
    """Tell chaotic, quasi-periodic and unresolved lanes that do not return."""
    periods = growth.shape[1]
    one = np.ones(growth.shape[0])
    exponent, error = largest_exponent(growth, one)
    later, _ = largest_exponent(growth[:, periods // 2 :], one)
    pace = CHAOTIC_GROWTH / periods
    chaotic = (exponent > STANDARD_ERRORS * error) & (exponent > pace) & (later > pace)
    neutral = np.abs(exponent) <= np.minimum(STANDARD_ERRORS * error, NEUTRAL_GROWTH / periods)
    # Far beyond the clearances all is linear: the motion grows as a disturbance does.
    quarter = max(1, section.shape[1] // 4)
    first, last = section[:, :quarter], section[:, -quarter:]
    ratio = np.max(np.abs(last), axis=(1, 2)) / np.max(np.abs(first), axis=(1, 2))
    grows = chaotic & (np.log(ratio) > exponent * (section.shape[1] - quarter) / 2.0)
    quasi_periodic = torus & neutral & (section.shape[1] >= 2 * POINTS_NEEDED)
    quasi_periodic[quasi_periodic] = halves_differ_by(section[quasi_periodic]) <= AGREEMENT
    motion = np.where(chaotic, CHAOTIC, np.where(quasi_periodic, QUASI_PERIODIC, UNRESOLVED))
    motion[grows] = GROWS
    return motion.astype(np.uint8)
