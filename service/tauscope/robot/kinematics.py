"""Forward kinematics: where the link frames are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingMismatchError
from tauscope.robot.robot import JointType, Placement, Robot, Segment, segment_couplings

Array = NDArray[np.float64]


def link_placements(chain: Robot | Sequence[Segment], q: Array) -> Array:
    """Every link frame seen from the base: T_j = T_{j-1} · before_j · motion_z(q_j) · after_j.

    Raises RecordingMismatchError if `q` has not one column a joint.

    `chain`: the arm, or its segments, base first; `q`: (N, n), joint position [rad or m]. Returns (N, m, 4, 4),
    homogeneous transforms; [:, j] is link frame j + 1 in the base frame [m].
    """
    segments = chain.segments if isinstance(chain, Robot) else tuple(chain)
    position = np.asarray(q, dtype=np.float64)
    couplings = segment_couplings(segments)
    joints = max((coupling.joint for coupling in couplings), default=-1) + 1
    if position.ndim != 2 or position.shape[1] != joints:
        raise RecordingMismatchError(
            f"joint positions of shape {position.shape} do not fit an arm of {joints} joints; give one column a joint"
        )
    placements = np.empty((len(position), len(segments), 4, 4))
    frame = np.broadcast_to(np.eye(4), (len(position), 4, 4))
    for j, (segment, coupling) in enumerate(zip(segments, couplings, strict=True)):
        moved = coupling.multiplier * position[:, coupling.joint] + coupling.offset
        frame = frame @ homogeneous(segment.before) @ _motion(segment.type, moved) @ homogeneous(segment.after)
        placements[:, j] = frame
    return placements


def homogeneous(placement: Placement) -> Array:
    """The homogeneous transform [[R, p], [0, 1]], shape (4, 4). `placement`: R and p [m]."""
    transform = np.eye(4)
    transform[:3, :3] = placement.rotation
    transform[:3, 3] = placement.translation
    return transform


def _motion(kind: JointType, position: Array) -> Array:
    """Turn about z or slide along z for each position, shape (N, 4, 4)."""
    motion = np.tile(np.eye(4), (len(position), 1, 1))
    if kind is JointType.PRISMATIC:
        motion[:, 2, 3] = position
        return motion
    cosine, sine = np.cos(position), np.sin(position)
    motion[:, 0, 0] = motion[:, 1, 1] = cosine
    motion[:, 1, 0], motion[:, 0, 1] = sine, -sine
    return motion
