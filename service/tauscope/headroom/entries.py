"""The headroom of a diagnosis: what a black box still predicts at every joint, and whether that refutes the verdict."""

import numpy as np
from threadpoolctl import threadpool_limits

from tauscope.diagnosis import Diagnosis
from tauscope.diagnosis.documents.result import HeadroomEntry
from tauscope.errors import IdentificationError
from tauscope.extras import require_extra
from tauscope.headroom.diagnosed_rows import leaves_open, motion_rows
from tauscope.headroom.floor import NoiseFloor, noise_floors
from tauscope.headroom.joint_headroom import JointHeadroom, joint_headroom

REFUTES_FROM = 0.05
"""Part of a joint's held-out residual energy beyond which what a black box predicts is something (issue: 5 %)."""


def require_black_box(held_out: int) -> None:
    """Check that headroom can be measured, before anything else is.

    Raises MissingExtraError where scikit-learn is not installed. Raises IdentificationError where no recording is held
    out.

    `held_out`: number of held-out recordings.
    """
    with require_extra("tauscope diagnose --headroom"):
        import sklearn  # noqa: F401
    if not held_out:
        raise IdentificationError("headroom: no recording is held out; name recordings of other motion in --held-out")


def measure_headroom(diagnosis: Diagnosis) -> list[HeadroomEntry]:
    """What a black box of the same training motion predicts of held-out motion, joint by joint.

    Raises MissingExtraError where scikit-learn is not installed. Raises IdentificationError where no recording is held
    out.
    """
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
    return HeadroomEntry(
        joint=joint,
        plain=found.plain,
        explained=found.explained,
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
