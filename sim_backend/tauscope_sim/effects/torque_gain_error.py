"""Recorded torque scaled, as by a wrong torque constant: τ_recorded = gain τ; a wrong sign is a gain of -1."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.document_fields import Nonzero
from tauscope_sim.effects.fields import JointNumber
from tauscope_sim.effects.sensor_effect import Channel, SensorEffect

Array = NDArray[np.float64]


class TorqueGainError(SensorEffect):
    """τ_recorded = gain τ.

    joint : int
        its number, counted from 1
    """

    effect_id: ClassVar[str] = "torque_gain_error"
    joint: JointNumber
    gain: Nonzero

    def channel(self, joint_count: int) -> Channel:
        """The scaling."""
        gains = np.ones(joint_count)
        gains[self.joint - 1] = self.gain
        return _Gain(gains)


class _Gain:
    """A factor a joint."""

    def __init__(self, gains: Array) -> None:
        self._gains = gains

    def pass_on(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        """Scale the torque."""
        return position, self._gains * torque
