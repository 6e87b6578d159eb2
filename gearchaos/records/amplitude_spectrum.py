"""The single-sided amplitude spectrum of a motion, in multiples of the mesh frequency."""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats


class SpectralLines(NamedTuple):
    """Lines of a spectrum; a sine of amplitude A is a line of height A.

    ``order`` (lines,): frequency over the mesh frequency; ``amplitude`` (..., lines): in the unit
    of the motion.
    """

    order: Floats
    amplitude: Floats


def spectral_lines(values: Floats, samples_per_period: int, hann: bool = False) -> SpectralLines:
    """Return the amplitude spectrum of evenly spaced samples over whole mesh periods.

    A rectangular window, the default, is exact for every motion that repeats within the record: its
    lines fall on those of the transform and nothing leaks. The Hann window, divided by its coherent
    gain 1/2, keeps down what leaks from motions that do not repeat. A line at the order 0 has the
    height of the absolute mean; the mean is taken out before the window, so that it does not leak
    either.

    ``values`` (..., samples): the last sample is followed by the first one of the next record, a
    repeated end is left off; ``hann``: take the window of Hann. The lines go from 0 to half of the
    sampling frequency, one over the number of periods apart.
    """
    samples = values.shape[-1]
    weights = np.ones(samples)
    if hann:
        # Periodic, unlike numpy.hanning: its transform is zero at all but three lines.
        weights = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(samples) / samples)
    mean = np.mean(values, axis=-1, keepdims=True)
    amplitude = np.abs(np.fft.rfft((values - mean) * weights)) / np.sum(weights)
    # A real sine shares its amplitude with its mirror image; the Nyquist line is its own.
    amplitude[..., 1 : (samples + 1) // 2] *= 2.0
    amplitude[..., 0] = np.abs(mean[..., 0])
    return SpectralLines(np.arange(amplitude.shape[-1]) * (samples_per_period / samples), amplitude)
