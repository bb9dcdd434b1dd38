"""Rigid displacements, and forward kinematics: where the link frames are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.errors import RecordingMismatchError
from tauscope.robot.robot import Array, JointType, Placement, Robot, Segment, segment_couplings


def compose(first: Placement, second: Placement) -> Placement:
    """One displacement after the other: R = R₁ R₂, p = p₁ + R₁ p₂."""
    return Placement(first.rotation @ second.rotation, first.translation + first.rotation @ second.translation)


def rotation_about(axis: int, angle: float) -> Array:
    """Rotation matrix about x (0), y (1) or z (2), shape (3, 3). `angle`: [rad]."""
    matrix, first, second = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    matrix[first, first] = matrix[second, second] = np.cos(angle)
    matrix[second, first] = np.sin(angle)
    matrix[first, second] = -matrix[second, first]
    return matrix


def rotation_of_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Array:
    """The URDF's fixed-axis angles [rad]: R = Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3)."""
    return rotation_about(2, yaw) @ rotation_about(1, pitch) @ rotation_about(0, roll)


def rotation_of_z_to(axis: Array) -> Array:
    """A rotation (3, 3) that carries z to the unit vector `axis`, (3,): Rodrigues' R = 1 + [v] + [v]²/(1 + c).

    v = z × axis, c = z·axis. Where the axis points down, 1 + c loses its digits: half a turn about x comes first.
    """
    if axis[2] < 0.0:
        return rotation_of_z_to(-axis) @ np.diag([1.0, -1.0, -1.0])
    x, y, c = axis
    return np.array(
        [
            [1.0 - x * x / (1.0 + c), -x * y / (1.0 + c), x],
            [-x * y / (1.0 + c), 1.0 - y * y / (1.0 + c), y],
            [-x, -y, c],
        ]
    )


def joint_displacement(kind: JointType, axis: Array, position: float) -> Placement:
    """A turn about an axis through the origin, or a slide along it. `axis`: (3,), unit vector."""
    if kind is JointType.PRISMATIC:
        return Placement(translation=position * axis)
    align = rotation_of_z_to(axis)
    return Placement(align @ rotation_about(2, position) @ align.T)


@dataclass(frozen=True)
class DenavitHartenbergRow:
    """One row of Denavit-Hartenberg parameters."""

    theta: float  # θ; a revolute joint's position adds to it [rad]
    d: float  # along z; a prismatic joint's position adds to it [m]
    a: float  # along x [m]
    alpha: float  # α, about x [rad]
    type: JointType = JointType.REVOLUTE


def standard_segments(rows: Sequence[DenavitHartenbergRow]) -> tuple[Segment, ...]:
    """Segments of standard rows (Spong): A = Rz(θ) Tz(d) Tx(a) Rx(α). `rows`: one a joint, base first."""
    return tuple(Segment(row.type, _along_z(row), _along_x(row)) for row in rows)


def modified_segments(rows: Sequence[DenavitHartenbergRow]) -> tuple[Segment, ...]:
    """Segments of modified rows (Craig): A = Rx(α) Tx(a) Rz(θ) Tz(d). `rows`: one a joint, base first."""
    return tuple(Segment(row.type, compose(_along_x(row), _along_z(row)), Placement()) for row in rows)


def _along_z(row: DenavitHartenbergRow) -> Placement:
    """Rz(θ) Tz(d)."""
    return Placement(rotation_about(2, row.theta), np.array([0.0, 0.0, row.d]))


def _along_x(row: DenavitHartenbergRow) -> Placement:
    """Tx(a) Rx(α), which commute."""
    return Placement(rotation_about(0, row.alpha), np.array([row.a, 0.0, 0.0]))


def link_placements(chain: Robot | Sequence[Segment], q: Array) -> Array:
    """Link frames seen from the base, (N, m, 4, 4), T_j = T_{j-1} · before_j · motion_z(q_j) · after_j, by `q`, (N, n).

    Raises RecordingMismatchError for another number of joints.
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
