"""Contact lines over one mesh period: the stiffness that they make, and who carries how much.

The stiffness, as a trapezoid or as a Fourier series, is kappa = k / k_m, relative to its mean, at a
phase counted in mesh periods. It follows the total length of the contact lines (Pan 2021, eq. 18).
That of one tooth pair grows over the smaller of both contact ratios, stays, and shrinks again,
until the pair has been in mesh for their sum, in mesh periods.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from gearchaos.arrays import Complex, Floats
from gearchaos.errors import ConfigurationError
from gearchaos.models.gear_pair.geometry import Value

MOST_CONTACT = 5.0
"""Largest total contact ratio: the kernels have room for seven pairs in mesh or next to it."""

_ROUNDING = 1e-9
"""Harmonics and phases, relative, that are zero up to rounding."""

_SAMPLES = 64  # Places within a cell over which a share is averaged.


def series_table(coefficients: Complex, points: int) -> Floats:
    """Return kappa of a Fourier series at phases 0, 1/points, ..., shape (points,).

    ``coefficients`` (harmonics,): a_n - i c_n of eq. 19, so that kappa = 1 + Re(sum of coefficient
    n times exp(i n phi)), with phi the phase of the mesh in rad.
    """
    n = np.arange(1, coefficients.size + 1)
    # Whole numbers modulo points keep the phase exact for high harmonics.
    turns = np.outer(np.arange(points), n) % points / points
    variation: Floats = (np.exp(2j * np.pi * turns) @ coefficients).real
    return 1.0 + variation


@dataclass(frozen=True)
class TrapezoidalStiffness:
    """Stiffness that rises linearly from phase 0 on, stays, falls, stays (Pan 2021, eqs 15-18).

    The parts are fractions of the mesh period, none negative, which add up to one; a rise of zero
    is a jump. ``half_height``: half of the difference between top and bottom, relative to k_m. Each
    is a number or an array over lanes.
    """

    rise: Value
    top: Value
    fall: Value
    bottom: Value
    half_height: Value

    @classmethod
    def from_contact_ratios(cls, transverse: Value, overlap: Value) -> Self:
        """Stiffness proportional to the total length of a helical pair's contact lines.

        Measured along the path of contact in base pitches, a tooth's contact line spans a window
        of length eps_beta, and the part of it inside the field of contact, of length eps_alpha,
        is in contact. Summed over the teeth, which follow each other at distance one, whole
        windows and whole fields add constants only; what varies is the overlap of a window of
        length v = frac(eps_beta) with a field of length u = frac(eps_alpha), both repeated every
        period. That overlap changes at slope one during min(u, v, 1 - u, 1 - v), rests at its
        top for abs(u - v) and at its bottom for abs(1 - u - v); the mean of the full sum is
        eps_alpha eps_beta.

        ``transverse``, ``overlap``: eps_alpha > 0 and eps_beta >= 0; zero is a spur pair, whose
        contact length jumps. Raises ValueError if one is outside its range.
        """
        if not np.all((transverse > 0.0) & (overlap >= 0.0) & np.isfinite(transverse + overlap)):
            raise ValueError(
                "contact ratios must be finite, transverse > 0 and overlap >= 0, "
                f"not {transverse} and {overlap}"
            )
        u, v = np.asarray(transverse) % 1.0, np.asarray(overlap) % 1.0
        slope_time = np.minimum.reduce(np.broadcast_arrays(u, v, 1.0 - u, 1.0 - v))
        # Limit of the line below for a spur pair: the contact jumps by the whole width, unless u is
        # zero.
        jump = np.where(u > 0.0, 1.0 / (2.0 * transverse), 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            height = slope_time / (2.0 * np.asarray(transverse) * overlap)
        half_height = np.where(np.asarray(overlap) > 0.0, height, jump)
        return cls(slope_time, abs(u - v), slope_time, abs(1.0 - u - v), half_height)

    def table(self, points: int) -> Floats:
        """Return kappa at phases 0, 1/points, ..., shape (points,); after the jump at a jump."""
        ends_of_parts = np.cumsum([0.0, self.rise, self.top, self.fall])
        phases = np.arange(points) / points
        shape = np.interp(phases, [*ends_of_parts, 1.0], [-1.0, 1.0, 1.0, -1.0, -1.0])
        mean_of_shape = self.top - self.bottom
        return 1.0 + self.half_height * (shape - mean_of_shape)

    def coefficients(self, harmonics: int) -> Complex:
        """Return exact Fourier coefficients (..., harmonics), as `series_table` takes them.

        The derivative of the shape is one box over the rise and one over the fall, whose
        coefficients are sinc functions; dividing them by 2 pi i n integrates.
        """
        n = np.arange(1, harmonics + 1)
        rise, top, fall, half_height = (
            np.asarray(part)[..., np.newaxis]
            for part in (self.rise, self.top, self.fall, self.half_height)
        )
        up = np.exp(-1j * np.pi * n * rise) * np.sinc(n * rise)
        down = np.exp(-2j * np.pi * n * (rise + top + fall / 2.0)) * np.sinc(n * fall)
        found: Complex = 2.0 * half_height * (up - down) / (1j * np.pi * n)
        return found


def line_shares(
    transverse: float, overlap: float, smoothing: float, fundamental: complex = 0.0
) -> tuple[Floats, int, float]:
    """Return the share of a tooth pair in the mesh force while it is in mesh.

    Its mean shares (cells,) from its entry on, the cells of a mesh period, and the mesh phase, in
    periods, at which it enters. ``transverse``, ``overlap``: the contact ratios eps_alpha > 0 and
    eps_beta >= 0; ``smoothing``: mesh periods over which a pair takes load at least, as shares jump
    otherwise in a spur pair; ``fundamental``: cosine - i sine of the first harmonic of the mesh
    stiffness, whose phase the total length of the contact lines has; without one the first pair
    comes into mesh at phase 0. Raises ConfigurationError if there are moments without any pair in
    mesh, or too many are.
    """
    if not 1.0 <= transverse + overlap <= MOST_CONTACT:
        raise ConfigurationError(
            f"[pair]: its total contact ratio {transverse + overlap:.3g} must be between 1 and "
            f"{MOST_CONTACT:g} for pitch errors tooth by tooth; check the data of the gears"
        )
    # A spline reaches over six cells.
    per_period = max(1, round(6.0 / smoothing))
    cells = int(np.ceil((transverse + overlap) * per_period))
    samples = (np.arange(_SAMPLES * per_period) + 0.5) / (_SAMPLES * per_period)
    turns = np.arange(cells // per_period + 1)[:, np.newaxis]
    lines = _contact_line(samples + turns, transverse, overlap)
    shares = (lines / lines.sum(axis=0)).reshape(-1, _SAMPLES).mean(axis=1)[:cells]
    # The phase of the total length, were it to begin at phase 0.
    own = complex(np.mean(lines.sum(axis=0) * np.exp(-2j * np.pi * samples)))
    turned = fundamental * own.conjugate()
    entry = -np.angle(turned) / (2.0 * np.pi) % 1.0 if abs(turned) > _ROUNDING else 0.0
    # A place that rounding puts just before the end of a period is its beginning.
    return shares, per_period, 0.0 if 1.0 - entry < _ROUNDING else float(entry)


def _contact_line(place: Floats, transverse: float, overlap: float) -> Floats:
    """Relative length of the contact line of a pair, by mesh periods after its entry."""
    if overlap == 0.0:
        return np.where(place < transverse, 1.0, 0.0)
    left = transverse + overlap - place
    return np.clip(np.minimum(place, left), 0.0, min(transverse, overlap))
