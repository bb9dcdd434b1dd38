"""What a diagnosis is drawn from, against closed forms and against the residuals themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from diagnosis.test_diagnosis_of_simulated_arms import diagnosed
from tauscope.diagnosis.documents.plots import BINS, TIME, VARIABLES, DiagnosisPlots, diagnosis_plots
from tauscope.diagnosis.documents.residual_spectrum import noise_density
from tauscope.diagnosis.documents.torque_overlay import DIGITS, judging_observations, rounded
from tauscope.diagnosis.model.residual import predicted_rows
from tauscope.diagnosis.observations.whitening import JointNoise
from tauscope.identification.autocorrelation import Autoregression

RATE_HZ = 50.0


@pytest.fixture(scope="module")
def plots() -> DiagnosisPlots:
    return diagnosis_plots(diagnosed("spring"))


def noise_of(coefficients: list[float], innovation: float) -> JointNoise:
    return JointNoise(Autoregression(np.array(coefficients), innovation, innovation))


def test_white_noise_has_a_flat_density_whose_integral_is_its_variance() -> None:
    frequency = np.linspace(0.0, RATE_HZ / 2, 101)
    density = noise_density(noise_of([], 0.25), frequency, RATE_HZ)
    np.testing.assert_allclose(density, 2.0 * 0.25 / RATE_HZ)
    assert np.trapezoid(density, frequency) == pytest.approx(0.25)


def test_coloured_noise_has_the_density_that_its_samples_show() -> None:
    coefficients = [1.2, -0.5]
    rng = np.random.default_rng(4)
    samples = signal.lfilter([1.0], [1.0, *(-each for each in coefficients)], 0.3 * rng.standard_normal(400_000))
    frequency, measured = signal.welch(samples, RATE_HZ, nperseg=256, detrend=False)
    expected = noise_density(noise_of(coefficients, 0.09), frequency, RATE_HZ)
    inside = slice(2, -2)
    np.testing.assert_allclose(measured[inside], expected[inside], rtol=0.15)


@pytest.mark.slow
def test_what_is_left_without_the_finding_is_far_above_the_noise_at_low_frequency_and_with_it_is_not(
    plots: DiagnosisPlots,
) -> None:
    spectrum = plots.spectra[0]
    low = np.array(spectrum.frequency) < 0.5
    before, after, noise = (np.array(getattr(spectrum, name))[low] for name in ("before", "after", "noise"))
    assert spectrum.held_out
    assert np.median(before / noise) > 5.0
    assert np.median(after / noise) < 2.0


@pytest.mark.slow
def test_an_overlay_shows_the_stretch_in_which_the_findings_help_most(plots: DiagnosisPlots) -> None:
    found = diagnosed("spring")
    observations, held_out = judging_observations(found)
    assert held_out
    overlay = plots.overlays[0]
    measured, before, after = (np.array(getattr(overlay, name)) for name in ("measured", "before", "after"))
    shown = float(np.sum((measured - before) ** 2 - (measured - after) ** 2))
    length = len(overlay.time)
    best = 0.0
    for piece in observations:
        rows = [predicted_rows(m, piece)[0] for m in (found.selection.nominal.model, found.selection.fit.model)]
        torque = piece.torque[0].ravel()
        gain = (torque - rows[0]) ** 2 - (torque - rows[1]) ** 2
        for repetition in gain.reshape(piece.repetitions, -1):
            starts = range(len(repetition) - length + 1)
            best = max(best, *(float(repetition[at : at + length].sum()) for at in starts))
    assert shown == pytest.approx(best, rel=1e-2)
    assert np.all(np.diff(overlay.time) > 0.0)


@pytest.mark.slow
def test_every_joint_has_every_variable_and_bins_are_equally_full(plots: DiagnosisPlots) -> None:
    assert {(each.joint, each.variable) for each in plots.histograms} == {
        (f"joint{number}", variable) for number in (1, 2, 3) for variable in (*VARIABLES, TIME)
    }
    for each in plots.histograms:
        assert len(each.edges) == len(each.before) + 1 == len(each.after) + 1 == BINS + 1
    time = next(each for each in plots.histograms if each.variable == TIME)
    np.testing.assert_allclose(np.diff(time.edges), np.diff(time.edges).mean(), rtol=0.2)


@pytest.mark.slow
def test_states_go_with_the_residual_they_belong_to(plots: DiagnosisPlots) -> None:
    curve = plots.curves[0]
    assert set(curve.states) == set(VARIABLES)
    position, residual = np.array(curve.states["position"]), np.array(curve.before)
    # The concealed spring's torque is linear in the joint's angle, and the nominal model has only part of it.
    assert abs(np.corrcoef(position, residual)[0, 1]) > 0.3
    assert all(len(values) == len(curve.time) for values in curve.states.values())


@given(st.lists(st.floats(-1e300, 1e300, allow_nan=False), min_size=1, max_size=20))
def test_rounding_keeps_the_digits_that_are_seen(values: list[float]) -> None:
    exact = np.array(values)
    np.testing.assert_allclose(rounded(exact), exact, rtol=0.51 * 10.0 ** (1 - DIGITS), atol=1e-290)
