"""Rigid displacements: elementary rotations, and one placement after the other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import JointType, Placement, Segment

Array = NDArray[np.float64]


def compose(first: Placement, second: Placement) -> Placement:
    """One displacement after the other: R = R₁ R₂, p = p₁ + R₁ p₂."""
    return Placement(first.rotation @ second.rotation, first.translation + first.rotation @ second.translation)


def rotation_about_x(angle: float) -> Array:
    """Rotation matrix about x, shape (3, 3). `angle`: [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_about_y(angle: float) -> Array:
    """Rotation matrix about y, shape (3, 3). `angle`: [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_about_z(angle: float) -> Array:
    """Rotation matrix about z, shape (3, 3). `angle`: [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_of_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Array:
    """The URDF's fixed-axis angles: R = Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3).

    `roll`: about x [rad]; `pitch`: about y [rad]; `yaw`: about z [rad].
    """
    return rotation_about_z(yaw) @ rotation_about_y(pitch) @ rotation_about_x(roll)


def rotation_of_z_to(axis: Array) -> Array:
    """A rotation that carries z to an axis: R [0, 0, 1]ᵀ = axis, shape (3, 3).

    Rodrigues' formula R = 1 + [v] + [v]²/(1 + c) with v = z × axis, c = z·axis. Where the axis points down, 1 + c loses
    its digits: there z is carried to -axis, after half a turn about x.

    `axis`: (3,), unit vector.
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


@dataclass(frozen=True)
class DenavitHartenbergRow:
    """One row of Denavit-Hartenberg parameters.

    `theta`: θ; a revolute joint's position adds to it [rad].
    `d`: along z; a prismatic joint's position adds to it [m].
    `a`: along x [m].
    `alpha`: α, about x [rad].
    """

    theta: float
    d: float
    a: float
    alpha: float
    type: JointType = JointType.REVOLUTE


def standard_segments(rows: Sequence[DenavitHartenbergRow]) -> tuple[Segment, ...]:
    """Segments of standard rows (Spong): A = Rz(θ) Tz(d) Tx(a) Rx(α). `rows`: one a joint, base first."""
    return tuple(Segment(row.type, _along_z(row), _along_x(row)) for row in rows)


def modified_segments(rows: Sequence[DenavitHartenbergRow]) -> tuple[Segment, ...]:
    """Segments of modified rows (Craig): A = Rx(α) Tx(a) Rz(θ) Tz(d). `rows`: one a joint, base first."""
    return tuple(Segment(row.type, compose(_along_x(row), _along_z(row)), Placement()) for row in rows)


def _along_z(row: DenavitHartenbergRow) -> Placement:
    """Rz(θ) Tz(d)."""
    return Placement(rotation_about_z(row.theta), np.array([0.0, 0.0, row.d]))


def _along_x(row: DenavitHartenbergRow) -> Placement:
    """Tx(a) Rx(α), which commute."""
    return Placement(rotation_about_x(row.alpha), np.array([row.a, 0.0, 0.0]))
