"""A friction level that varies with position: an eccentric bearing, an oval one, a rail that is worn in its middle."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import JointType, Robot

TIMES_A_TURN = np.array([1.0, 2.0, 3.0])  # an eccentric bearing, an oval one, and one that three jaws hold
# k times the stroke of a linear axis: from what is bent a little up to three waves.
RADIANS_A_STROKE = np.array([1.0, 2.0, 4.0, 6.0, 9.0, 12.0, 15.0, 18.0])


@dataclass(frozen=True, eq=False)
class PositionDependentFriction(Effect):
    """τ = A(q̇) (a cos kq + b sin kq)."""

    has_step = True
    of_motion_and_step = True
    id = "position_dependent_friction"
    rank = 50
    arguments = frozenset({"position", "velocity"})
    equation = "tau = sgn(qd) (a cos kq + b sin kq)"
    meaning = "the friction level varies with the joint's position"
    remedy = "let the Coulomb level vary with the joint's position"
    code = "({c[0]} * cos({s[0]} * q) + {c[1]} * sin({s[0]} * q)) * {step}"
    revealing_motion = "the same positions under other loads and speeds"
    coefficients = (Coefficient("a", "{tau}"), Coefficient("b", "{tau}"))
    shapes = (Shape("k", "1/{q}", logarithmic=True),)

    turns: bool = True

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        return [cls._of_joint(context, joint) for joint in context.joints if context.moves(joint)]

    @classmethod
    def _of_joint(cls, context: ArmContext, joint: int) -> Effect:
        turns = context.robot.joints[joint].type is JointType.REVOLUTE
        stroke = float(context.highest[joint] - context.lowest[joint])
        waves = TIMES_A_TURN if turns else RADIANS_A_STROKE / stroke
        return cls(joint, waves[:, None], 0.8 * waves[:1], 1.2 * waves[-1:], turns=turns)

    def is_free(self, place: int) -> bool:
        return not self.turns

    def columns(self, signals: Signals, shapes: Array) -> Array:
        step, angle = signals.step[self.joint], shapes * signals.position[self.joint]
        return per_joint_columns(np.stack([step * np.cos(angle), step * np.sin(angle)], axis=1))

    def claim(self, found: Sizes, context: ArmContext) -> str:
        size = replace(found["a"], value=hypot(found["a"].value, found["b"].value))
        return f"friction varies by ±{size_text(size)} with position"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        a, b = coefficients
        return [{"amplitude": hypot(a, b), "order": shape[0], "phase": atan2(a, b)}]
