"""Reflected inertia of the motor, on its own joint alone."""

from collections.abc import Sequence

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class RotorInertia(Effect):
    """τ = I_a q̈."""

    of_motion_alone = True
    is_expected = True
    id = "rotor_inertia"
    rank = 140
    arguments = frozenset({"acceleration"})
    equation = "tau = I_a qdd"
    meaning = "the motor's reflected inertia is left out"
    remedy = "add the armature inertia to the joint"
    no_code = "it needs the acceleration"
    revealing_motion = "fast motion of the joint in other poses of the joints beyond it"
    coefficients = (Coefficient("I_a", "{tau} s^2/{q}", positive=True),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(signals.acceleration[self.joint][None, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        state = "missing" if found["I_a"].value >= 0.0 else "too much"
        return f"a rotor inertia of {size_text(found['I_a'])} is {state}"

    def advice(self, found: Sizes) -> str:
        return self.remedy if found["I_a"].value >= 0.0 else "lower the joint's armature inertia"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"inertia": coefficients[0]}]
