"""The single-sided amplitude spectrum of a motion, in multiples of the mesh frequency."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats

WINDOWS: dict[str, Callable[[int], Floats]] = {
    "rectangular": np.ones,
    # Periodic, unlike numpy.hanning: its transform is zero at all but three lines.
    "hann": lambda samples: 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(samples) / samples),
}
"""Windows by name, each as a function of the number of samples."""


class SpectralLines(NamedTuple):
    """Lines of a spectrum; a sine of amplitude A is a line of height A.

    ``order`` (lines,): frequency over the mesh frequency; ``amplitude`` (..., lines): in the unit
    of the motion.
    """

    order: Floats
    amplitude: Floats


def spectral_lines(
    values: Floats, samples_per_period: int, window: str = "rectangular"
) -> SpectralLines:
    """Return the amplitude spectrum of evenly spaced samples over whole mesh periods.

    The rectangular window is exact for every motion that repeats within the record: its lines fall
    on those of the transform and nothing leaks. The Hann window, divided by its coherent gain 1/2,
    keeps down what leaks from motions that do not repeat. A line at the order 0 has the height of
    the absolute mean; the mean is taken out before the window, so that it does not leak either.

    ``values`` (..., samples): the last sample is followed by the first one of the next record, a
    repeated end is left off; ``window``: a name in `WINDOWS`. The lines go from 0 to half of the
    sampling frequency, one over the number of periods apart. Raises ValueError if the samples are
    not those of whole mesh periods, or there is no such window.
    """
    samples = values.shape[-1]
    if samples == 0 or samples % samples_per_period:
        raise ValueError(
            f"{samples} samples are not whole mesh periods of {samples_per_period} samples"
        )
    if window not in WINDOWS:
        raise ValueError(f"no window {window!r}; there are {', '.join(WINDOWS)}")
    weights = WINDOWS[window](samples)
    mean = np.mean(values, axis=-1, keepdims=True)
    amplitude = np.abs(np.fft.rfft((values - mean) * weights)) / np.sum(weights)
    # A real sine shares its amplitude with its mirror image; the Nyquist line is its own.
    amplitude[..., 1 : (samples + 1) // 2] *= 2.0
    amplitude[..., 0] = np.abs(mean[..., 0])
    return SpectralLines(np.arange(amplitude.shape[-1]) * (samples_per_period / samples), amplitude)
