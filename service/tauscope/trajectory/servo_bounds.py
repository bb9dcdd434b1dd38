"""What position servos can follow: the torque that supply and following error leave at a speed.

A loop τ = κ clip(kp e, ±max_duty V) - d q̇ whose target lags by T gives |τ| + d |q̇| ≤ max_duty V κ, and is no
further than ε from its command where |τ| + (d + k T) |q̇| ≤ k ε, k its stiffness.
"""

from dataclasses import dataclass, replace

import numpy as np

from tauscope.robot import JointType, Robot
from tauscope.robot.robot import Array

# Following error that is allowed where nothing is stated [rad or m].
DEFAULT_FOLLOWING = {JointType.REVOLUTE: 0.2, JointType.PRISMATIC: 0.05}
USUAL_RATE_HZ = 100.0  # cycles a second that a bus of servos allows
PACE_CYCLES = 2.0  # least delay of a goal that a driver paces
BOUNDS = {  # and what to do where one leaves too little
    "voltage": "lower limits.velocity, or raise the supply and actuator.supply_voltage",
    "following error": "raise the servo's P gain and actuator.kp or the rate, or allow a larger following_error",
}
READ_CYCLES = 1.0  # age of the position that the guard compares with a goal


@dataclass(frozen=True, eq=False)
class TorqueBounds:
    """Bounds |τ| + `damping` |q̇| ≤ `available`: a row each, a column a joint; infinite where there is none."""

    names: tuple[str, ...]
    available: Array  # (B, n) [Nm or N]
    damping: Array  # (B, n) [Nm s/rad or N s/m]

    @property
    def speed(self) -> Array:
        """Speed at which no torque is left, (n,) [rad/s or m/s]."""
        return (self.available / np.maximum(self.damping, 1e-100)).min(axis=0, initial=np.inf)

    def share(self, torque: Array, speed: Array) -> Array:
        """Used part of each bound, (N, B, n); `torque`, |τ|, and `speed`, |q̇|: (N, n)."""
        return (torque[:, None] + self.damping * speed[:, None]) / self.available

    def with_limit(self, torque: Array, part: float = 1.0) -> "TorqueBounds":
        """A part of these and, before them, of joint torque limits, (n,)."""
        damping = np.vstack([np.zeros_like(torque), self.damping])
        return TorqueBounds(("torque", *self.names), part * np.vstack([torque, self.available]), damping)


def servo_bounds(
    robot: Robot, following: float | Array | None = None, rate_hz: float = USUAL_RATE_HZ, voltage: Array | None = None
) -> TorqueBounds:
    """Those of `BOUNDS` that bind a joint.

    `following`: allowed distance from the command [rad or m]; `voltage`: (n,), measured supply, which counts where it
    is lower than the stated one. Gains of an MJCF are the user's simulation's, and bound nothing.
    """
    n = robot.joint_count
    available, damping = np.full((2, n), np.inf), np.zeros((2, n))
    usual = [DEFAULT_FOLLOWING[joint.type] for joint in robot.joints]
    allowed = np.broadcast_to(usual if following is None else following, n)
    for j, joint in enumerate(robot.joints):
        loop = joint.actuator
        if loop is None or not loop.has_loop or (loop.unit != "register" and robot.mjcf is not None):
            continue
        if loop.unit == "register" and voltage is not None and np.isfinite(voltage[j]):
            loop = replace(loop, supply_voltage=float(np.fmin(voltage[j], loop.supply_voltage or np.inf)))
        if (stall := loop.stall_torque) is not None:
            available[0, j], damping[0, j] = stall, loop.damping
        if loop.kind == "position" and (stiffness := loop.stiffness) is not None:
            lag_s = max(PACE_CYCLES / rate_hz, loop.delay or 0.0) + READ_CYCLES / rate_hz
            available[1, j], damping[1, j] = stiffness * allowed[j], loop.damping + stiffness * lag_s
    rows = np.flatnonzero(np.isfinite(available).any(axis=1))
    return TorqueBounds(tuple(list(BOUNDS)[row] for row in rows), available[rows], damping[rows])
