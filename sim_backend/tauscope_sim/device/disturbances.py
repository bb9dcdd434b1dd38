"""The disturbances that tests inject, as they act on each joint at the present tick."""

import numpy as np
from numpy.typing import NDArray

from tauscope_sim.device.faults import Disturbance, Injection

Array = NDArray[np.float64]


class Disturbances:
    """What acts now."""

    def __init__(self, joint_count: int) -> None:
        self.slip: Array = np.zeros(joint_count)
        """slip of the encoders so far [rad or m]"""
        self.heat: Array = np.zeros(joint_count)
        """rise of the motors' temperature [K]"""
        self.lost: NDArray[np.bool_] = np.zeros(joint_count, dtype=np.bool_)
        """joints that do not answer"""
        self.overloaded: NDArray[np.bool_] = np.zeros(joint_count, dtype=np.bool_)
        """joints whose drive reports an overload"""
        self.any = False
        """whether anything was ever injected"""
        self._injections: list[Injection] = []

    @property
    def waiting(self) -> bool:
        """Whether there is anything that begins or ends yet."""
        return bool(self._injections)

    def add(self, injection: Injection) -> None:
        """Take note of a disturbance."""
        self.any = True
        self._injections.append(injection)

    def update(self, time_ns: int) -> None:
        """Renew what acts at an instant.

        Parameters
        ----------
        time_ns : int
            device time [ns]
        """
        if not self._injections:
            return
        for values in (self.heat, self.lost, self.overloaded):
            values[:] = 0
        for injection in [one for one in self._injections if one.active_at(time_ns)]:
            joint = injection.joint - 1
            if injection.kind is Disturbance.ENCODER_JUMP:
                self.slip[joint] += injection.size
                self._injections.remove(injection)
            elif injection.kind is Disturbance.OVER_TEMPERATURE:
                self.heat[joint] += injection.size
            elif injection.kind is Disturbance.LOST_SAMPLE:
                self.lost[joint] = True
            else:
                self.overloaded[joint] = True
        self._injections = [one for one in self._injections if not _over(one, time_ns)]


def _over(injection: Injection, time_ns: int) -> bool:
    """Whether it will never act again."""
    return injection.duration_ns is not None and time_ns >= injection.start_ns + injection.duration_ns
