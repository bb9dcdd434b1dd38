"""An emulated STS3215 servo and its joint, and the order that starts an arm of them."""

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

from tauscope_sim.dynamixel_bus.emulator import ServoOrder


@dataclass(frozen=True)
class ServoSpecification:
    """One servo.

    `torque_per_permille`: joint torque of 1 ‰ of duty [Nm].
    `back_emf`: torque that back-EMF takes from it [Nm s/rad].
    `registers`: as they differ from a delivered servo's.
    """

    servo: int
    baud: int = 1_000_000
    torque_per_permille: float = 1.91e-3
    back_emf: float = 0.0
    direction: int = 1
    reduction: float = 1.0
    zero_count: int = 2048
    registers: dict[str, int] = field(default_factory=dict)

    @property
    def counts_per_radian(self) -> float:
        """Counts for one radian of the joint, signed."""
        return self.direction * self.reduction * 4096 / (2.0 * math.pi)


@dataclass(frozen=True, kw_only=True)
class FeetechOrder(ServoOrder[ServoSpecification]):
    """The arm and the clock are those of the other emulated servos."""

    specification: ClassVar[type] = ServoSpecification

    echoes: bool = False

    def make_bus(self) -> Any:
        from feetech_bus.bus import FeetechBus
        from feetech_bus.servo import FeetechServo

        return FeetechBus(list(map(FeetechServo, self.servos)), paced=not self.stepped, echoes=self.echoes)
