"""The simulated arm's physics as what the servos move."""

from numpy.typing import ArrayLike
from typing_extensions import override

from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope_sim.device.servo import InertiaSchedule
from tauscope_sim.dynamixel_bus.arm import ServoArm
from tauscope_sim.scenario import Scenario

BANDWIDTH = 40.0  # ω of the position loops [rad/s]

_TICKS_PER_INERTIA = 4


class PlantArm(ServoArm):
    """The arm of a robot file with what a scenario conceals, and position loops that were tuned to it.

    Goals come in steps, so the loops are soft, damp the joint's own speed, and have no integral, as servos are
    delivered: τ_j = H_jj (ω² (q_g − q)_j − 2 ω q̇_j) + g(q)_j, each joint for itself. A joint whose robot file states
    a position loop has that one instead: it droops under load, and back-EMF slows it.
    """

    def __init__(self, robot: Robot, scenario: Scenario, position: ArrayLike) -> None:
        """Place the arm at rest. `position`: (n,), where it stands [rad or m]."""
        self._plant = scenario.plant(robot)
        self._plant.place(position)
        super().__init__(self._plant.motor_motion)
        self._inertia = InertiaSchedule(robot, scenario.effects)
        self._loops = {j: loop for j, loop in enumerate(robot.actuators) if loop and loop.kind == "position"}
        self._age = 0

    @override
    def advance(self, torque: Array, duration_s: float) -> None:
        self._plant.advance(torque, duration_s)
        self.motion = self._plant.motor_motion

    @override
    def _track(self, error: Array) -> Array:
        position, velocity = self.motion
        if self._age == 0:
            matrix, _, load = self._inertia.at(position)
            self._own_inertia, self._load = matrix.diagonal().copy(), load.copy()
        self._age = (self._age + 1) % _TICKS_PER_INERTIA
        torque = self._own_inertia * (BANDWIDTH**2 * error - 2.0 * BANDWIDTH * velocity) + self._load
        for joint, loop in self._loops.items():
            torque[joint] = loop.torque(error[joint], velocity[joint])
        return torque
