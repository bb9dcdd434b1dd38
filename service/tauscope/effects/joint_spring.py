"""Elastic torque linear in the joint's own angle: a spring, a counterbalance."""

from collections.abc import Sequence

from tauscope.effects.context import Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, per_joint_columns
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class JointSpring(Effect):
    """τ = k (q - q_0), k < 0 where a counterbalance pushes away; the constant is in the nominal model's offset.

    What a counterbalance carries the motor need not: its torque may well be more than was measured.
    """

    of_motion_alone = True
    may_exceed_measured = True
    has_constant = True
    id = "joint_spring"
    rank = 180
    german = "Gelenkfeder"
    arguments = frozenset({"position"})
    equation = "tau = k (q - q_0)"
    meaning = "an elastic torque grows linearly with the angle"
    remedy = "add a spring to the joint"
    code = "{c[0]} * q"
    revealing_motion = "the joint's whole range, in several poses of the other joints"
    coefficients = (Coefficient("k", "{tau}/{q}"),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """The angle."""
        return per_joint_columns(signals.position[self.joint][None, None])

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """One stiffness."""
        return [{"stiffness": coefficients[0]}]
