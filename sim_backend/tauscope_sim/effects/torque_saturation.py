"""Recorded torque compressed or clipped at high load.

``compression``: τ_recorded = c tanh(τ/c), for small τ τ - τ³/(3 c²); ``clip``: τ_recorded = min(max(τ, -c), c);
c in Nm (N). The arm feels the true torque.
"""

from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.document_fields import Positive
from tauscope_sim.effects.fields import JointNumber, one_of
from tauscope_sim.effects.sensor_effect import Channel, SensorEffect

Array = NDArray[np.float64]


class TorqueSaturation(SensorEffect):
    """τ_recorded = c tanh(τ/c), or τ clipped to ±c.

    joint : int
        its number, counted from 1
    level : float
        c [Nm or N]
    """

    effect_id: ClassVar[str] = "torque_saturation"
    joint: JointNumber
    level: Positive
    shape: Annotated[str, one_of("compression", "clip")] = "compression"

    def channel(self, joint_count: int) -> Channel:
        """The saturation."""
        return _Saturation(self.joint - 1, self.level, self.shape == "clip")


class _Saturation:
    """A bounded torque of one joint."""

    def __init__(self, joint: int, level: float, clip: bool) -> None:
        self._joint, self._level, self._clip = joint, level, clip

    def pass_on(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        """Bound the torque."""
        recorded, joint, level = torque.copy(), self._joint, self._level
        ratio = torque[joint] / level
        recorded[joint] = level * (np.clip(ratio, -1.0, 1.0) if self._clip else np.tanh(ratio))
        return position, recorded
