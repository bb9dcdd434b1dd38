"""Elastic torque linear in the joint's own angle: a spring, a counterbalance."""

from collections.abc import Sequence

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class JointSpring(Effect):
    """τ = k (q - q_0), k < 0 where a counterbalance pushes away; the constant is in the nominal model's offset.

    What a counterbalance carries the motor need not: its torque may well be more than was measured.
    """

    of_motion_alone = True
    has_constant = True
    id = "joint_spring"
    rank = 180
    arguments = frozenset({"position"})
    equation = "tau = k (q - q_0)"
    meaning = "an elastic torque grows linearly with the angle"
    remedy = "add a spring to the joint"
    code = "{c[0]} * q"
    revealing_motion = "the joint's whole range, in several poses of the other joints"
    coefficients = (Coefficient("k", "{tau}/{q}"),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(signals.position[self.joint][None, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """A spring, or a counterbalance where its stiffness is negative."""
        if found["k"].value < 0.0:
            return f"a counterbalance of {size_text(found['k'])} (a spring of negative stiffness) is missing"
        return f"a {size_text(found['k'])} spring is missing"

    def advice(self, found: Sizes) -> str:
        return self.remedy if found["k"].value >= 0.0 else "add a spring of negative stiffness to the joint"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"stiffness": coefficients[0]}]
