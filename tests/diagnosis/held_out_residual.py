"""What a model leaves of measured torque in one band, friction and all."""

from collections.abc import Sequence

import numpy as np

from tauscope.diagnosis import Diagnosis
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import Observations
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array


def squares(model: ExtendedModel, observations: Observations) -> tuple[Array, Array]:
    """Sums of squares of every joint's residual and torque, (n,) each [(Nm)² or N²]."""
    left, whole = np.zeros(observations.robot.joint_count), np.zeros(observations.robot.joint_count)
    for joint, rows in enumerate(residual_rows(model, observations)):
        for row, torque, piece in zip(rows, observations.torque(joint), observations, strict=True):
            used = piece.used[joint].ravel()
            left[joint] += float(np.sum(row[0, used] ** 2))
            whole[joint] += float(np.sum(torque[0, used] ** 2))
    return left, whole


def relative_error(diagnosis: Diagnosis, recordings: Sequence[Recording], cutoff_hz: float) -> float:
    """‖τ - τ̂‖ / ‖τ‖ over all joints of the model with all findings, in a band of the caller's choice."""
    model = diagnosis.selection.fit.model
    conditioners = [Conditioner.survey(recording, diagnosis.robot) for recording in recordings]
    base = diagnosis.identification.structure.base
    left, whole = squares(model, Observations.prepare(conditioners, diagnosis.robot, base, cutoff_hz, model.steepness))
    return float(np.sqrt(left.sum() / whole.sum()))
