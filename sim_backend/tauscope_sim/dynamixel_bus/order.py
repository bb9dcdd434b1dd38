"""The order that starts an emulator process, as JSON."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import ClassVar

from tauscope_sim.dynamixel_bus.arm import MovedArm, Pendulums
from tauscope_sim.dynamixel_bus.bus import EmulatedBus
from tauscope_sim.dynamixel_bus.control_memory import ServoSpecification
from tauscope_sim.dynamixel_bus.emulator import DynamixelEmulator
from tauscope_sim.dynamixel_bus.servo import EmulatedServo
from tauscope_sim.emulation.server import PseudoTerminal


@dataclass(frozen=True)
class DynamixelOrder:
    """What to emulate.

    `start`: where the joints stand [rad or m].
    `weight`: m g l of the pendulums [Nm].
    `latency_s`: latency of the adapter [s].
    """

    module: ClassVar[str] = "tauscope_sim.dynamixel_bus"

    servos: tuple[ServoSpecification, ...]
    start: tuple[float, ...]
    port: str
    control: str
    robot: str | None = None
    scenario: str | None = None
    weight: float = 0.5
    fast_sync_read: bool = True
    paced: bool = True
    latency_s: float = 0.0
    stepped: bool = False
    trace: str | None = None

    def to_json(self) -> str:
        """The order as text."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "DynamixelOrder":
        """The order in a text."""
        document = json.loads(text)
        servos = tuple(ServoSpecification(**servo) for servo in document.pop("servos"))
        return DynamixelOrder(servos=servos, **{**document, "start": tuple(document["start"])})

    def open_port(self) -> PseudoTerminal:
        """A pseudo terminal."""
        return PseudoTerminal(self.port)

    def build(self, now_s: float) -> DynamixelEmulator:
        """The emulator. `now_s`: present instant [s]."""
        arm = self._arm()
        servos = [EmulatedServo(servo, seed=joint) for joint, servo in enumerate(self.servos)]
        bus = EmulatedBus(servos, fast_sync_read=self.fast_sync_read, paced=self.paced and not self.stepped)
        return DynamixelEmulator(bus, [servo.servo for servo in servos], arm, now_s, latency_s=self.latency_s)

    def _arm(self) -> MovedArm:
        """What the servos move."""
        if self.robot is None:
            return Pendulums(self.start, weight=self.weight)
        # The physics take seconds to import; a test of the bus alone does without.
        from tauscope.robot import read_robot
        from tauscope_sim.dynamixel_bus.plant_arm import PlantArm
        from tauscope_sim.scenario import Scenario
        from tauscope_sim.scenario_file import read_scenario

        robot = read_robot(Path(self.robot))
        scenario = Scenario() if self.scenario is None else read_scenario(Path(self.scenario), robot)
        return PlantArm(robot, scenario, self.start)
