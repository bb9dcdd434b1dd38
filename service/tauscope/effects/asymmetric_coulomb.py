"""Coulomb friction that differs with the direction of motion: a worn screw, a preloaded gear."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class AsymmetricCoulomb(Effect):
    """τ = a |A(q̇)|: Coulomb friction is larger by a one way and smaller by a the other."""

    has_step = True
    of_motion_and_step = True
    id = "asymmetric_coulomb"
    rank = 10
    arguments = frozenset({"velocity"})
    equation = "tau = a |sgn(qd)|, sgn smoothed: Coulomb friction F_c + a forwards, F_c - a backwards"
    meaning = "Coulomb friction differs with the direction of motion"
    remedy = "use a Coulomb level for each direction"
    code = "{c[0]} * fabs({step})"
    revealing_motion = "slow oscillation with many reversals, so that rest differs from sliding"
    coefficients = (Coefficient("a", "{tau}"),)
    friction: ClassVar[str] = "Coulomb"
    plain: ClassVar[tuple[str, str]] = ("coulomb_friction", "level")  # the same both ways: its effect, and its key

    @classmethod
    def can_act(cls, context: ArmContext, joint: int) -> bool:
        return context.reverses(joint)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(np.abs(signals.step[self.joint])[None, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        half = found[self.coefficients[0].name]
        larger, smaller = ("positive", "negative") if half.value >= 0.0 else ("negative", "positive")
        size = replace(half, value=2.0 * half.value)
        return f"{self.friction} friction is {size_text(size)} larger in {larger} than in {smaller} direction"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """Twice the amplitude in one direction, and that much less friction in both."""
        (half,), (effect, key) = coefficients, self.plain
        return [{"amplitude": 2.0 * half}, {"effect": effect, key: -half}]
