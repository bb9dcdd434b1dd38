"""The arm behind the drives, moved tick by tick, and the state at each tick that readings are taken from."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.device.posture import resting_posture
from tauscope_sim.device.readings import Readings, Sample
from tauscope_sim.scenario import Scenario

Array = NDArray[np.float64]


class Mechanism:
    """Plant and sensors.

    Parameters
    ----------
    start_position : (n,) float64 or None
        where the arm stands; None is `resting_posture` [rad or m]
    tick_s : float
        time between two ticks [s]

    Raises
    ------
    RobotFileError
        where the robot file lacks what a simulation needs
    ScenarioError
        where the scenario does not fit the arm
    """

    def __init__(self, robot: Robot, scenario: Scenario, start_position: ArrayLike | None, tick_s: float) -> None:
        self._plant = scenario.plant(robot)
        self._start = resting_posture(robot) if start_position is None else np.array(start_position, dtype=np.float64)
        self._plant.place(self._start)
        self._readings = Readings(scenario, robot)
        self._tick_s = tick_s
        self._zero = np.zeros(robot.joint_count)
        self._torque = self._zero
        self.true = self._plant.state
        """where the arm really is"""
        self.rest(0)

    def reading(self) -> tuple[Array, Array, Array]:
        """Position, velocity and torque at the last tick as the drives report them, each (n,)."""
        return self._readings.of(self._sample)

    def move(self, torque: Array, tick: int) -> None:
        """Take the reading of a tick, then let the arm move until the next.

        The torque of a reading is the mean of those before and after the tick, which belongs to the tick's own instant.
        Raises ScenarioError where the motion grows beyond all bounds; the arm is at rest then.

        Parameters
        ----------
        torque : (n,) float64
            of the drives from this tick on [Nm or N]
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
        """Keep what a reading will be made of."""
        self._sample = Sample(tick * self._tick_s, self.true.motor_position, self.true.motor_velocity, torque)
