"""Viscous friction that differs with the direction of motion."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class AsymmetricViscous(Effect):
    """τ = b |q̇|: viscous friction is larger by b one way and smaller by b the other."""

    of_motion_alone = True
    id = "asymmetric_viscous"
    rank = 20
    arguments = frozenset({"velocity"})
    equation = "tau = b |qd|: viscous friction F_v + b forwards, F_v - b backwards"
    meaning = "viscous friction differs with the direction of motion"
    remedy = "use a viscous coefficient for each direction"
    code = "{c[0]} * fabs(v)"
    revealing_motion = "fast motion in both directions"
    coefficients = (Coefficient("b", "{tau} s/{q}"),)

    @classmethod
    def can_act(cls, context: ArmContext, joint: int) -> bool:
        return context.reverses(joint)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(np.abs(signals.velocity[self.joint])[None, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        larger, smaller = ("positive", "negative") if found["b"].value >= 0.0 else ("negative", "positive")
        size = replace(found["b"], value=2.0 * found["b"].value)
        return f"viscous friction is {size_text(size)} larger in {larger} than in {smaller} direction"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """Twice the amplitude in one direction, and that much less viscous friction in both."""
        (slope,) = coefficients
        return [{"amplitude": 2.0 * slope}, {"effect": "viscous_friction", "coefficient": -slope}]
