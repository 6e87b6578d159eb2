"""The mesh stiffness as a trapezoid and as a Fourier series, and conversions between both."""

import numpy as np
import pytest

from gearchaos.models.gear_pair.contact_lines import TrapezoidalStiffness, series_table

MEAN_STIFFNESS = 13.3548  # N/(um mm), Pan 2021, section 2.3
TABLE_2_COSINE = np.array([-1.202, -5.79e-5, -0.1339, -5.784e-5, -0.04809, -5.79e-5])
TABLE_2_SINE = np.array([1.203, -1.15e-4, -0.1335, 9.478e-8, 0.04819, -3.819e-5])
TABLE_2_FIRST_HARMONIC = np.hypot(TABLE_2_COSINE[0], TABLE_2_SINE[0])
TABLE_2 = (TABLE_2_COSINE - 1j * TABLE_2_SINE) / MEAN_STIFFNESS
PAN_2021 = TrapezoidalStiffness(0.25, 0.25, 0.25, 0.25, half_height=1 / 9)

SHAPES = [
    PAN_2021,
    TrapezoidalStiffness(0.1, 0.3, 0.1, 0.5, 0.2),
    TrapezoidalStiffness(0.1, 0.45, 0.25, 0.2, 0.3),
    TrapezoidalStiffness(0.5, 0.0, 0.5, 0.0, 0.05),
]


def contact_line_length(phases, transverse, overlap):
    """Return the length of the contact lines inside the field of contact, summed over the teeth."""
    teeth = np.arange(-20, 21)[:, None]
    front = phases + teeth
    inside = np.minimum(front, transverse) - np.maximum(front - overlap, 0.0)
    return np.maximum(inside, 0.0).sum(axis=0)


def test_table_2_of_pan_2021_follows_from_the_trapezoid():
    computed = PAN_2021.coefficients(6)
    for wave, printed in ((computed.real, TABLE_2_COSINE), (-computed.imag, TABLE_2_SINE)):
        difference = wave * MEAN_STIFFNESS - printed
        assert np.max(np.abs(difference)) < 1e-3 * TABLE_2_FIRST_HARMONIC


def test_rounded_contact_ratios_of_pan_2021_give_its_trapezoid():
    built = TrapezoidalStiffness.from_contact_ratios(1.5, 0.75)
    assert built == TrapezoidalStiffness(0.25, 0.25, 0.25, 0.25, half_height=0.25 / 2.25)


@pytest.mark.parametrize(
    ("transverse", "overlap"),
    [
        (1.5, 0.75),
        (1.505, 0.7539),
        (1.2, 0.3),
        (1.8, 1.6),
        (1.35, 2.9),
        (2.1, 0.05),
        (0.9, 0.6),
        (1.7, 0.3),
    ],
)
def test_contact_ratio_trapezoid_is_the_total_length_of_the_contact_lines(transverse, overlap):
    points = 1000
    phases = np.arange(points) / points
    length = contact_line_length(phases, transverse, overlap)
    shape = TrapezoidalStiffness.from_contact_ratios(transverse, overlap)
    expected = length / (transverse * overlap)
    assert expected.mean() == pytest.approx(1.0, abs=1e-6)
    # The trapezoid starts at its rise; the contact lines start where the front tooth enters.
    shift = best_shift(expected, shape.table(points))
    assert np.roll(shape.table(points), shift) == pytest.approx(expected, abs=2.5e-3)


def best_shift(reference, values):
    correlation = np.fft.ifft(np.fft.fft(reference) * np.conj(np.fft.fft(values))).real
    return int(np.argmax(correlation))


@pytest.mark.parametrize(("transverse", "overlap"), [(2.0, 0.7), (1.4, 1.0), (1.4, 3.0), (2.0, 0)])
def test_whole_contact_ratio_means_constant_stiffness(transverse, overlap):
    shape = TrapezoidalStiffness.from_contact_ratios(transverse, overlap)
    assert shape.half_height == 0.0
    assert np.array_equal(shape.table(50), np.ones(50))


def test_spur_pair_alternates_between_one_and_two_tooth_pairs():
    table = TrapezoidalStiffness.from_contact_ratios(1.625, 0.0).table(1000)
    assert table == pytest.approx(np.repeat([2 / 1.625, 1 / 1.625], [625, 375]))


@pytest.mark.parametrize("shape", SHAPES)
def test_fourier_series_of_a_trapezoid_converges_to_its_table(shape):
    points = 360
    assert series_table(shape.coefficients(2000), points) == pytest.approx(
        shape.table(points), abs=2e-4
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_fourier_coefficients_are_the_integrals_over_the_mesh_period(shape):
    points = 100_000
    angle = 2 * np.pi * (np.arange(points) + 0.5) / points
    values = np.interp(
        angle, 2 * np.pi * np.arange(points + 1) / points, closed_table(shape, points)
    )
    coefficients = shape.coefficients(5)
    for n in range(1, 6):
        cosine = 2 * np.mean(values * np.cos(n * angle))
        sine = 2 * np.mean(values * np.sin(n * angle))
        assert coefficients[n - 1].real == pytest.approx(cosine, abs=1e-8)
        assert -coefficients[n - 1].imag == pytest.approx(sine, abs=1e-8)


def closed_table(shape, points):
    table = shape.table(points)
    return np.append(table, table[0])


@pytest.mark.parametrize(
    "table", [*(shape.table(1000) for shape in SHAPES), series_table(TABLE_2, 1000)]
)
def test_mean_of_kappa_over_a_mesh_period_is_one(table):
    assert table.mean() == pytest.approx(1.0, abs=1e-12)


def test_table_evaluates_the_series_of_eq_19():
    points = 7
    phase = 2 * np.pi * np.arange(points) / points
    coefficients = np.array([0.1 + 0.3j, 0.02])
    expected = 1 + 0.1 * np.cos(phase) + 0.02 * np.cos(2 * phase) - 0.3 * np.sin(phase)
    assert series_table(coefficients, points) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("ratios", [(0.0, 0.5), (1.5, -0.1), (np.nan, 0.5), (1.5, np.inf)])
def test_impossible_contact_ratios_are_refused(ratios):
    with pytest.raises(ValueError, match="contact ratios"):
        TrapezoidalStiffness.from_contact_ratios(*ratios)
