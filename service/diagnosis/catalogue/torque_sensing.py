"""What is wrong with the size of the recorded torque: scaled, or compressed at high load."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, Quantity, Shape, per_joint_columns
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array

COMPRESSIONS = np.array([0.3, 0.5, 0.8, 1.3, 2.2, 4.0])
"""Levels of a soft curve looked at, relative to the largest torque."""

CLIPS = np.array([0.3, 0.45, 0.6, 0.7, 0.8, 0.9])
"""Levels of a hard one."""


class TorqueGainError(Effect):
    """τ_recorded = (1 + g) τ."""

    id: ClassVar[str] = "torque_gain_error"
    equation: ClassVar[str] = "tau_recorded = (1 + g) tau"
    meaning: ClassVar[str] = "the recorded torque is scaled: the torque constant is wrong"
    remedy: ClassVar[str] = "correct the joint's torque_constant by 1 + g"
    revealing_motion: ClassVar[str] = "fast motion of neighbouring joints that share inertia, or a known added mass"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("g", "1"),)
    swallows: ClassVar[bool] = True

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        return [cls(joint) for joint in setting.joints]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """The model's torque.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(signals.torque[self.joint][None, None])


@dataclass(frozen=True, eq=False)
class TorqueSaturation(Effect):
    """τ_recorded = τ - a (τ - c tanh(τ/c)), or τ - a (τ - clip(τ, ±c)); a is 1 where nothing else bends the curve.

    clips : bool
        whether the torque is clipped rather than compressed
    """

    id: ClassVar[str] = "torque_saturation"
    equation: ClassVar[str] = "tau_recorded = tau - a (tau - c tanh(tau/c)); clipped: tau - a (tau - clip(tau, +-c))"
    meaning: ClassVar[str] = "the recorded torque is compressed or clipped at high load"
    remedy: ClassVar[str] = "record within the sensor's or the drive's linear range"
    revealing_motion: ClassVar[str] = "the same motion slower and without payload, well below the level"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("a", "1", positive=True, largest=2.0),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("c", "{tau}", logarithmic=True),)
    swallows: ClassVar[bool] = True

    clips: bool = False

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """Both curves at every joint.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        made = []
        for joint in setting.joints:
            for clips, parts in ((False, COMPRESSIONS), (True, CLIPS)):
                levels = parts * float(setting.top_torque[joint])
                made.append(cls(joint, levels[:, None], 0.7 * levels[:1], 1.5 * levels[-1:], clips=clips))
        return made

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """What the recorded torque falls short by.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            c [Nm or N]
        """
        torque = signals.torque[self.joint]
        recorded = np.clip(torque, -shapes, shapes) if self.clips else shapes * np.tanh(torque / shapes)
        return per_joint_columns((recorded - torque)[:, None])

    def quantities(
        self, setting: Setting, coefficients: Array, shape: Array, covariance: Array
    ) -> tuple[Quantity, ...]:
        """The level alone where a soft curve is only bent a little: then no data tell a and c apart, but c/√a.

        Parameters
        ----------
        setting : Setting
            the arm
        coefficients : (1,) float64
            a
        shape : (1,) float64
            c [Nm or N]
        covariance : (2, 2) float64
            of both
        """
        if self.clips:
            return super().quantities(setting, coefficients, shape, covariance)
        share, level = max(float(coefficients[0]), 1e-12), float(shape[0])
        slope = np.array([-0.5 * level / share**1.5, 1.0 / np.sqrt(share)])
        std = float(np.sqrt(max(slope @ covariance @ slope, 0.0)))
        return (Quantity("c", level / np.sqrt(share), std, self.unit("{tau}", setting)),)
