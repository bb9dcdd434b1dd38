"""The proof of a diagnosis: measured torque beside what the models without and with the findings say, motion unseen."""

import numpy as np
from pydantic import Field

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.residual import predicted_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.recording.recording import Array
from tauscope.strict_model import ResultModel

MOST_ROWS = 900  # rows of one overlay: about two a pixel
DIGITS = 5


class TorqueOverlay(ResultModel):
    """Torque of one joint over a stretch of one recording, in the common band."""

    joint: str = Field(description="name of the joint")
    recording: str = Field(description="name of the recording")
    held_out: bool = Field(description="whether neither model was made from it")
    time: list[float] = Field(description="from the beginning of the recording [s]")
    measured: list[float] = Field(description="measured torque [Nm or N]")
    before: list[float] = Field(description="torque of the model without the findings [Nm or N]")
    after: list[float] = Field(description="torque of the model with them [Nm or N]")
    noise: float = Field(description="rms of the torque noise in the band [Nm or N]")


def judging_observations(diagnosis: Diagnosis) -> tuple[Observations, bool]:
    """The held-out rows, or the training rows where there are none; and whether they are held out."""
    held_out = diagnosis.held_out
    rows = diagnosis.fitter.observations if held_out is None else held_out.observations
    return rows, held_out is not None


def torque_overlays(diagnosis: Diagnosis) -> list[TorqueOverlay]:
    """Every joint's torque where the findings take most off its residual."""
    observations, held_out = judging_observations(diagnosis)
    models = (diagnosis.selection.nominal.model, diagnosis.selection.fit.model)
    predicted = [[predicted_rows(model, piece) for model in models] for piece in observations]
    found = []
    for joint, described in enumerate(diagnosis.robot.joints):
        place, rows = _most_telling(observations, predicted, joint)
        piece = observations.pieces[place]
        number = piece.prepared.recording
        found.append(
            TorqueOverlay(
                joint=described.name,
                recording=observations.names[-1 - number if number < 0 else number],
                held_out=held_out,
                time=rounded(piece.row_times()[rows]),
                measured=rounded(piece.torque[joint].ravel()[rows]),
                before=rounded(predicted[place][0][joint][rows]),
                after=rounded(predicted[place][1][joint][rows]),
                noise=float(np.sqrt(observations.noise[joint].model.variance)),
            )
        )
    return found


def _most_telling(observations: Observations, predicted: list[list[Array]], joint: int) -> tuple[int, slice]:
    """Piece and rows of one repetition in which the squared residual falls most."""
    best, chosen = -np.inf, (0, slice(0, 1))
    for place, (piece, (before, after)) in enumerate(zip(observations, predicted, strict=True)):
        measured = piece.torque[joint].ravel()
        gain = np.where(
            piece.used[joint].ravel(), (measured - before[joint]) ** 2 - (measured - after[joint]) ** 2, 0.0
        )
        length = min(MOST_ROWS, piece.rows)
        for repetition in range(piece.repetitions):
            own = gain[repetition * piece.rows : (repetition + 1) * piece.rows]
            total = np.concatenate([[0.0], np.cumsum(own)])
            sums = total[length:] - total[:-length]
            start = int(np.argmax(sums))
            if sums[start] > best:
                first = repetition * piece.rows + start
                best, chosen = float(sums[start]), (place, slice(first, first + length))
    return chosen


def rounded(values: Array) -> list[float]:
    """Values to `DIGITS` significant digits: a figure's document is a third as long. `values`: (N,), what is drawn."""
    magnitude = np.floor(np.log10(np.maximum(np.abs(values), np.finfo(float).tiny)))
    # Powers of ten beyond what a float holds would turn the smallest numbers into NaN.
    scale = 10.0 ** np.clip(DIGITS - 1 - magnitude, -300.0, 300.0)
    return (np.round(values * scale) / scale).tolist()
