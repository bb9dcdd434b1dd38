"""Noise of the positions, taken out of accelerations as far as the torque shows it."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.test_repetitions import observed
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.likely_accelerations import TRANSITION, acceleration_noise, with_likely_accelerations
from tauscope.diagnosis.model.residual import raw_squares
from tauscope.diagnosis.noise.floor import with_noise
from tauscope.diagnosis.observations.observations import BoolArray, Observations
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.dynamics import mass_matrix
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.recording.recording import Array

pytestmark = pytest.mark.slow

RATE_HZ, CUTOFF_HZ, SAMPLES = 200.0, 12.0, 8192
DENSITY = np.array([2e-11, 5e-11])
TORQUE_NOISE = np.array([0.04, 0.01])


def spectrum(density: Array) -> Array:
    """Variance of a sample of n at every frequency, as the docstring of the module has it, (n, F)."""
    frequency = np.fft.rfftfreq(SAMPLES, 1.0 / RATE_HZ)
    fading = np.clip((TRANSITION[1] - frequency / CUTOFF_HZ) / (TRANSITION[1] - TRANSITION[0]), 0.0, 1.0)
    return 0.5 * RATE_HZ * density[:, None] * (2.0 * np.pi * frequency) ** 4 * fading


def drawn(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Noise of accelerations, an inertia that changes along the motion, and the residual that the two make."""
    coloured = np.sqrt(spectrum(DENSITY)) * np.fft.rfft(rng.standard_normal((2, SAMPLES)))
    noise = np.fft.irfft(coloured, SAMPLES)
    phase = 2.0 * np.pi * np.arange(SAMPLES) / RATE_HZ / 5.0
    inertia = np.empty((SAMPLES, 2, 2))
    inertia[:, 0, 0], inertia[:, 1, 1] = 2.0 + 0.8 * np.cos(phase), 0.7
    inertia[:, 0, 1] = inertia[:, 1, 0] = 0.7 + 0.3 * np.cos(phase)
    torque = np.sqrt(TORQUE_NOISE)[:, None] * rng.standard_normal((2, SAMPLES))
    return noise, inertia, torque - np.einsum("tij,jt->it", inertia, noise)


def likely(residual: Array, inertia: Array, known: BoolArray | None = None, density: Array = DENSITY) -> Array:
    known = np.ones(residual.shape, dtype=bool) if known is None else known
    return acceleration_noise(residual, known, inertia, density, TORQUE_NOISE, RATE_HZ, CUTOFF_HZ)


def test_with_a_constant_inertia_it_is_wiener_s_filter() -> None:
    noise, _, _ = drawn(np.random.default_rng(0))
    mass, rng = 1.7, np.random.default_rng(1)
    residual = np.sqrt(TORQUE_NOISE)[:, None] * rng.standard_normal(noise.shape) - mass * noise
    found = likely(residual, np.broadcast_to(mass * np.eye(2), (SAMPLES, 2, 2)))
    power = spectrum(DENSITY)
    gain = -mass * power / (mass**2 * power + TORQUE_NOISE[:, None])
    expected = np.fft.irfft(gain * np.fft.rfft(residual), SAMPLES)
    inner = slice(1000, -1000)  # at the ends the one goes around and the other does not
    assert np.abs(found - expected)[:, inner].max() < 0.02 * expected.std()


def test_what_is_left_has_nothing_in_common_with_the_residual() -> None:
    rng, before, after = np.random.default_rng(2), [], []
    for _ in range(40):
        noise, inertia, residual = drawn(rng)
        found = likely(residual, inertia)
        before.append(np.sum(noise * residual, axis=1))
        after.append(np.sum((noise - found) * residual, axis=1))
    z = [np.mean(each, axis=0) / np.std(each, axis=0, ddof=1) * np.sqrt(len(each)) for each in (before, after)]
    assert (np.abs(z[0]) > 50.0).all(), "noise of this size biases every column it is in"
    assert (np.abs(z[1]) < 3.5).all()


def test_it_is_closer_to_the_truth_than_what_was_measured() -> None:
    noise, inertia, residual = drawn(np.random.default_rng(3))
    left = noise - likely(residual, inertia)
    assert (left.std(axis=1) < 0.6 * noise.std(axis=1)).all()


def test_torque_that_was_not_measured_says_nothing() -> None:
    _, inertia, residual = drawn(np.random.default_rng(4))
    known = np.ones(residual.shape, dtype=bool)
    known[0, 1000:1400] = False
    other = np.where(known, residual, 1e3)
    assert likely(other, inertia, known) == pytest.approx(likely(residual, inertia, known), abs=1e-12)


def test_a_joint_without_noise_keeps_its_acceleration() -> None:
    _, inertia, residual = drawn(np.random.default_rng(5))
    found = likely(residual, inertia, density=DENSITY * [1.0, 0.0])
    assert found[0].std() > 0.0
    assert (found[1] == 0.0).all()


WIDE_HZ, NOISE = 24.0, 1e-4
"""A band too wide for positions that are off by so much [rad]."""


def rotor_score(observations: Observations, model: ExtendedModel) -> float:
    """Inertia of a rotor at the last joint, which the arm has not, in its own standard errors."""
    known, _ = with_noise(observations, model, ())
    fit = Fitter(known).fit(model)
    signals = model_signals(fit.model, known)
    found = Screen(known, ()).at_shapes(RotorInertia(2), np.zeros((1, 0)), fit, signals)
    return float(found.target[0, 0] / np.sqrt(found.gram[0, 0, 0]))


def test_a_rotor_no_longer_explains_the_positions_noise() -> None:
    observations, model = observed(band_hz=WIDE_HZ, noise=NOISE)
    assert rotor_score(observations, model) < -4.0
    assert abs(rotor_score(with_likely_accelerations(observations, model, WIDE_HZ), model)) < 2.0


def test_links_and_columns_are_made_of_the_corrected_accelerations() -> None:
    observations, model = observed(band_hz=WIDE_HZ, noise=NOISE)
    (measured,), (piece,) = observations, with_likely_accelerations(observations, model, WIDE_HZ)
    robot, motion, before = observations.robot, piece.prepared.motion, measured.prepared.motion
    bodies = model.standard_parameters()
    expected = np.einsum(
        "tij,tj->it", mass_matrix(robot, bodies, motion.position), motion.acceleration - before.acceleration
    )
    torque = [each.prepared.predict_torque(model.structure, model.parameters[None])[0] for each in (piece, measured)]
    assert torque[0] - torque[1] == pytest.approx(expected, abs=1e-9 * np.abs(torque).max())
    assert (motion.velocity == before.velocity).all()


def test_residuals_are_stated_by_motion_as_it_was_measured() -> None:
    observations, model = observed(band_hz=WIDE_HZ, noise=NOISE)
    corrected = with_likely_accelerations(observations, model, WIDE_HZ)
    flattered, _ = raw_squares(model, corrected)
    honest, _ = raw_squares(model, replace(corrected, as_measured=observations))
    assert honest == pytest.approx(raw_squares(model, observations)[0], rel=1e-12)
    assert (flattered.sum(axis=1) < honest.sum(axis=1)).all()
