"""The rows of a diagnosis as a black box is given them: the only file that knows how a diagnosis keeps them."""

import numpy as np

from tauscope.diagnosis import Diagnosis, Verdict
from tauscope.diagnosis.model.residual import predicted_rows
from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.headroom.motion_rows import MotionRows
from tauscope.recording.recording import Array


def motion_rows(diagnosis: Diagnosis) -> tuple[list[MotionRows], list[MotionRows]]:
    """Training and held-out rows, with the motion as it was measured."""
    held_out = diagnosis.held_out
    return _rows(diagnosis, diagnosis.fitter.observations), (
        [] if held_out is None else _rows(diagnosis, held_out.observations)
    )


def leaves_open(diagnosis: Diagnosis) -> list[bool]:
    """Per joint, whether the verdict says that more than noise is left there; all where it decides nothing."""
    if diagnosis.verdict is Verdict.INCONCLUSIVE:
        return [True] * diagnosis.robot.joint_count
    told = diagnosis.verdict in (Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED)
    left = diagnosis.mismatched if diagnosis.verdict is Verdict.UNEXPLAINED else diagnosis.misfit_after.significant
    return [told and own for own in left]


def _rows(diagnosis: Diagnosis, observations: Observations) -> list[MotionRows]:
    """The pieces of some recordings."""
    pieces = observations.pieces
    ends: dict[int, float] = {}
    for piece in pieces:
        number = piece.prepared.recording
        ends[number] = max(ends.get(number, 0.0), float(piece.time[-1, -1]))
    return [_piece_rows(diagnosis, observations, piece, ends[piece.prepared.recording]) for piece in pieces]


def _piece_rows(diagnosis: Diagnosis, observations: Observations, piece: Piece, end_s: float) -> MotionRows:
    plain, explained = diagnosis.selection.nominal.model, diagnosis.selection.fit.model
    signals, time = plain.signals(piece), piece.row_times()
    return MotionRows(
        recording=piece.prepared.recording,
        time=time,
        progress=_progress(observations, piece, time, end_s),
        position=piece.reduced(signals.position),
        velocity=piece.reduced(signals.velocity),
        acceleration=piece.reduced(signals.acceleration),
        load=piece.reduced(signals.load),
        torque=piece.torque.reshape(len(piece.torque), -1),
        plain=predicted_rows(plain, piece),
        explained=predicted_rows(explained, piece),
        used=piece.used.reshape(len(piece.used), -1),
    )


def _progress(observations: Observations, piece: Piece, time: Array, end_s: float) -> Array:
    """Part of the recording's motion that is over, alike in every repetition."""
    progress = np.clip(time / max(end_s, np.finfo(float).tiny), 0.0, 1.0 - 1e-9)
    number = piece.prepared.recording
    for run in observations.repetitions[number] if 0 <= number < len(observations.repetitions) else ():
        since = time - run.start_s
        within = (since >= 0.0) & (since < run.count * run.length_s)
        progress[within] = np.modf(since[within] / run.length_s)[0]
    return progress
