"""What a diagnosis is drawn from: residuals over time, and over what they depend on, before and after the findings."""

from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field

from service.diagnosis.diagnosed import Diagnosis
from service.diagnosis.residual import residual_rows
from service.diagnosis.result import Document
from service.recording.recording import Array

MOST_POINTS = 1500
"""Points of one curve."""

BINS = 24

VARIABLES = ("velocity", "position", "load", "acceleration")


class ResidualCurve(Document):
    """Residual of one joint over time in one recording, in the common band."""

    joint: str = Field(description="name of the joint")
    recording: str = Field(description="name of the recording")
    time: list[float] = Field(description="from the beginning of the recording [s]")
    before: list[float] = Field(description="what the nominal model leaves [Nm or N]")
    after: list[float] = Field(description="what the model with all findings leaves [Nm or N]")


class ResidualHistogram(Document):
    """Residual of one joint by the value of a variable: bins of equal count."""

    joint: str = Field(description="name of the joint")
    variable: str = Field(description="velocity, position, load or acceleration [SI]")
    edges: list[float] = Field(description="edges of the bins, one more than there are bins")
    noise: float = Field(description="rms of the noise [Nm or N]")
    before: list[float] = Field(description="rms of the residual in each bin, nominal model [Nm or N]")
    after: list[float] = Field(description="the same with all findings [Nm or N]")


class DiagnosisPlots(Document):
    """Data of a diagnosis' figures, schema tauscope.diagnosis-plots/1."""

    schema_id: Literal["tauscope.diagnosis-plots/1"] = Field(
        default="tauscope.diagnosis-plots/1", alias="schema", description="name and version of this document's form"
    )
    curves: list[ResidualCurve] = Field(description="one a joint and recording")
    histograms: list[ResidualHistogram] = Field(description="one a joint and variable")


def diagnosis_plots(diagnosis: Diagnosis) -> DiagnosisPlots:
    """What a diagnosis is drawn from.

    Parameters
    ----------
    diagnosis : Diagnosis
        the result
    """
    observations = diagnosis.fitter.observations
    before = residual_rows(diagnosis.selection.nominal.model, observations)
    after = residual_rows(diagnosis.selection.fit.model, observations)
    signals = [diagnosis.selection.fit.model.signals(piece) for piece in observations]
    curves, histograms = [], []
    for joint, described in enumerate(diagnosis.robot.joints):
        rows = [np.concatenate([part[0] for part in each[joint]]) for each in (before, after)]
        curves += list(_curves(diagnosis, described.name, rows))
        for variable in VARIABLES:
            values = [
                piece.reduced(getattr(own, variable)[joint][None])[0]
                for piece, own in zip(observations, signals, strict=True)
            ]
            noise = float(np.sqrt(observations.noise[joint].model.variance))
            histogram = _histogram(described.name, variable, np.concatenate(values), rows, noise)
            histograms += [] if histogram is None else [histogram]
    return DiagnosisPlots(curves=curves, histograms=histograms)


def _curves(diagnosis: Diagnosis, joint: str, rows: list[Array]) -> Iterator[ResidualCurve]:
    observations = diagnosis.fitter.observations
    recording = np.concatenate([np.full(p.repetitions * p.rows, p.prepared.recording) for p in observations])
    instants = np.concatenate([piece.row_times() for piece in observations])
    for number, name in enumerate(observations.names):
        own = np.flatnonzero(recording == number)
        shown = own[:: max(1, -(-len(own) // MOST_POINTS))]
        before, after = ([float(value) for value in each[shown]] for each in rows)
        times = [float(value) for value in instants[shown]]
        yield ResidualCurve(joint=joint, recording=name, time=times, before=before, after=after)


def _histogram(joint: str, variable: str, values: Array, rows: list[Array], noise: float) -> ResidualHistogram | None:
    """Rms in bins of equal count; None where the variable does not vary."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    if len(edges) < 2:
        return None
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(bins, minlength=len(edges) - 1), 1)
    sizes = [np.sqrt(np.bincount(bins, each**2, minlength=len(edges) - 1) / count) for each in rows]
    return ResidualHistogram(
        joint=joint,
        variable=variable,
        edges=[float(edge) for edge in edges],
        noise=noise,
        before=[float(value) for value in sizes[0]],
        after=[float(value) for value in sizes[1]],
    )
