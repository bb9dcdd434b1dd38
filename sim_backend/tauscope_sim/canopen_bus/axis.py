"""What passes between an emulated drive and the arm that it moves, in joint units."""

from dataclasses import dataclass
from enum import Enum


class AxisMode(Enum):
    """What a drive does to its joint."""

    RELEASED = "released"
    HOLDING = "holding"
    POSITION = "position"
    TORQUE = "torque"


@dataclass(frozen=True)
class AxisDemand:
    """What a drive wants of its joint until the next demand.

    `position`: target where the mode is position [rad or m].
    `torque`: target where the mode is torque [Nm or N].
    `torque_cap`: most that it exerts; nothing where it is released [Nm or N].
    `interpolation_s`: time in which it goes from one target to the next, where the mode is position; 0 where nobody
        told it [s].
    """

    mode: AxisMode
    position: float = 0.0
    torque: float = 0.0
    torque_cap: float = 0.0
    interpolation_s: float = 0.0


@dataclass(frozen=True)
class AxisMeasurement:
    """What a drive's sensors tell of its joint.

    `position`: [rad or m].
    `velocity`: [rad/s or m/s].
    `torque`: [Nm or N].
    """

    position: float
    velocity: float
    torque: float


@dataclass(frozen=True)
class AxisScale:
    """Counts and per mille of an emulated drive.

    `rated_torque_mnm`: object 0x6076, at the motor shaft [mNm].
    """

    counts_per_radian: float
    rated_torque_mnm: int
    gear_ratio: float

    @property
    def torque_per_permille(self) -> float:
        """Joint torque of one part in thousand of the rated torque [Nm or N]."""
        return self.rated_torque_mnm / 1e6 * self.gear_ratio
