"""Reflected inertia of the motor, on its own joint alone."""

from collections.abc import Sequence

from tauscope.effects.context import Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, per_joint_columns
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class RotorInertia(Effect):
    """τ = I_a q̈."""

    of_motion_alone = True
    is_expected = True
    id = "rotor_inertia"
    rank = 140
    german = "Rotorträgheit"
    arguments = frozenset({"acceleration"})
    equation = "tau = I_a qdd"
    meaning = "the motor's reflected inertia is left out"
    remedy = "add the armature inertia to the joint"
    no_code = "it needs the acceleration"
    revealing_motion = "fast motion of the joint in other poses of the joints beyond it"
    coefficients = (Coefficient("I_a", "{tau} s^2/{q}", positive=True),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """q̈."""
        return per_joint_columns(signals.acceleration[self.joint][None, None])

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """One inertia."""
        return [{"inertia": coefficients[0]}]
