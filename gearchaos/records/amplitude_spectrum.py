"""The single-sided amplitude spectrum of a motion, in multiples of the mesh frequency."""

from typing import NamedTuple

import numpy as np

from gearchaos.arrays import Floats


class SpectralLines(NamedTuple):
    """Lines of an amplitude spectrum; a sine of amplitude A is a line of height A.

    Attributes
    ----------
    order : array, shape (lines,)
        Frequency divided by the mesh frequency.
    amplitude : array, shape (..., lines)
        Amplitude in the unit of the motion.
    """

    order: Floats
    amplitude: Floats


def spectral_lines(values: Floats, samples_per_period: int, hann: bool = False) -> SpectralLines:
    """Return the amplitude spectrum of evenly spaced samples over whole mesh periods.

    Parameters
    ----------
    values : array, shape (..., samples)
        Samples; the first sample of the next record would follow the last one.
    samples_per_period : int
        Samples per mesh period.
    hann : bool
        Whether to apply the Hann window, divided by its coherent gain of 1/2.

    Returns
    -------
    SpectralLines
        Lines from order 0 to half the sampling frequency, spaced by one over the number of periods.

    Notes
    -----
    The rectangular window is exact for every motion that repeats within the record. The Hann window
    reduces the leakage of motions that do not repeat. The mean is subtracted before the window, so
    that it does not leak; the line at order 0 has the height of its magnitude.
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
