"""The plain terms that every identified model has: a constant, Coulomb and viscous friction.

They are estimated with the nominal model and never screened for. A finding they are where the *given* model lacks them:
the robot file's friction declares no constant at all, and a model block or a simulator may leave friction out.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from tauscope.dynamics import smooth_sign
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class PlainTerm(Effect):
    """A term of the nominal model. `term` is its name there (`tauscope.identification.structure.JointTerms.names`)."""

    term: ClassVar[str]
    screened = False
    no_code = "the friction function beside it has it"
    no_scenario = "the improved robot file has it in the joint's friction"


class ViscousFriction(PlainTerm):
    """τ = c q̇."""

    id = "viscous_friction"
    rank = 270
    arguments = frozenset({"velocity"})
    term = "viscous"
    equation = "tau = c qd"
    meaning = "viscous friction is missing from the given model"
    remedy = "add it to the joint's friction"
    revealing_motion = "several speeds"
    coefficients = (Coefficient("c", "{tau} s/{q}", positive=True),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        state = "missing" if found["c"].value >= 0.0 else "too much"
        return f"viscous friction of {size_text(found['c'])} is {state}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(signals.velocity[self.joint][None, None])


class CoulombFriction(PlainTerm):
    """τ = f A(q̇)."""

    id = "coulomb_friction"
    rank = 260
    arguments = frozenset({"velocity"})
    term = "stiction"
    equation = "tau = f sgn(qd)"
    meaning = "Coulomb friction is missing from the given model"
    remedy = "add it to the joint's friction"
    revealing_motion = "slow motion both ways"
    coefficients = (Coefficient("f", "{tau}", positive=True),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        state = "missing" if found["f"].value >= 0.0 else "too much"
        return f"Coulomb friction of {size_text(found['f'])} is {state}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(signals.step[self.joint][None, None])


class TorqueOffset(PlainTerm):
    """τ = c."""

    id = "torque_offset"
    rank = 250
    arguments = frozenset()
    term = "offset"
    equation = "tau = c"
    meaning = "the torque has a constant part, which the robot file's friction does not declare"
    remedy = "zero the torque sensor, or add the constant to the joint's torque"
    revealing_motion = "slow motion both ways in several poses"
    coefficients = (Coefficient("c", "{tau}"),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        sign = "+" if found["c"].value >= 0.0 else "-"
        return f"the torque has an offset of {sign}{size_text(found['c'])}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(np.ones_like(signals.position[self.joint])[None, None])

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"torque": coefficients[0]}]


class StribeckTerm(PlainTerm):
    """τ = s A(δ q̇): what the nominal model has as the catalogue's Stribeck friction."""

    is_variant = True
    id = "stribeck_friction"
    arguments = frozenset({"velocity"})
    term = "stribeck"
    equation = "tau = s (2/pi) atan(delta qd)"
    meaning = "a Stribeck term is missing from the given model"
    remedy = "add it to the joint's friction"
    revealing_motion = "slow sweeps beside motion at top speed"
    coefficients = (Coefficient("s", "{tau}"),)
    shapes = (Shape("delta", "s/{q}", fixed=True),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """What is added at speed only makes friction fall towards zero velocity."""
        verb = "falls" if found["s"].value >= 0.0 else "rises"
        return f"friction {verb} by {size_text(found['s'])} towards zero velocity"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(smooth_sign(signals.velocity[self.joint][None], shapes)[:, None])
