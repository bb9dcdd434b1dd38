"""What is constant about one segment of the chain, split into turns in a plane and shifts of the origin.

Any rotation is R = Rz(φ) Rx(β) Rz(γ). In ``before · motion_z(q) · after`` the turns about z next to the joint merge
with its angle, so that a segment given by Denavit-Hartenberg parameters takes two turns in all, any other five at most.
"""

import numpy as np

from tauscope.robot.robot import Array, JointType, Segment

# The two components that a turn mixes, in the order in which a positive angle leads from one to the other.
Plane = tuple[int, int]

# Components of a shift of the origin, each the same for all samples or one a sample.
Offset = tuple[float | Array, float | Array, float | Array]
ABOUT_X: Plane = (1, 2)
ABOUT_Z: Plane = (0, 1)


class Step:
    """Constants of one segment: turns and offsets before the joint's motion and after it.

    `turns_before`, `turns_after`: plane, cosine and sine of each; `before`: in frame j-1, `after`: in frame j [m].
    """

    def __init__(self, segment: Segment) -> None:
        self.revolute = segment.type is JointType.REVOLUTE
        first, about_x, third = euler_zxz(segment.before.rotation)
        fourth, about_x_after, last = euler_zxz(segment.after.rotation)
        # The middle turns are about the joint's own axis and merge with its angle, where it is revolute [rad].
        self.angle = third + fourth
        middle = [] if self.revolute else [(ABOUT_Z, self.angle)]
        self.turns_before = _turns([(ABOUT_Z, first), (ABOUT_X, about_x), *middle])
        self.turns_after = _turns([(ABOUT_X, about_x_after), (ABOUT_Z, last)])
        self.before = _offset(segment.before.translation)
        self.after = _offset(segment.after.rotation.T @ segment.after.translation)
        self._axis = _offset(segment.after.rotation[2])

    def slid(self, q: Array) -> Offset:
        """Offset after a prismatic joint, p + ẑ q in frame j [m]; `q`: (N,) [m]."""
        x, y, z = (p if along == 0.0 else p + along * q for p, along in zip(self.after, self._axis, strict=True))
        return x, y, z


def euler_zxz(rotation: Array) -> tuple[float, float, float]:
    """Angles of `rotation` (3, 3) = Rz(φ) Rx(β) Rz(γ), φ in [-π/2, π/2] and zero where z stays parallel to z."""
    first = 0.0
    sine_x, sine_y = rotation[0, 2], -rotation[1, 2]
    if np.hypot(sine_x, sine_y) > _ROUNDING:
        sign = -1.0 if sine_y < 0 else 1.0
        first = float(np.arctan2(sign * sine_x, sign * sine_y))
    c, s = np.cos(first), np.sin(first)
    x, y = c * rotation[0] + s * rotation[1], c * rotation[1] - s * rotation[0]
    return first, float(np.arctan2(-y[2], rotation[2, 2])), float(np.arctan2(-x[1], x[0]))


# Below this a sine, cosine or length is rounding (cos π/2 = 6e-17); 1e-8 is a user's own digits and is kept.
_ROUNDING = 1e-15


def _turns(angles: list[tuple[Plane, float]]) -> list[tuple[Plane, float, float]]:
    """Plane, cosine and sine of the turns that turn anything, exact at right angles."""
    turns = []
    for plane, angle in angles:
        cosine, sine = _exact(np.cos(angle)), _exact(np.sin(angle))
        if (cosine, sine) != (1.0, 0.0):
            turns.append((plane, cosine, sine))
    return turns


def _exact(value: float) -> float:
    nearest = round(value)
    return float(nearest if abs(value - nearest) < _ROUNDING else value)


def _offset(vector: Array) -> tuple[float, float, float]:
    x, y, z = (0.0 if abs(value) < _ROUNDING else float(value) for value in vector)
    return x, y, z
