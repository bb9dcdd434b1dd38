"""The arm behind the drives, moved tick by tick, and the state at each tick that readings are taken from."""

import numpy as np
from numpy.typing import ArrayLike

from tauscope.robot.robot import Array, Robot
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.scenario import Scenario

LEAST_SHARE = 1e-3
"""A joint whose inertia is below this share of what it has elsewhere stands in line with its links: steep friction on
next to no inertia is no place to begin at."""

POSTURES = 200
REACH = 1.0  # postures are looked for within so much of zero [rad or m]


def resting_posture(robot: Robot) -> Array:
    """Zero, or the end of each range nearest to it, (n,) [rad or m]; elsewhere where a joint has next to no inertia."""
    ranges = np.array([joint.limits.position or (-np.inf, np.inf) for joint in robot.joints])
    nearest = np.clip(0.0, ranges[:, 0], ranges[:, 1])
    # the same arm stands at the same place every time
    near = np.random.default_rng(0).uniform(-REACH, REACH, (POSTURES, robot.joint_count))
    postures = np.vstack([nearest, np.clip(nearest + near, ranges[:, 0], ranges[:, 1])])
    bodies = RigidBodies(robot, np.zeros(robot.joint_count))
    inertia = np.array([_inertia(bodies, posture) for posture in postures])
    share = (inertia / inertia.max(axis=0)).min(axis=1)
    return nearest if share[0] >= LEAST_SHARE else postures[np.argmax(share)]


def _inertia(bodies: RigidBodies, posture: Array) -> Array:
    bodies.update(posture, np.zeros_like(posture))
    return bodies.mass_matrix().diagonal().copy()


# bandwidth of the drives' velocity estimate: turns the encoder's error into that of the velocity [rad/s]
VELOCITY_BANDWIDTH = 2.0 * np.pi * 20.0


class Mechanism:
    """Plant and sensors; an instant has one reading, however often it is asked for.

    Position and torque are what `Scenario.sensors` makes of them; the encoder's error gives velocity noise, by
    `VELOCITY_BANDWIDTH`. `start_position`: (n,), None: `resting_posture` [rad or m]; `tick_s`: between ticks [s].
    Raises RobotFileError, ScenarioError: no simulation of this arm.
    """

    def __init__(self, robot: Robot, scenario: Scenario, start_position: ArrayLike | None, tick_s: float) -> None:
        self._plant = scenario.plant(robot)
        self._start = resting_posture(robot) if start_position is None else np.array(start_position, dtype=np.float64)
        self._plant.place(self._start)
        self._sensors = scenario.sensors(robot)
        encoder_error = np.sqrt(np.square(scenario.position_noise_std) + np.square(scenario.encoder_step) / 12.0)
        self._velocity_std = VELOCITY_BANDWIDTH * np.broadcast_to(encoder_error, (robot.joint_count,))
        self._rng = np.random.default_rng([scenario.seed, 1])
        self._reading: tuple[Array, Array, Array] | None = None
        self._tick_s = tick_s
        self._zero = np.zeros(robot.joint_count)
        self._torque = self._zero
        self.true = self._plant.state  # where the arm really is
        self.rest(0)

    def reading(self) -> tuple[Array, Array, Array]:
        """Position, velocity and torque at the last tick as the drives report them, each (n,)."""
        if self._reading is None:
            time_s, position, velocity, torque = self._sample
            position, torque = self._sensors.measure(time_s, position, torque)
            if self._velocity_std.any():
                velocity = velocity + self._velocity_std * self._rng.standard_normal(len(velocity))
            self._reading = position, velocity, torque
        return self._reading

    def move(self, torque: Array, tick: int) -> None:
        """Take the reading of a tick, its torque the mean of before and after it, then let the arm move until the next.

        Raises ScenarioError beyond all bounds; the arm is at rest then. `torque`: (n,), of the drives from now on [Nm
        or N].
        """
        self._take(0.5 * (self._torque + torque), tick)
        self._torque = torque
        try:
            self._plant.advance(torque, self._tick_s)
        except BaseException:
            self._plant.place(self.true.motor_position)
            raise
        finally:
            self.true = self._plant.state

    def put_back(self, tick: int) -> None:
        """Carry the arm back to where it began, with all that it conceals as when new."""
        self._plant.place(self._start)
        self.true = self._plant.state
        self.rest(tick)

    def rest(self, tick: int) -> None:
        """Take the reading of an arm in its brakes."""
        self._torque = self._zero
        self._take(self._zero, tick)

    def _take(self, torque: Array, tick: int) -> None:
        """Keep what the next reading is taken from: instant [s], position, velocity and torque of the motors."""
        self._sample = tick * self._tick_s, self.true.motor_position, self.true.motor_velocity, torque
        self._reading = None
