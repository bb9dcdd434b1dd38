"""What the host is told of the arm: the scenario's sensors for position and torque, and the drives' own velocity."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.scenario import Scenario

Array = NDArray[np.float64]

VELOCITY_BANDWIDTH = 2.0 * np.pi * 20.0
"""Bandwidth of the drives' velocity estimate: turns the encoder's error into that of the velocity [rad/s]."""


@dataclass(frozen=True, eq=False)
class Sample:
    """The true state that one reading is taken from.

    time_s : float
        instant, by the plant's clock [s]
    position : (n,) float64
        of the motors, in joint units [rad or m]
    velocity : (n,) float64
        likewise [rad/s or m/s]
    torque : (n,) float64
        of the motors on the joint's side [Nm or N]
    """

    time_s: float
    position: Array
    velocity: Array
    torque: Array


class Readings:
    """Readings of one arm; an instant has one reading, however often it is asked for.

    Position and torque are what `Scenario.sensors` makes of them. Velocity is the drive's estimate: exact where the
    encoder is, else with white noise as large as the encoder's error times `VELOCITY_BANDWIDTH`.

    Raises
    ------
    ScenarioError
        where a sensor's effect contradicts the robot
    """

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        self._sensors = scenario.sensors(robot)
        encoder_error = np.sqrt(np.square(scenario.position_noise_std) + np.square(scenario.encoder_step) / 12.0)
        self._velocity_std = VELOCITY_BANDWIDTH * np.broadcast_to(encoder_error, (robot.joint_count,))
        self._noisy = bool(self._velocity_std.any())
        self._rng = np.random.default_rng([scenario.seed, 1])
        self._sample: Sample | None = None
        self._reading: tuple[Array, Array, Array] | None = None

    def of(self, sample: Sample) -> tuple[Array, Array, Array]:
        """Position, velocity and torque as the drives report them, each (n,)."""
        if self._reading is None or sample is not self._sample:
            position, torque = self._sensors.measure(sample.time_s, sample.position, sample.torque)
            velocity = sample.velocity
            if self._noisy:
                velocity = velocity + self._velocity_std * self._rng.standard_normal(len(velocity))
            self._sample, self._reading = sample, (position, velocity, torque)
        return self._reading
