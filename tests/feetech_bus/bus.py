"""The bus of emulated STS3215 servos: their frames; faults and clock are those of the other emulated servos."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from feetech_bus.servo import FeetechServo
from tauscope_sim.dynamixel_bus.bus import Delivery, EmulatedBus

ALL = 0xFE
PING, READ, WRITE, SYNC_READ, SYNC_WRITE = 1, 2, 3, 0x82, 0x83


@dataclass(frozen=True)
class Instruction:
    """A frame of a master."""

    servo: int
    code: int
    parameters: bytes
    frame: bytes

    @property
    def length(self) -> int:
        return len(self.frame)


class FeetechBus(EmulatedBus):
    """Servos on one line; an adapter that echoes returns every frame of the master before the answers."""

    def __init__(self, servos: Sequence[Any], *, paced: bool = True, echoes: bool = False) -> None:
        super().__init__(servos, paced=paced)
        self._echoes = echoes
        self._received = b""

    def hear(self, data: bytes, now_s: float) -> list[Any]:
        """Whole instructions."""
        self._received += data
        found: list[Instruction] = []
        while (start := self._received.find(b"\xff\xff")) >= 0:
            self._received = self._received[start:]
            if len(self._received) < 4 or len(self._received) < 4 + self._received[3]:
                break
            end = 4 + self._received[3]
            frame = self._received[:end]
            if end < 6 or frame[2] == 0xFF or (sum(frame[2:]) & 0xFF) != 0xFF:
                self._received = self._received[1:]
                continue
            found.append(Instruction(frame[2], frame[4], frame[5:-1], frame))
            self._received = self._received[end:]
        return found

    def _obey(self, instruction: Any, end_s: float) -> list[Delivery]:
        echo = [(end_s, instruction.frame)] if self._echoes else []
        return [*echo, *self._frames(self._carry_out_instruction(instruction, end_s), end_s)]

    def _carry_out_instruction(self, instruction: Instruction, now_s: float) -> list[tuple[FeetechServo, bytes]]:
        """Who answers, and with which data."""
        present: dict[int, Any] = {servo.servo: servo for servo in self._present(now_s)}
        chosen = [servo for key, servo in present.items() if instruction.servo in (key, ALL)]
        parameters = instruction.parameters
        if instruction.code == PING:
            return [(servo, b"") for servo in chosen]
        if instruction.code == READ and instruction.servo != ALL:
            return [(servo, servo.memory.read(*parameters)) for servo in chosen]
        if instruction.code == WRITE:
            for servo in chosen:
                servo.write(parameters[0], parameters[1:])
            return [(one, b"") for one in chosen if one.memory.get("status_level") and instruction.servo != ALL]
        if instruction.code == SYNC_READ:
            address, length, *wanted = parameters
            return [(present[key], present[key].memory.read(address, length)) for key in wanted if key in present]
        if instruction.code == SYNC_WRITE:
            address, length, rest = parameters[0], parameters[1], parameters[2:]
            for start in range(0, len(rest), length + 1):
                if (servo := present.get(rest[start])) is not None:
                    servo.write(address, rest[start + 1 : start + 1 + length])
        return []

    def _frames(self, parts: list[tuple[FeetechServo, bytes]], after_s: float) -> list[Delivery]:
        """Answers one after the other."""
        deliveries: list[Delivery] = []
        for servo, data in parts:
            body = bytes([servo.servo, len(data) + 2, servo.hardware_error]) + data
            frame = b"\xff\xff" + body + bytes([0xFF - sum(body) % 256])
            after_s += self._wire_s(len(frame)) + (servo.return_delay_s if self._paced else 0.0)
            deliveries += self._answer_faults[servo.servo].apply(frame, after_s)
        return deliveries
