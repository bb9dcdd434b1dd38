"""What every joint may do during an excitation: the robot file's limits, and stated defaults where it has none."""

from dataclasses import dataclass

import numpy as np

from tauscope.robot import JointType, Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples

# Positions from minus to plus this where no range is stated [rad or m].
DEFAULT_RANGE = {JointType.REVOLUTE: np.pi, JointType.PRISMATIC: 0.25}
DEFAULT_SPEED = {JointType.REVOLUTE: 1.0, JointType.PRISMATIC: 0.25}  # speed where no limit is stated [rad/s or m/s]

# Acceleration where no limit is stated [rad/s² or m/s²].
DEFAULT_ACCELERATION = {JointType.REVOLUTE: 4.0, JointType.PRISMATIC: 1.0}


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Limits of every joint. `position_low`, `position_high`: (n,), range of the position [rad or m]."""

    position_low: Array
    position_high: Array
    velocity: Array  # (n,), largest speed [rad/s or m/s]
    acceleration: Array  # (n,), largest acceleration [rad/s² or m/s²]
    torque: Array  # (n,), largest torque, infinite where none is stated [Nm or N]
    assumed: tuple[str, ...] = ()

    @property
    def middle(self) -> Array:
        """Middle of the position range [rad or m], shape (n,)."""
        return 0.5 * (self.position_low + self.position_high)

    @property
    def half_range(self) -> Array:
        """Half the position range [rad or m], shape (n,)."""
        return 0.5 * (self.position_high - self.position_low)

    def scaled(self, fraction: float) -> "MotionLimits":
        """A part of every limit, positions about the middle of their range."""
        return MotionLimits(
            self.middle - fraction * self.half_range,
            self.middle + fraction * self.half_range,
            fraction * self.velocity,
            fraction * self.acceleration,
            fraction * self.torque,
            self.assumed,
        )

    def usage(self, motion: MotionSamples) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration as parts of their limits, -1 to 1 within; (N, n) each."""
        place = (motion.position - self.middle) / self.half_range
        return place, motion.velocity / self.velocity, motion.acceleration / self.acceleration

    def random_states(self, count: int, rng: np.random.Generator) -> MotionSamples:
        """States anywhere within the limits."""
        place, speed, change = (rng.uniform(-1.0, 1.0, (count, len(self.velocity))) for _ in range(3))
        return MotionSamples(self.middle + self.half_range * place, self.velocity * speed, self.acceleration * change)


def motion_limits(robot: Robot) -> MotionLimits:
    """The limits of a robot's joints; where none is stated a careful default, named in `MotionLimits.assumed`."""
    assumed: list[str] = []
    low, high, velocity, acceleration, torque = (np.empty(robot.joint_count) for _ in range(5))
    for j, joint in enumerate(robot.joints):
        unit, limits = joint.type.unit, joint.limits
        reach = DEFAULT_RANGE[joint.type]
        low[j], high[j] = limits.position or (-reach, reach)
        velocity[j] = DEFAULT_SPEED[joint.type] if limits.velocity is None else limits.velocity
        acceleration[j] = DEFAULT_ACCELERATION[joint.type] if limits.acceleration is None else limits.acceleration
        torque[j] = np.inf if limits.torque is None else limits.torque
        if limits.position is None:
            assumed.append(f"{joint.name}: position assumed within ±{reach:.4g} {unit}")
        if limits.velocity is None:
            assumed.append(f"{joint.name}: velocity assumed up to {velocity[j]:.4g} {unit}/s")
        if limits.acceleration is None:
            assumed.append(f"{joint.name}: acceleration assumed up to {acceleration[j]:.4g} {unit}/s²")
    return MotionLimits(low, high, velocity, acceleration, torque, tuple(assumed))
