"""One band for torque and regressor: the decimator against plain convolution, harmonics, masks."""

import numpy as np
import pytest
from scipy import signal

from tauscope.recording.conditioning import AllPass
from tauscope.recording.conditioning.common_band import BRIDGED_FRACTION, MASKED_FRACTION, Decimator, HarmonicBand

BANDS = [(1000.0, 5.0), (1000.0, 37.0), (1000.0, 110.0), (1000.0, 180.0), (50.0, 5.0), (100.0, 44.0), (187.3, 4.1)]


@pytest.mark.parametrize(("rate", "cutoff"), BANDS)
def test_the_kernel_is_symmetric_of_unit_sum_and_fills_its_blocks(rate: float, cutoff: float) -> None:
    band = Decimator.design(rate, cutoff)
    np.testing.assert_allclose(band.kernel, band.kernel[::-1], rtol=0, atol=1e-16)
    assert band.kernel.sum() == pytest.approx(1.0, abs=1e-14)
    assert len(band.kernel) % band.factor == 0
    assert band.rate_hz == pytest.approx(rate / band.factor)
    assert band.rate_hz >= 3.0 * cutoff - 1e-6 or band.factor == 1


@pytest.mark.parametrize(("rate", "cutoff"), BANDS)
def test_the_band_ends_where_it_says(rate: float, cutoff: float) -> None:
    band = Decimator.design(rate, cutoff)
    frequency, response = signal.freqz(band.kernel, worN=8192, fs=rate)
    gain = np.abs(response)
    # Beyond a third of the rate the transition is mirrored at Nyquist.
    assert np.interp(cutoff, frequency, gain) == pytest.approx(0.5, abs=0.01 if 3 * cutoff < rate else 0.06)
    np.testing.assert_allclose(gain[frequency < 0.4 * cutoff], 1.0, atol=2e-3)
    stop = frequency > 1.55 * cutoff
    if stop.any():
        assert gain[stop].max() < 2e-3  # -54 dB: what folds back is below a five hundredth


@pytest.mark.parametrize(("rate", "cutoff"), BANDS)
@pytest.mark.parametrize("spare", [0, 1, 7])
def test_the_block_product_is_convolution_and_decimation(rate: float, cutoff: float, spare: int) -> None:
    band = Decimator.design(rate, cutoff)
    values = np.random.default_rng(0).normal(size=(2, 3, len(band.kernel) + 11 * band.factor + spare))
    expected = signal.convolve(values, band.kernel[None, None], mode="valid")[..., :: band.factor]
    np.testing.assert_allclose(band.reduce(values), expected, atol=1e-13)
    np.testing.assert_allclose(band.reduce(np.asfortranarray(values)), expected, atol=1e-13)


def test_many_rows_are_reduced_in_groups_to_the_same() -> None:
    band = Decimator.design(1000.0, 200.0)
    values = np.random.default_rng(0).normal(size=(7, 9, 6000))
    one_by_one = np.stack([[band.reduce(row) for row in group] for group in values])
    np.testing.assert_array_equal(band.reduce(values), one_by_one)


@pytest.mark.parametrize("count", [0, 1, 30])
def test_signals_shorter_than_the_kernel_give_no_output(count: int) -> None:
    band = Decimator.design(1000.0, 20.0)
    assert band.reduce(np.ones((4, count))).shape == (4, 0)
    assert band.reduce_mask(np.zeros((4, count), dtype=bool)).shape == (4, 0)
    assert band.reduce_mask(np.ones((4, count), dtype=bool)).shape == (4, 0)


@pytest.mark.parametrize("seconds", [0.05, 0.11, 0.31])
def test_torque_and_columns_stay_aligned(seconds: float) -> None:
    """A line through the origin stays one whatever the filter does to both sides: τ = Φ Θ row by row."""
    band = Decimator.design(500.0, 8.0)
    time = np.arange(3000) / 500.0
    columns = np.stack([np.sin(2 * np.pi * time / seconds), np.sign(np.sin(9 * time)), time, np.ones_like(time)])
    theta = np.array([0.3, -2.0, 5.0, 1.0])
    np.testing.assert_allclose(band.reduce(theta @ columns), theta @ band.reduce(columns), atol=1e-12)


def test_one_missed_sample_at_the_centre_counts_at_a_high_band_and_not_at_a_low_one() -> None:
    for cutoff, dropped in ((200.0, True), (2.0, False)):
        band = Decimator.design(1000.0, cutoff)
        measured = np.ones((1, len(band.kernel)), dtype=bool)
        measured[0, len(band.kernel) // 2] = False
        assert band.reduce_mask(measured).item() is not dropped


def test_scattered_losses_leave_rows_but_a_lasting_one_does_not() -> None:
    band = Decimator.design(1000.0, 5.0)
    rng = np.random.default_rng(0)
    scattered = rng.random((1, 20000)) > 0.05
    assert band.reduce_mask(scattered).mean() > 0.95
    assert not band.reduce_mask(rng.random((1, 20000)) > 0.4).any()
    lasting = np.ones((1, 20000), dtype=bool)
    lasting[0, 9000:9200] = False
    used = band.reduce_mask(lasting)[0]
    centre = np.arange(len(used)) * band.factor + len(band.kernel) // 2
    inside = (centre > 9000) & (centre < 9200)
    assert not used[inside].any()
    assert used[np.abs(centre - 9100) > len(band.kernel)].all()


@pytest.mark.parametrize("cutoff", [5.0, 60.0, 240.0])
def test_white_noise_behind_the_band_has_the_autocovariance_that_the_band_tells(cutoff: float) -> None:
    """The covariance of y = H e is H Hᵀ, H the whole filter as a matrix."""
    band = Decimator.design(1000.0, cutoff)
    matrix = band.reduce(np.eye(len(band.kernel) + 40 * band.factor)).T
    np.testing.assert_allclose(band.filtered_white(40), (matrix @ matrix.T)[0], atol=1e-15)


@pytest.mark.parametrize("cutoff", [3.0, 30.0, 200.0])
def test_no_row_rests_on_more_than_it_may(cutoff: float) -> None:
    band = Decimator.design(1000.0, cutoff)
    rng = np.random.default_rng(1)
    measured = np.ones(6000 + len(band.kernel), dtype=bool)
    for start in rng.integers(0, len(measured), 12):
        measured[start : start + rng.integers(1, 300)] = False
    used = band.reduce_mask(measured[None])[0]
    weight = np.abs(band.kernel) / np.abs(band.kernel).sum()
    lasting = ~measured
    for start, stop in np.flatnonzero(np.diff(lasting, prepend=False, append=False)).reshape(-1, 2):
        lasting[start:stop] = stop - start > band.factor // 4
    for row, is_used in enumerate(used):
        part = ~measured[row * band.factor : row * band.factor + len(weight)]
        if is_used:
            assert weight[part].sum() <= BRIDGED_FRACTION
            assert weight[lasting[row * band.factor :][: len(weight)]].sum() <= MASKED_FRACTION
        elif not part.any():
            pytest.fail("a row of measured samples was dropped")
        else:
            assert weight[part].sum() > MASKED_FRACTION / 2


def test_all_pass_changes_nothing() -> None:
    values, mask = np.ones((2, 5)), np.array([[True, False]])
    assert AllPass(10.0).reduce(values) is values
    assert AllPass(10.0).reduce_mask(mask) is mask


@pytest.mark.parametrize("samples", [500, 501])
def test_the_harmonic_band_keeps_its_harmonics_exactly(samples: int) -> None:
    rate, phase = 100.0, 2 * np.pi * np.arange(samples) / samples
    band = HarmonicBand.design(rate, samples, 10 * rate / samples)
    assert band.harmonics == 10
    kept = 1.0 + np.cos(phase) + 0.3 * np.sin(10 * phase)
    assert band.rate_hz == pytest.approx(21 * rate / samples)
    reduced = band.reduce(kept + np.cos(11 * phase) + np.sin(40 * phase))
    coarse = 2 * np.pi * np.arange(21) / 21
    np.testing.assert_allclose(reduced, 1.0 + np.cos(coarse) + 0.3 * np.sin(10 * coarse), atol=1e-12)


def test_white_noise_stays_white_in_the_harmonic_band() -> None:
    band = HarmonicBand.design(100.0, 1000, 2.0)
    reduced = band.reduce(np.random.default_rng(0).normal(size=(4000, 1000)))
    covariance = reduced.T @ reduced / 4000 / (41 / 1000)
    np.testing.assert_allclose(covariance, np.eye(41), atol=0.12)


def test_a_period_that_was_not_measured_whole_is_not_used() -> None:
    band = HarmonicBand.design(100.0, 1000, 2.0)
    measured = np.ones((2, 1000), dtype=bool)
    measured[1, 100:150] = False
    mask = band.reduce_mask(measured)
    assert mask.shape == (2, 41)
    assert mask[0].all()
    assert not mask[1].any()
