"""Transmissions that give way: elastic joints, and gears with play."""

import math
from typing import ClassVar

from tauscope.robot.document_fields import Positive
from tauscope_sim.effects.effect import JointEffect, NotNegative
from tauscope_sim.plant.term import Transmission


class JointElasticity(JointEffect):
    """T = K (θ - q) + D (θ̇ - q̇)."""

    effect_id: ClassVar[str] = "joint_elasticity"
    stiffness: Positive  # K [Nm/rad or N/m]
    damping: NotNegative = 0.0  # D [Nm s/rad or N s/m]
    rotor_inertia: Positive  # J [kg m² or kg]

    def transmission(self) -> Transmission:
        return self

    def torque(self, twist: float, twist_rate: float) -> float:
        return self.stiffness * twist + self.damping * twist_rate

    def torque_slopes(self, twist: float, twist_rate: float) -> tuple[float, float]:
        return self.stiffness, self.damping

    def twist_at_rest(self, torque: float) -> float:
        return torque / self.stiffness


class Backlash(JointEffect):
    """T = k x max(0, 1 + c sgn(x) δ̇) beyond a dead zone."""

    effect_id: ClassVar[str] = "backlash"
    gap: Positive  # b, total lost motion [rad or m]
    contact_stiffness: Positive  # k, of teeth and transmission together [Nm/rad or N/m]
    contact_damping: NotNegative = 10.0  # c [s/rad or s/m]
    rotor_inertia: Positive  # reflected inertia of the motor [kg m² or kg]

    def transmission(self) -> Transmission:
        return self

    def torque(self, twist: float, twist_rate: float) -> float:
        overlap = abs(twist) - 0.5 * self.gap
        if overlap <= 0.0:
            return 0.0
        return math.copysign(self.contact_stiffness * overlap * self._damping(twist, twist_rate), twist)

    def torque_slopes(self, twist: float, twist_rate: float) -> tuple[float, float]:
        overlap = abs(twist) - 0.5 * self.gap
        damping = self._damping(twist, twist_rate)
        if overlap <= 0.0 or damping == 0.0:
            return 0.0, 0.0
        return self.contact_stiffness * damping, self.contact_stiffness * overlap * self.contact_damping

    def twist_at_rest(self, torque: float) -> float:
        return math.copysign(0.5 * self.gap, torque) + torque / self.contact_stiffness if torque else 0.0

    def _damping(self, twist: float, twist_rate: float) -> float:
        """Factor max(0, 1 + c sgn(δ) δ̇)."""
        return max(0.0, 1.0 + self.contact_damping * math.copysign(twist_rate, twist * twist_rate))
