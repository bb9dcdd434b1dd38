"""The plain terms that every identified model has: a constant, Coulomb and viscous friction.

They are estimated with the nominal model and never screened for. A finding they are where the *given* model lacks them:
the robot file's friction declares no constant at all, and a model block or a simulator may leave friction out.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from tauscope.dynamics import smooth_sign
from tauscope.effects.effect import Effect, per_joint_columns
from tauscope.effects.parameters import Coefficient, Shape
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.recording.recording import Array


class PlainTerm(Effect):
    """A term of the nominal model.

    `term` is its name there (`tauscope.identification.structure.JointTerms.names`).
    """

    term: ClassVar[str]
    screened: ClassVar[bool] = False

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves."""
        return [cls(joint) for joint in setting.joints if setting.moves(joint)]


class ViscousFriction(PlainTerm):
    """τ = c q̇."""

    id: ClassVar[str] = "viscous_friction"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity"})
    term: ClassVar[str] = "viscous"
    equation: ClassVar[str] = "tau = c qd"
    meaning: ClassVar[str] = "viscous friction is missing from the given model"
    remedy: ClassVar[str] = "add it to the joint's friction"
    revealing_motion: ClassVar[str] = "several speeds"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("c", "{tau} s/{q}", positive=True),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """q̇.

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(signals.velocity[self.joint][None, None])


class CoulombFriction(PlainTerm):
    """τ = f A(q̇)."""

    id: ClassVar[str] = "coulomb_friction"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity"})
    term: ClassVar[str] = "stiction"
    equation: ClassVar[str] = "tau = f sgn(qd)"
    meaning: ClassVar[str] = "Coulomb friction is missing from the given model"
    remedy: ClassVar[str] = "add it to the joint's friction"
    revealing_motion: ClassVar[str] = "slow motion both ways"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("f", "{tau}", positive=True),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """A(q̇).

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(signals.step[self.joint][None, None])


class TorqueOffset(PlainTerm):
    """τ = c."""

    id: ClassVar[str] = "torque_offset"
    arguments: ClassVar[frozenset[str] | None] = frozenset()
    term: ClassVar[str] = "offset"
    equation: ClassVar[str] = "tau = c"
    meaning: ClassVar[str] = "the torque has a constant part, which the robot file's friction does not declare"
    remedy: ClassVar[str] = "zero the torque sensor, or add the constant to the joint's torque"
    revealing_motion: ClassVar[str] = "slow motion both ways in several poses"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("c", "{tau}"),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """One.

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(np.ones_like(signals.position[self.joint])[None, None])


class StribeckTerm(PlainTerm):
    """τ = s A(δ q̇): what the nominal model has as the catalogue's Stribeck friction."""

    id: ClassVar[str] = "stribeck_friction"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity"})
    term: ClassVar[str] = "stribeck"
    equation: ClassVar[str] = "tau = s (2/pi) atan(delta qd)"
    meaning: ClassVar[str] = "a Stribeck term is missing from the given model"
    remedy: ClassVar[str] = "add it to the joint's friction"
    revealing_motion: ClassVar[str] = "slow sweeps beside motion at top speed"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("s", "{tau}"),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("delta", "s/{q}", fixed=True),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """A(δ q̇).

        Parameters
        ----------
        shapes : (g, 1) float64
            δ [s/rad or s/m]
        """
        return per_joint_columns(smooth_sign(signals.velocity[self.joint][None], shapes)[:, None])
