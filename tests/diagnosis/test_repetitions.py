"""Noise from what a residual differs by between repetitions, each with the motion that it was."""

import numpy as np
import pytest

from diagnosis.diagnosed_arm import POSITION_NOISE, motions
from identification.simulated import PAPER_NOISE, Array
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import nominal_model
from tauscope.diagnosis.noise.floor import repeated_differences, with_pure_error
from tauscope.diagnosis.observations.observations import Observations
from tauscope.identification import identify
from tauscope.recording.conditioning import Conditioner

BAND_HZ = 8.0


def observed(
    wave: float | Array = 0.0, band_hz: float = BAND_HZ, noise: float = POSITION_NOISE
) -> tuple[Observations, ExtendedModel]:
    """Two periods of a motion with a wave [Nm] in every torque, or (3,), that no model has, and that repeats."""
    rng = np.random.default_rng(0)
    ((arm, _),) = motions((1,))
    extra = wave * np.sin(2.0 * np.pi * 1.7 * arm.exact.time[:, None])
    position_noise = noise * rng.standard_normal(arm.exact.position.shape)
    recording = arm.recording(arm.white(PAPER_NOISE, rng), position_noise, extra_torque=extra)
    identification = identify(arm.robot, [recording])
    model = nominal_model(identification)
    conditioners = [Conditioner.survey(recording, arm.robot)]
    base = identification.structure.base
    return Observations.prepare(conditioners, arm.robot, base, band_hz, model.steepness), model


def test_no_repetition_is_averaged() -> None:
    observations, _ = observed()
    assert all(piece.repetitions == 1 for piece in observations)
    ((run,),) = observations.repetitions
    assert run.count == 2
    assert run.length_s == pytest.approx(10.0, abs=0.01)


def power(observations: Observations, model: ExtendedModel) -> Array:
    """Noise variance of every joint's rows by the differences between periods, (n,)."""
    found = []
    for rows, used, factor in repeated_differences(observations, model):
        assert used.all()
        found.append(factor * np.mean(rows**2, axis=1))
    return np.mean(found, axis=0)


def test_differences_have_the_noise_s_power() -> None:
    observations, model = observed()
    band = observations.pieces[0].prepared.motion.band
    white = np.var(band.reduce(np.random.default_rng(9).standard_normal((1, 100_000))))
    assert np.sqrt(power(observations, model) / white) == pytest.approx(PAPER_NOISE, rel=0.15)


def test_what_repeats_is_no_noise() -> None:
    quiet, waving = (power(*observed(wave)) for wave in (0.0, 2.0))
    assert np.sqrt(waving / quiet) == pytest.approx(np.ones(3), abs=0.05)
    known = with_pure_error(*observed())
    assert known is not None
    assert [noise.model.variance for noise in known.noise] == pytest.approx(quiet, rel=0.05)
