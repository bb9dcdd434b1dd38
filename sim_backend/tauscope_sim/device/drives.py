"""What the drives do with the joints in each activity, and from which of it they may change to which."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tauscope.robot.robot import Array, Robot
from tauscope_drivers import ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_sim.device.faults import FaultCode
from tauscope_sim.device.servo import InertiaSchedule, Servo
from tauscope_sim.device.target import STOP_TIME_S, Target, catching_up_acceleration
from tauscope_sim.scenario import Scenario


class Activity(StrEnum):
    """What the drives do with the arm."""

    BRAKED = "braked"  # never yet under power: the brakes carry the arm, which stands still
    TRACKING = "tracking"  # following the host's positions
    TORQUE = "torque"  # giving the torque that the host commands
    HOLDING = "holding"  # stopped; under power where it stands
    DAMPING = "damping"  # stopped; resisting motion in proportion to speed
    FREE = "free"  # stopped; no torque and no brake: an arm that is not balanced falls


# what needs the host's setpoints: here the watchdog is armed
COMMANDED = frozenset({Activity.TRACKING, Activity.TORQUE})
POWERED = COMMANDED | {Activity.HOLDING, Activity.DAMPING}  # where the drives hold or drive the joints

# allowed changes. A stop never puts an arm under power that has none: a braked arm stays braked, a free one free.
TRANSITIONS: dict[Activity, frozenset[Activity]] = {
    Activity.BRAKED: COMMANDED,
    Activity.TRACKING: frozenset({Activity.HOLDING, Activity.DAMPING, Activity.FREE}),
    Activity.TORQUE: frozenset({Activity.HOLDING, Activity.DAMPING, Activity.FREE}),
    Activity.HOLDING: COMMANDED | {Activity.DAMPING, Activity.FREE},
    Activity.DAMPING: COMMANDED | {Activity.HOLDING, Activity.FREE},
    Activity.FREE: COMMANDED,
}
COMMANDED_BY = {ControlMode.POSITION: Activity.TRACKING, ControlMode.TORQUE: Activity.TORQUE}
_BY_POLICY = {
    StopPolicy.HOLD: Activity.HOLDING,
    StopPolicy.DAMP: Activity.DAMPING,
    StopPolicy.TORQUE_OFF: Activity.FREE,
}


def stopped_by(activity: Activity, policy: StopPolicy) -> Activity:
    """What a stop leads to; the activity itself where there is nothing to stop."""
    asked = _BY_POLICY[policy]
    return asked if asked in TRANSITIONS[activity] else activity


_MARGIN = 2e-3


@dataclass(frozen=True, eq=False)
class Motion:
    """What the drives' own loop sees of the motors."""

    position: Array  # (n,), in joint units, with the encoders' slip [rad or m]
    velocity: Array  # (n,), likewise [rad/s or m/s]


class Drives:
    """Servo and target of all joints. `tick_s`: time between two ticks [s]."""

    def __init__(self, robot: Robot, scenario: Scenario, motion: Motion, tick_s: float) -> None:
        self._servo = Servo(robot, InertiaSchedule(robot, scenario.effects), tick_s)
        self._tick_s = tick_s
        self._acceleration = catching_up_acceleration(robot)
        self._zero = np.zeros(robot.joint_count)
        self._target = self._target_at(motion)
        self._fastest = np.full(robot.joint_count, np.inf)
        self._commanded_torque: Array | None = None

    def enable(self, before: Activity, motion: Motion, limits: DriveLimits) -> None:
        """Take the arm over where it stands, or go on holding it where it is held."""
        self._servo.set_torque_limit(limits.torque)
        if before is not Activity.HOLDING:
            self._servo.begin()
            self._target = self._target_at(motion)
        self._target.resume()
        self._target.limit(limits.position_low, limits.position_high, limits.velocity)
        self._fastest = limits.velocity
        self._commanded_torque = None

    def command(self, activity: Activity, setpoint: Setpoint, arrival: float) -> None:
        """Take a setpoint that is due. `arrival`: when it arrived [ticks]."""
        if activity is Activity.TRACKING:
            self._target.follow(setpoint.position, setpoint.torque, arrival)
        else:
            self._commanded_torque = setpoint.torque

    def hold(self, before: Activity, motion: Motion) -> None:
        """Bring the joints to rest and hold them."""
        if before is Activity.TRACKING or (before is Activity.TORQUE and self._commanded_torque is None):
            self._servo.absorb(self._target.feed_forward)
            self._target.brake()
            return
        low, high = self._target.range
        self._servo.begin()
        self._target = self._target_at(motion)
        self._target.limit(low, high, np.full_like(low, np.inf))

    def torque(self, activity: Activity, motion: Motion, tick: int) -> Array:
        """Torque of all joints, (n,) [Nm or N]."""
        if activity is Activity.FREE:
            return self._zero
        if activity is Activity.DAMPING:
            return self._servo.damp(motion.position, motion.velocity)
        if activity is Activity.TORQUE and self._commanded_torque is not None:
            return self._servo.capped(self._commanded_torque)
        target = self._target
        target.advance(tick)
        forward = target.feed_forward if activity is Activity.TRACKING else None
        error, error_rate = target.position - motion.position, target.velocity - motion.velocity
        return self._servo.track(error, error_rate, forward, motion.position)

    def overrun(self, motion: Motion) -> tuple[FaultCode, int, str] | None:
        """What takes the arm beyond its limits in torque control; who cannot be stopped in time counts, too."""
        speed = np.abs(motion.velocity)
        if (speed > self._fastest).any():
            column = int(np.argmax(speed - self._fastest))
            detail = f"speed {speed[column]:.3g}, above the limit {self._fastest[column]:.3g}"
            return FaultCode.OVER_SPEED, column + 1, detail
        low, high = self._target.range
        halt = motion.position + (0.5 * STOP_TIME_S) * motion.velocity
        outside = ((halt > high + _MARGIN) & (motion.velocity > 0.0)) | (
            (halt < low - _MARGIN) & (motion.velocity < 0.0)
        )
        if not outside.any():
            return None
        column = int(np.argmax(outside))
        detail = f"at {motion.position[column]:.4g}, leaving its range {low[column]:.4g} to {high[column]:.4g}"
        return FaultCode.POSITION_LIMIT, column + 1, detail

    def _target_at(self, motion: Motion) -> Target:
        return Target(motion.position, motion.velocity, self._acceleration, self._tick_s)
