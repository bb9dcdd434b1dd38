"""What is wrong with the recorded torque itself: scaled, compressed at high load, or late."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, Shape, per_joint_columns
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array

LEVELS = np.array([0.0, 0.3, 0.5, 0.7, 0.8, 0.9])
"""Torque, relative to the largest, beyond which the recorded one falls short; at zero the cubic of a soft curve."""


class TorqueGainError(Effect):
    """τ_recorded = (1 + g) τ."""

    id: ClassVar[str] = "torque_gain_error"
    equation: ClassVar[str] = "tau_recorded = (1 + g) tau"
    meaning: ClassVar[str] = "the recorded torque is scaled: the torque constant is wrong"
    remedy: ClassVar[str] = "correct the joint's torque_constant by 1 + g"
    revealing_motion: ClassVar[str] = "fast motion of neighbouring joints that share inertia, or a known added mass"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("g", "1"),)

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


class TorqueSaturation(Effect):
    """τ_recorded = τ - c sgn(τ) max(|τ| - τ_0, 0), or - c τ|τ|² where τ_0 = 0."""

    id: ClassVar[str] = "torque_saturation"
    equation: ClassVar[str] = (
        "tau_recorded = tau - c sgn(tau) max(|tau| - tau_0, 0); - c tau |tau|^2 / tau_max^2 at tau_0 = 0"
    )
    meaning: ClassVar[str] = "the recorded torque is compressed or clipped at high load"
    remedy: ClassVar[str] = "record within the sensor's or the drive's linear range"
    revealing_motion: ClassVar[str] = "the same motion slower and without payload, well below the level"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("c", "1", positive=True, largest=1.0),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("tau_0", "{tau}", fixed=True),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        made = []
        for joint in setting.joints:
            top = float(setting.top_torque[joint])
            levels = LEVELS * top
            made.append(cls(joint, levels[:, None], np.zeros(1), np.array([top])))
        return made

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """What the recorded torque falls short by.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            τ_0 [Nm or N]
        """
        torque = signals.torque[self.joint]
        beyond = -np.sign(torque) * np.maximum(np.abs(torque) - shapes, 0.0)
        soft = -(torque**3) / self.upper[0] ** 2
        return per_joint_columns(np.where(shapes == 0.0, soft, beyond)[:, None])


class TimeDelay(Effect):
    """τ_recorded(t) = τ(t - d), to first order -d dτ/dt."""

    id: ClassVar[str] = "time_delay"
    equation: ClassVar[str] = "tau_recorded(t) = tau(t - d)"
    meaning: ClassVar[str] = "the torque channel is late against the positions (early where d is negative)"
    remedy: ClassVar[str] = "shift the torque channel by d"
    revealing_motion: ClassVar[str] = "fast motion with quick changes of torque"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("d", "s"),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """The whole arm, and every joint of an arm with several.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        joints = setting.joints if setting.robot.joint_count > 1 else ()
        return [cls(None), *(cls(joint) for joint in joints)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """-dτ/dt of the model's torque.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (1, 0) float64
            none
        """
        rate = -signals.derivative(signals.torque[list(self.touched(len(signals.torque)))])
        return rate[None, None]
