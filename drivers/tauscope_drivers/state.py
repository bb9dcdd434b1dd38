"""What passes between a control loop and an arm in each cycle."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.errors import Fault

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ArmState:
    """What the arm's drives measured in one cycle, in joint units; NaN, never the value before, where none came.

    `effort`: (n,), as `Capabilities.effort_unit` says. `late_ns`: how much later than the bus takes the answers came:
    the instant is not known any better [ns].
    """

    time_ns: int  # instant of the reading by the backend's clock [ns]
    position: Array  # (n,), q [rad or m]
    velocity: Array  # (n,), q̇ as the drive reports it, NaN where it reports none [rad/s or m/s]
    effort: Array
    temperature: Array  # (n,), of the motor, NaN where it is not reported [°C]
    enabled: NDArray[np.bool_]  # (n,), whether the joint's drive holds or drives the joint
    faults: tuple[Fault, ...] = ()
    late_ns: int = 0
    voltage: Array | None = None  # (n,) or None, supply of the drive's bridge; None where the drives report none [V]

    @staticmethod
    def unknown(time_ns: int, joint_count: int, faults: tuple[Fault, ...] = ()) -> "ArmState":
        """The state of an arm that nobody is connected to."""
        nothing = np.full(joint_count, np.nan)
        return ArmState(time_ns, nothing, nothing, nothing, nothing, np.zeros(joint_count, dtype=np.bool_), faults)

    @property
    def fresh(self) -> NDArray[np.bool_]:
        """Whether each joint's position was received in this cycle, shape (n,)."""
        return np.isfinite(self.position)


@dataclass(frozen=True, eq=False)
class Setpoint:
    """What the drives shall do until the next cycle, in joint units; which field counts is the control mode's matter.

    `torque`: (n,), target torque in `ControlMode.TORQUE`; feed-forward in `ControlMode.POSITION` where the backend
        takes one, else unused [Nm or N].
    """

    position: Array  # (n,), target position in `ControlMode.POSITION` [rad or m]
    torque: Array
