"""Servos, the arm that they move and a clock, and the orders that start them as a process."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

import numpy as np

from tauscope_sim.dynamixel_bus.arm import Pendulums, ServoArm
from tauscope_sim.dynamixel_bus.bus import EmulatedBus
from tauscope_sim.dynamixel_bus.control_memory import ServoSpecification
from tauscope_sim.dynamixel_bus.servo import EmulatedServo
from tauscope_sim.emulation.emulator import ALL_STEPS, STEP_S, Emulator, EmulatorOrder
from tauscope_sim.emulation.fault_kit import InjectedFault, TimedQueue

_Servo = TypeVar("_Servo")


class DynamixelEmulator(Emulator):
    """An arm of emulated servos on one bus; the instants are those of the caller's clock."""

    arm: ServoArm

    def __init__(self, bus: EmulatedBus, arm: ServoArm, now_s: float, *, latency_s: float = 0.0) -> None:
        """Everything at rest, on a stand until all servos had torque. `latency_s`: of an adapter, for answers [s]."""
        super().__init__(arm, now_s)
        self.bus = bus
        self.torque = np.zeros(len(bus.servos))
        self.servos = list(bus.servos.values())  # in the order of the joints
        self._bauds = {servo.specification.baud for servo in self.servos}
        self._latency_s = latency_s
        self._outgoing = TimedQueue[bytes]()
        self._look()

    def hears(self, baud: int) -> bool:
        """Whether a master that has set this baud rate is understood. `baud`: of the master's port [bit/s]."""
        return baud in self._bauds

    def receive(self, data: bytes, now_s: float) -> None:
        """Take bytes of the master, and answer with what is measured now, however long the machine stood still.

        They are heard before the device catches up with the clock: they may have waited while this process slept, and
        its sleep is no silence of the master.
        """
        instructions = self.bus.hear(data, now_s)
        self.advance_to(now_s, ALL_STEPS)
        for servo in self.servos:
            servo.sense(self.now_s, min(1.0, max(0.0, now_s - self.now_s) / STEP_S))
        for due_s, frame in self.bus.answer(instructions, now_s):
            self._outgoing.put(due_s + self._latency_s, frame)

    def due(self, now_s: float) -> bytes:
        """Bytes that have reached the master by now."""
        return b"".join(self._outgoing.take_due(now_s))

    @property
    def next_due_s(self) -> float:
        """When the next bytes reach the master; infinite where none are under way [s]."""
        return self._outgoing.next_s

    def describe(self) -> dict[str, Any]:
        """Where the arm is and what its servos do."""
        return super().describe() | {
            "torque": self.torque.tolist(),
            "enabled": [servo.has_torque for servo in self.servos],
            "latched": [servo.memory.is_latched for servo in self.servos],
            "commanded": [servo.is_commanded for servo in self.servos],
            "latched_at": [servo.latched_s for servo in self.servos],
            "error": [servo.hardware_error for servo in self.servos],
        }

    def get(self, device: int, place: str) -> int:
        """Value of an item."""
        return self.bus.servos[device].memory.get(place)

    def put(self, device: int, place: str, value: int) -> None:
        """Set an item."""
        self.bus.servos[device].memory.put(place, value)

    def _step(self) -> None:
        self._run_faults()
        position, _ = self.arm.motion
        demands = [
            servo.demand(float(place), self.now_s, STEP_S) for servo, place in zip(self.servos, position, strict=True)
        ]
        self.torque = self.arm.torque(demands)
        if self.arm.stands_on_stand:
            self.arm.stands_on_stand = not all(servo.has_torque for servo in self.servos)
        if not self.arm.stands_on_stand:
            self.arm.advance(self.torque, STEP_S)
        self._look()

    def _carry_out(self, fault: InjectedFault) -> None:
        self.bus.carry_out(fault, self.now_s)

    def _look(self) -> None:
        position, velocity = self.arm.motion
        for servo, *seen in zip(self.servos, position, velocity, self.torque, strict=True):
            servo.take_motion(*map(float, seen))


@dataclass(frozen=True, kw_only=True)
class ServoOrder(EmulatorOrder, Generic[_Servo]):
    """An arm of servos, whoever made them."""

    specification: ClassVar[type]

    servos: tuple[_Servo, ...]
    robot: str | None = None
    weight: float = 0.5  # m g l of the pendulums that they move where there is no robot file [Nm]
    paced: bool = True
    latency_s: float = 0.0  # latency of the adapter [s]

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

    def _arm(self) -> ServoArm:
        if self.robot is None:
            return Pendulums(self.start, weight=self.weight)
        # The physics take seconds to import; a test of the bus alone does without.
        from tauscope.robot import read_robot
        from tauscope_sim.dynamixel_bus.plant_arm import PlantArm
        from tauscope_sim.scenario_file import read_scenario

        robot = read_robot(Path(self.robot))
        return PlantArm(robot, read_scenario(self.scenario, robot), self.start)


@dataclass(frozen=True, kw_only=True)
class DynamixelOrder(ServoOrder[ServoSpecification]):
    """Dynamixel servos."""

    specification: ClassVar[type] = ServoSpecification

    fast_sync_read: bool = True

    def make_bus(self) -> EmulatedBus:
        """Servos with measurements of their own noise."""
        servos = [EmulatedServo(servo, seed=joint) for joint, servo in enumerate(self.servos)]
        return EmulatedBus(servos, fast_sync_read=self.fast_sync_read, paced=self.paced and not self.stepped)
