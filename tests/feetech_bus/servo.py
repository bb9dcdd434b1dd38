"""One emulated servo. Time is passed in; frames are its bus's matter.

Where the memory table leaves something open, the servo does the worst for a careless master: goals are stale after
power-up, and a goal switches torque on.
"""

from dataclasses import replace
from typing import ClassVar

from feetech_bus.memory import Memory
from feetech_bus.order import ServoSpecification
from tauscope_sim.dynamixel_bus.servo import RELEASED, Demand
from tauscope_sim.emulation.fault_kit import FaultKind

VOLTAGE, ENCODER, HEAT, CURRENT, OVERLOAD = 0x01, 0x02, 0x04, 0x08, 0x20

_TURN = 4096
_FASTEST = 1e9


class FeetechServo:
    """A servo on the bus and at its joint."""

    latched_s = None
    alarms: ClassVar[dict[FaultKind, int]] = {
        FaultKind.OVER_TEMPERATURE: HEAT,
        FaultKind.OVERLOAD: OVERLOAD,
        FaultKind.ENCODER_JUMP: ENCODER,
    }

    def __init__(self, specification: ServoSpecification) -> None:
        """Power up."""
        self.specification = specification
        self.memory = Memory(specification.servo, specification.registers)
        self.encoder_offset_counts = 0
        self._target: float | None = None
        self._is_on_the_way = False
        self._seen: list[tuple[float, float, float]] = []

    @property
    def servo(self) -> int:
        """ID."""
        return self.memory.get("id")

    @property
    def has_torque(self) -> bool:
        """Whether it drives or holds its joint."""
        return bool(self.memory.get("torque_enable"))

    @property
    def is_commanded(self) -> bool:
        """Whether it is on the way to a goal; these servos have no watchdog, and hold the last one."""
        return self.has_torque and self._is_on_the_way

    @property
    def hardware_error(self) -> int:
        """Alarms."""
        return self.memory.get("status")

    @property
    def return_delay_s(self) -> float:
        """How long it waits with an answer [s]."""
        return self.memory.get("return_delay") * 2e-6

    def write(self, address: int, data: bytes) -> None:
        """Write and do what that means."""
        had_torque = self.has_torque
        written = self.memory.write(address, data)
        if "goal_position" in written:
            self.memory.put("torque_enable", 1)
        if self.memory.get("status") & self.memory.get("unloading"):
            self.memory.put("torque_enable", 0)
        if self.has_torque != had_torque:
            self._target = None

    def restart(self) -> None:
        """Come back after a power dip."""
        self.memory.restart()
        self._target = None

    def fail(self, alarm: int) -> None:
        """State an alarm; the servo lets go where its unloading condition says so."""
        self.memory.put("status", self.memory.get("status") | alarm)
        if alarm == HEAT:
            self.memory.put("temperature", 90)
        if alarm & self.memory.get("unloading"):
            self.memory.put("torque_enable", 0)
            self._target = None

    def demand(self, position: float, now_s: float, duration_s: float) -> Demand:
        """Wanted of its joint for the next stretch of time."""
        memory = self.memory
        if not self.has_torque or memory.get("mode") != 0:
            return RELEASED
        specification = self.specification
        jump = self.encoder_offset_counts / specification.counts_per_radian
        goal = min(max(memory.get("goal_position"), memory.get("min_position")), memory.get("max_position"))
        wanted = (goal - specification.zero_count) / specification.counts_per_radian
        unit = 1 if memory.get("phase") & 4 else 50
        speed = abs(memory.get("goal_speed")) * unit / abs(specification.counts_per_radian) or _FASTEST
        target = position + jump if self._target is None else self._target
        self._target = target + max(-speed * duration_s, min(speed * duration_s, wanted - target))
        self._is_on_the_way = self._target != wanted
        cap = min(memory.get("torque_limit"), memory.get("max_torque")) * specification.torque_per_permille
        demand = Demand(tracks=True, position=self._target, cap=cap)
        return replace(demand, position=demand.position - jump)

    def take_motion(self, position: float, velocity: float, torque: float) -> None:
        """See the joint, and the torque that the servo exerts on it."""
        now = (position, velocity, torque)
        self._seen = [*(self._seen[-1:] or [now]), now]

    def sense(self, now_s: float, part: float = 1.0) -> None:
        """Show the present measurement: position, speed and load of one instant."""
        older, newer = self._seen[0], self._seen[-1]
        position, velocity, torque = ((1.0 - part) * old + part * new for old, new in zip(older, newer, strict=True))
        specification, memory = self.specification, self.memory
        counts = round(position * specification.counts_per_radian) + specification.zero_count
        unit = 1 if memory.get("phase") & 4 else 50
        memory.put("position", (counts + self.encoder_offset_counts) % _TURN)
        memory.put("speed", round(velocity * specification.counts_per_radian / unit))
        driven = torque + specification.back_emf * velocity  # the duty of the bridge, not the torque, is reported
        load = round(driven / specification.torque_per_permille) * specification.direction
        memory.put("load", max(-1000, min(1000, load)))
        memory.put("moving", int(abs(velocity) > 0.01))
