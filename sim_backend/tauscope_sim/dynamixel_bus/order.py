"""The orders that start emulated servos on a serial bus."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar

from tauscope_sim.dynamixel_bus.arm import Pendulums
from tauscope_sim.dynamixel_bus.bus import EmulatedBus
from tauscope_sim.dynamixel_bus.control_memory import ServoSpecification
from tauscope_sim.dynamixel_bus.emulator import DynamixelEmulator
from tauscope_sim.dynamixel_bus.servo import EmulatedServo
from tauscope_sim.emulation.emulator import EmulatorOrder

if TYPE_CHECKING:
    from tauscope_sim.dynamixel_bus.plant_arm import PlantArm

_Servo = TypeVar("_Servo")


@dataclass(frozen=True)
class ServoOrder(EmulatorOrder, Generic[_Servo]):
    """An arm of servos, whoever made them.

    `start`: where the joints stand [rad or m].
    `weight`: m g l of the pendulums that they move where there is no robot file [Nm].
    `latency_s`: latency of the adapter [s].
    """

    specification: ClassVar[type]

    servos: tuple[_Servo, ...]
    start: tuple[float, ...]
    port: str
    control: str
    robot: str | None = None
    scenario: str | None = None
    weight: float = 0.5
    paced: bool = True
    latency_s: float = 0.0
    stepped: bool = False
    trace: str | None = None

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The order in a text."""
        order: Any = super().from_json(text)
        return replace(order, servos=tuple(cls.specification(**servo) for servo in order.servos))

    @abstractmethod
    def make_bus(self) -> EmulatedBus:
        """The servos on their bus."""

    def build(self, now_s: float) -> DynamixelEmulator:
        """The emulator."""
        return DynamixelEmulator(self.make_bus(), self._arm(), now_s, latency_s=self.latency_s)

    def _arm(self) -> "Pendulums | PlantArm":
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


@dataclass(frozen=True)
class DynamixelOrder(ServoOrder[ServoSpecification]):
    """Dynamixel servos."""

    specification: ClassVar[type] = ServoSpecification

    fast_sync_read: bool = True

    def make_bus(self) -> EmulatedBus:
        """Servos with measurements of their own noise."""
        servos = [EmulatedServo(servo, seed=joint) for joint, servo in enumerate(self.servos)]
        return EmulatedBus(servos, fast_sync_read=self.fast_sync_read, paced=self.paced and not self.stepped)
