"""The headroom of a diagnosis: its rows as a black box is given them, what that still predicts, and what it refutes."""

import numpy as np
from threadpoolctl import threadpool_limits

from tauscope.diagnosis import Diagnosis, Verdict
from tauscope.diagnosis.documents.result import HeadroomEntry
from tauscope.diagnosis.model.residual import predicted_rows
from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.errors import IdentificationError
from tauscope.extras import require_extra
from tauscope.headroom.floor import NoiseFloor, noise_floors
from tauscope.headroom.joint_headroom import JointHeadroom, joint_headroom
from tauscope.headroom.motion_rows import MotionRows
from tauscope.recording.recording import Array
from tauscope.strict_model import take_fields


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


# Part of a joint's held-out residual energy beyond which what a black box predicts is something (issue: 5 %).
REFUTES_FROM = 0.05


def require_black_box(held_out: int) -> None:
    """Raise MissingExtraError without scikit-learn, and IdentificationError without a held-out recording."""
    with require_extra("tauscope diagnose --headroom"):
        import sklearn  # noqa: F401
    if not held_out:
        raise IdentificationError("headroom: no recording is held out; name recordings of other motion in --held-out")


def measure_headroom(diagnosis: Diagnosis) -> list[HeadroomEntry]:
    """What a black box of the same motion predicts of held-out motion, joint by joint; raises as above."""
    training, held_out = motion_rows(diagnosis)
    require_black_box(len(held_out))
    # One after another: scikit-learn's own use of warnings.catch_warnings allows no two threads.
    with threadpool_limits(1):  # many small fits: threads of its own cost more than they bring
        found = [joint_headroom(training, held_out, joint) for joint in range(diagnosis.robot.joint_count)]
    floors = noise_floors(diagnosis, [*training, *held_out])
    told = zip(diagnosis.robot.joints, found, floors, leaves_open(diagnosis), strict=True)
    return [headroom_entry(joint.name, own, floor, is_open=is_open) for joint, own, floor, is_open in told]


def headroom_entry(joint: str, found: JointHeadroom, floor: NoiseFloor, *, is_open: bool) -> HeadroomEntry:
    """What a black box says of one joint, of which the verdict leaves something open or calls the remainder noise."""
    has_gain = found.share > REFUTES_FROM and found.is_significant
    share = f"{100.0 * found.share:.0f} % of {joint}'s held-out residual"
    if np.isnan(found.share):
        statement = f"The recordings hold too few rows of {joint} for a black box."
    elif not has_gain:
        statement = f"A black box predicts no more of {joint}'s held-out residual."
    elif is_open:
        statement = f"A black box still predicts {share}; the verdict leaves it open."
    else:
        statement = f"A black box still predicts {share}: something is left."
    return take_fields(
        HeadroomEntry,
        found,
        joint=joint,
        black_box=_number(found.black_box),
        floor=floor.rms,
        floor_kind=floor.kind,
        share=_number(found.share),
        share_std=_number(found.share_std),
        refuted=has_gain and not is_open,
        statement=statement,
    )


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
