"""A sum of sines of a joint's angle, for torque that is periodic in it: s(q) = Σ a_i sin(k_i q + φ_i)."""

import math
from collections.abc import Callable
from typing import Annotated

from pydantic import Field

from tauscope.robot.robot import Robot
from tauscope_sim.effects.effect import JointEffect
from tauscope_sim.effects.fields import Numbers, one_of, single_zero


class AngleHarmonics(JointEffect):
    """s(q) = Σ a_i sin(k_i q' + φ_i), with q' = q, or gear ratio × q where it is periodic in the motor's angle.

    joint : int
        its number, counted from 1
    phase : list of float
        φ_i, a number or one an order [rad]
    """

    amplitude: Numbers
    order: Numbers
    phase: Numbers = Field(default_factory=single_zero)
    angle: Annotated[str, one_of("joint", "motor")] = "joint"

    def check(self, robot: Robot) -> None:
        """Refuse lists that do not match, and a motor's angle without a gear ratio."""
        super().check(robot)
        for key in ("amplitude", "phase"):
            count = len(getattr(self, key))
            if count not in (1, len(self.order)):
                raise self.refused(
                    key, f"holds {count} numbers, order {len(self.order)}; give one each, or one for all"
                )
        if self.angle == "motor" and self.joint_of(robot).gear_ratio is None:
            raise self.refused("angle", "is motor, but the robot file states no gear_ratio for this joint; state it")

    def sine_and_slope(self, robot: Robot) -> tuple[Callable[[float], float], Callable[[float], float]]:
        """s(q) and ds/dq."""
        ratio = (self.joint_of(robot).gear_ratio or 1.0) if self.angle == "motor" else 1.0
        count = len(self.order)
        amplitude, phase = (value * count if len(value) == 1 else value for value in (self.amplitude, self.phase))
        parts = [(a, ratio * k, p) for a, k, p in zip(amplitude, self.order, phase, strict=True)]

        def sine(q: float) -> float:
            return sum(a * math.sin(k * q + p) for a, k, p in parts)

        def slope(q: float) -> float:
            return sum(a * k * math.cos(k * q + p) for a, k, p in parts)

        return sine, slope
