"""The order that starts an emulator process, as JSON."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, cast

from feetech_bus.bus import FeetechBus
from feetech_bus.servo import FeetechServo
from feetech_bus.specification import ServoSpecification
from tauscope_sim.dynamixel_bus.arm import MovedArm, Pendulums
from tauscope_sim.dynamixel_bus.emulator import DynamixelEmulator
from tauscope_sim.emulation.server import PseudoTerminal


@dataclass(frozen=True)
class FeetechOrder:
    """What to emulate.

    `start`: where the joints stand [rad].
    """

    module: ClassVar[str] = "feetech_bus"

    servos: tuple[ServoSpecification, ...]
    start: tuple[float, ...]
    port: str
    control: str
    robot: str | None = None
    weight: float = 0.5
    echoes: bool = False
    latency_s: float = 0.0
    stepped: bool = False
    trace: str | None = None

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "FeetechOrder":
        document = json.loads(text)
        servos = tuple(ServoSpecification(**servo) for servo in document.pop("servos"))
        return FeetechOrder(servos=servos, **{**document, "start": tuple(document["start"])})

    def open_port(self) -> PseudoTerminal:
        return PseudoTerminal(self.port)

    def build(self, now_s: float) -> DynamixelEmulator:
        """The arm and the clock are those of the other emulated servos."""
        servos = [FeetechServo(servo) for servo in self.servos]
        bus = FeetechBus(servos, paced=not self.stepped, echoes=self.echoes)
        identifiers = [servo.servo for servo in servos]
        return DynamixelEmulator(cast(Any, bus), identifiers, self._arm(), now_s, latency_s=self.latency_s)

    def _arm(self) -> MovedArm:
        if self.robot is None:
            return Pendulums(self.start, weight=self.weight)
        from tauscope.robot import read_robot
        from tauscope_sim.dynamixel_bus.plant_arm import PlantArm
        from tauscope_sim.scenario import Scenario

        return PlantArm(read_robot(Path(self.robot)), Scenario(), self.start)
