"""What a simulated arm conceals: effects, noise and delays, as a scenario file states them."""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tauscope.robot.robot import Array, Robot
from tauscope_sim.effects import Effect, SensorEffect
from tauscope_sim.plant import Plant
from tauscope_sim.plant.plant import STEP


@dataclass(frozen=True, eq=False)
class Scenario:
    """What differs from the robot file, and how well the sensors see it; ``Scenario()`` conceals nothing.

    `torque_noise_std`: (n,) or (), standard deviation of the recorded torque's white noise [Nm or N].
    `encoder_step`: (n,) or (), resolution to which positions are recorded, zero for none [rad or m].
    """

    effects: tuple[Effect, ...] = ()
    sensor_effects: tuple[SensorEffect, ...] = ()
    torque_noise_std: Array = field(default_factory=partial(np.zeros, ()))
    position_noise_std: Array = field(
        default_factory=partial(np.zeros, ())
    )  # (n,) or (), of the recorded position's [rad or m]
    encoder_step: Array = field(default_factory=partial(np.zeros, ()))
    command_latency_s: float = 0.0  # time from a setpoint's arrival to its effect [s]
    seed: int = 0

    def plant(self, robot: Robot, *, step_s: float = STEP) -> Plant:
        """Forward physics with the concealed effects; raises as `Plant` does. `step_s`: longest step [s]."""
        for effect in self.effects:
            effect.check(robot)
        return Plant(robot, self.effects, step_s=step_s)

    def sensors(self, robot: Robot, rng: np.random.Generator | None = None) -> "Sensors":
        """The sensors, at the beginning of a recording. Raises ScenarioError where an effect contradicts the robot."""
        for effect in self.sensor_effects:
            effect.check(robot)
        return Sensors(self, robot.joint_count, np.random.default_rng(self.seed) if rng is None else rng)


def quantise(position: Array, step: Array) -> Array:
    """The nearest multiples of a resolution. `position`: (n,) or (N, n); `step`: (n,), zero for none [rad or m]."""
    coarse = np.where(step > 0.0, step, 1.0)
    return np.where(step > 0.0, np.rint(position / coarse) * coarse, position)


class Sensors:
    """What a recording shows of the arm, sample by sample; causal, so that a control loop can use it."""

    def __init__(self, scenario: Scenario, joint_count: int, rng: np.random.Generator) -> None:
        self._channels = [effect.channel(joint_count) for effect in scenario.sensor_effects]
        shape = (joint_count,)
        self._torque_std = np.broadcast_to(scenario.torque_noise_std, shape)
        self._position_std = np.broadcast_to(scenario.position_noise_std, shape)
        self._step = np.broadcast_to(scenario.encoder_step, shape)
        self._rng = rng

    def measure(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        """What is recorded at `time` [s] of true `position` [rad or m] and `torque` [Nm or N], (n,), in order."""
        for channel in self._channels:
            position, torque = channel.pass_on(time, position, torque)
        noise = self._rng.standard_normal((2, len(position)))
        recorded = quantise(position + self._position_std * noise[0], self._step)
        return recorded, torque + self._torque_std * noise[1]
