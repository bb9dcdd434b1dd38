"""An arm of emulated STS3215 servos in a process of its own, and the driver that is plugged into it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from emulator_process import EmulatorProcess
from feetech_bus import FeetechOrder, ServoSpecification
from hardware_emulated.dynamixel_bench import SLACK_S, WATCHDOG_S, limits
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.feetech.arm import FeetechArm

TORQUE_PER_PERMILLE = 0.01


@dataclass
class FeetechBench:
    """The emulator, and arms to plug into it."""

    emulator: EmulatorProcess
    count: int
    arms: list[FeetechArm] = field(default_factory=list)

    def arm(self) -> FeetechArm:
        port = self.emulator.order.port
        joints = [
            DriveJoint(f"joint{number}", {"servo_id": number, "port": port}, torque_per_unit=TORQUE_PER_PERMILLE)
            for number in range(1, self.count + 1)
        ]
        self.arms.append(FeetechArm(joints, slack_s=SLACK_S))
        return self.arms[-1]

    def enabled_arm(self, watchdog_s: float = WATCHDOG_S) -> FeetechArm:
        arm = self.arm()
        arm.connect()
        arm.enable(ControlMode.POSITION, limits(self.count), StopPolicy.HOLD, watchdog_s)
        return arm

    def clear(self) -> None:
        """Unplug every arm."""
        while self.arms:
            self.arms.pop().disconnect()

    def anew(self) -> "FeetechBench":
        """The same servos, as delivered."""
        self.clear()
        self.emulator.reset()
        return self

    @property
    def state(self) -> dict[str, Any]:
        return self.emulator.state


@contextmanager
def feetech_bench(folder: Path, count: int = 3, *, start: float = 0.2, **order: Any) -> Iterator[FeetechBench]:
    """An emulated arm of pendulums, all of them in the same place; the servos answer at once."""
    asked = FeetechOrder(
        servos=tuple(
            ServoSpecification(number, torque_per_permille=TORQUE_PER_PERMILLE, registers={"return_delay": 0})
            for number in range(1, count + 1)
        ),
        start=(start,) * count,
        port=str(folder / "port"),
        control=str(folder / "control"),
        trace=str(folder / "trace"),
        **order,
    )
    with EmulatorProcess(asked) as emulator:
        one = FeetechBench(emulator, count)
        try:
            yield one
        finally:
            one.clear()
