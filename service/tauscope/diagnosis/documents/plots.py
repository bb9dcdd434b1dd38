"""What a diagnosis is drawn from: residuals over time, over what they depend on and over frequency, and the proof.

Before is the best model without the findings, after the one with them; both in the band that torque and model share.
"""

from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field

from tauscope.diagnosis.documents.residual_spectrum import ResidualSpectrum, residual_spectra
from tauscope.diagnosis.documents.torque_overlay import TorqueOverlay, rounded, torque_overlays
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.effects import Signals
from tauscope.recording.recording import Array
from tauscope.robot import JointType
from tauscope.strict_model import ResultModel

MOST_POINTS = 1500  # points of one joint's residual, over all recordings
FEWEST_POINTS = 150  # …and of one recording's, however many there are
BINS = 24
VARIABLES = ("velocity", "position", "load", "acceleration")
TIME = "time"


class ResidualCurve(ResultModel):
    """Residual of one joint over time in one recording, in the common band."""

    joint: str = Field(description="name of the joint")
    recording: str = Field(description="name of the recording")
    time: list[float] = Field(description="from the beginning of the recording [s]")
    before: list[float] = Field(description="what the nominal model leaves [Nm or N]")
    after: list[float] = Field(description="what the model with all findings leaves [Nm or N]")
    states: dict[str, list[float]] = Field(
        default={}, description="velocity, position, load and acceleration of the joint at these instants [SI]"
    )


class ResidualHistogram(ResultModel):
    """Residual of one joint by the value of a variable: bins of equal count."""

    joint: str = Field(description="name of the joint")
    variable: str = Field(
        description="velocity, position, load, acceleration [SI], or time, the recordings one after another [s]"
    )
    edges: list[float] = Field(description="edges of the bins, one more than there are bins")
    noise: float = Field(description="rms of the noise [Nm or N]")
    before: list[float] = Field(description="rms of the residual in each bin, nominal model [Nm or N]")
    after: list[float] = Field(description="the same with all findings [Nm or N]")


class DiagnosisPlots(ResultModel):
    """Data of a diagnosis' figures, schema tauscope.diagnosis-plots/1."""

    schema_id: Literal["tauscope.diagnosis-plots/1"] = Field(
        default="tauscope.diagnosis-plots/1", alias="schema", description="name and version of this document's form"
    )
    joint_types: dict[str, JointType] = Field(
        default={}, description="how each joint moves, by its name: its units are Nm and rad, or N and m"
    )
    curves: list[ResidualCurve] = Field(description="one a joint and recording")
    histograms: list[ResidualHistogram] = Field(description="one a joint and variable")
    overlays: list[TorqueOverlay] = Field(
        default=[], description="one a joint: measured and modelled torque where the findings help most"
    )
    spectra: list[ResidualSpectrum] = Field(default=[], description="one a joint")


def diagnosis_plots(diagnosis: Diagnosis) -> DiagnosisPlots:
    """What a diagnosis is drawn from."""
    observations = diagnosis.fitter.observations
    before = residual_rows(diagnosis.selection.nominal.model, observations)
    after = residual_rows(diagnosis.selection.fit.model, observations)
    signals = [diagnosis.selection.fit.model.signals(piece) for piece in observations]
    curves, histograms = [], []
    for joint, described in enumerate(diagnosis.robot.joints):
        rows = [np.concatenate([part[0] for part in each[joint]]) for each in (before, after)]
        states = _states(observations, signals, joint)
        curves += list(_curves(diagnosis, described.name, rows, states))
        noise = float(np.sqrt(observations.noise[joint].model.variance))
        for variable, values in {**states, TIME: _elapsed(observations)}.items():
            histogram = _histogram(described.name, variable, values, rows, noise)
            histograms += [] if histogram is None else [histogram]
    return DiagnosisPlots(
        joint_types={joint.name: joint.type for joint in diagnosis.robot.joints},
        curves=curves,
        histograms=histograms,
        overlays=torque_overlays(diagnosis),
        spectra=residual_spectra(diagnosis),
    )


def _states(observations: Observations, signals: list[Signals], joint: int) -> dict[str, Array]:
    """Variables that a residual may depend on, row by row."""
    pairs = list(zip(observations, signals, strict=True))
    return {
        name: np.concatenate([piece.reduced(getattr(own, name)[joint][None])[0] for piece, own in pairs])
        for name in VARIABLES
    }


def _recording_of_rows(observations: Observations) -> Array:
    """Number of the recording of every row."""
    return np.concatenate([np.full(p.repetitions * p.rows, p.prepared.recording) for p in observations])


def _elapsed(observations: Observations) -> Array:
    """Time of every row, as if each recording began where the one before it ended [s]."""
    recording = _recording_of_rows(observations)
    instants = np.concatenate([piece.row_times() for piece in observations])
    start = 0.0
    for number in range(len(observations.names)):
        own = recording == number
        end = float(instants[own].max(initial=0.0))
        instants[own] += start
        start += end
    return instants


def _curves(diagnosis: Diagnosis, joint: str, rows: list[Array], states: dict[str, Array]) -> Iterator[ResidualCurve]:
    observations = diagnosis.fitter.observations
    recording = _recording_of_rows(observations)
    instants = np.concatenate([piece.row_times() for piece in observations])
    most = max(MOST_POINTS // len(observations.names), FEWEST_POINTS)
    for number, name in enumerate(observations.names):
        own = np.flatnonzero(recording == number)
        shown = own[:: max(1, -(-len(own) // most))]
        yield ResidualCurve(
            joint=joint,
            recording=name,
            time=rounded(instants[shown]),
            before=rounded(rows[0][shown]),
            after=rounded(rows[1][shown]),
            states={variable: rounded(values[shown]) for variable, values in states.items()},
        )


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
        edges=rounded(edges),
        noise=noise,
        before=rounded(sizes[0]),
        after=rounded(sizes[1]),
    )
