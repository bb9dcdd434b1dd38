"""What falsifies the recording and leaves the motion alone: effects of the sensors."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tauscope_sim.effects.effect import ScenarioEntry

Array = NDArray[np.float64]


class Channel(Protocol):
    """A sensor effect at work: it sees the samples in the order of time, and only those of the past."""

    def pass_on(self, time: float, position: Array, torque: Array) -> tuple[Array, Array]:
        """What is recorded in place of a sample.

        Parameters
        ----------
        time : float
            of the sample [s]
        position : (n,) float64
            [rad or m]
        torque : (n,) float64
            [Nm or N]

        Returns
        -------
        position : (n,) float64
            [rad or m]
        torque : (n,) float64
            [Nm or N]
        """
        ...


class SensorEffect(ScenarioEntry):
    """An effect between the arm and the recording."""

    def channel(self, joint_count: int) -> Channel:
        """The effect at work on an arm."""
        raise NotImplementedError
