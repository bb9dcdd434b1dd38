"""Sentences say what the numbers say."""

import pytest

from report.conftest import JOINTS, Case
from tauscope.identification import IdentificationDocument, document
from tauscope.report.words import band_words, cautions, fit_sentences, noise_ratio
from tauscope.result_warning import ResultWarning


@pytest.fixture
def result(case: Case) -> IdentificationDocument:
    return document(case.identification)


def with_rms(result: IdentificationDocument, factors: tuple[float, ...], held: float = 1.0) -> IdentificationDocument:
    """The same result with residuals of so many times the noise, and that many times more held out."""
    rms = [factor * noise for factor, noise in zip(factors, result.noise_std, strict=True)]
    assert result.fit.held_out is not None
    fit = result.fit.model_copy(
        update={
            "train": result.fit.train.model_copy(update={"rms": rms}),
            "held_out": result.fit.held_out.model_copy(update={"rms": [held * value for value in rms]}),
        }
    )
    return result.model_copy(update={"fit": fit, "joints": ["a", "b", "c"]})


def test_noise_only(result: IdentificationDocument) -> None:
    error, level = fit_sentences(with_rms(result, (1.0, 1.05, 0.98)))
    assert "% on held-out ones" in error
    assert level == "At every joint the residual is at the level of the sensor noise: little else is left."


def test_joints_are_told_apart(result: IdentificationDocument) -> None:
    _, noise, above, well_above = fit_sentences(with_rms(result, (1.0, 1.5, 4.0)))
    assert noise.startswith("At a the residual is at the level")
    assert above.startswith("At b the residual is above")
    assert well_above.startswith("At c the residual is well above")


def test_coloured_noise_is_not_called_an_effect(result: IdentificationDocument) -> None:
    whitened = with_rms(result, (1.0, 1.5, 4.0)).model_copy(update={"noise_method": "residual"})
    assert all("or the noise is coloured" in sentence for sentence in fit_sentences(whitened)[2:])


def test_a_model_that_does_not_carry_over_is_told(result: IdentificationDocument) -> None:
    assert "does not carry over" in fit_sentences(with_rms(result, (1.0, 1.0, 1.0), held=1.5))[-1]
    assert "does not carry over" not in fit_sentences(with_rms(result, (1.0, 1.0, 1.0), held=1.2))[-1]


def test_a_caution_says_what_to_do(result: IdentificationDocument) -> None:
    warning = ResultWarning(code="wrong-sign", joint=JOINTS[0], text="it is reversed", remedy="turn it round")
    plain = warning.model_copy(update={"remedy": None})
    assert cautions(result.model_copy(update={"warnings": [warning, plain]})) == [
        "it is reversed; turn it round.",
        "it is reversed.",
    ]


def test_ratio_and_band(result: IdentificationDocument) -> None:
    assert noise_ratio(1.0, 0.0) == float("inf")
    assert noise_ratio(1.0, 0.5) == 2.0
    assert band_words(result.model_copy(update={"cutoff_hz": None})) == "all frequencies"
    assert band_words(result.model_copy(update={"cutoff_hz": 5.5})) == "0 – 5.50 Hz"
