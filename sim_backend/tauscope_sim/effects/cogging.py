"""Torque periodic in motor or joint angle, whatever the load: τ = Σ a_i sin(k_i q' + φ_i), a_i in Nm (N)."""

from typing import ClassVar

from tauscope.robot.robot import Robot
from tauscope_sim.effects.angle_harmonics import AngleHarmonics
from tauscope_sim.effects.joint_law import JointLaw, Law


class Cogging(AngleHarmonics, JointLaw):
    """τ = Σ a_i sin(k_i q' + φ_i).

    joint : int
        its number, counted from 1
    amplitude : list of float
        a_i, a number or one an order [Nm or N]
    phase : list of float
        φ_i, a number or one an order [rad]
    """

    effect_id: ClassVar[str] = "cogging"

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        sine, slope = self.sine_and_slope(robot)
        return (lambda q, v: sine(q)), (lambda q, v: (slope(q), 0.0))
