"""The bus of emulated servos: bytes of a master in, answers with the instants of their arrival out."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from feetech_bus.servo import ENCODER, HEAT, OVERLOAD, FeetechServo
from tauscope_sim.dynamixel_bus.bus import AnswerFaults
from tauscope_sim.emulation.fault_kit import FaultKind, FaultSchedule, InjectedFault

ALL = 0xFE
PING, READ, WRITE, SYNC_READ, SYNC_WRITE = 1, 2, 3, 0x82, 0x83

Delivery = tuple[float, bytes]


@dataclass(frozen=True)
class Instruction:
    """A frame of a master."""

    servo: int
    code: int
    parameters: bytes
    frame: bytes


class FeetechBus:
    """Servos on one line; an adapter that echoes returns every frame of the master before the answers."""

    def __init__(self, servos: Sequence[FeetechServo], *, paced: bool = True, echoes: bool = False) -> None:
        self.servos = {servo.servo: servo for servo in servos}
        self.schedule = FaultSchedule()
        self._paced, self._echoes = paced, echoes
        self._buffer = b""
        self._away_until_s = dict.fromkeys(self.servos, 0.0)
        self._answer_faults = {servo: AnswerFaults() for servo in self.servos}
        self._free_s = 0.0

    def hear(self, data: bytes, now_s: float) -> list[Instruction]:
        """Whole instructions."""
        self._buffer += data
        found: list[Instruction] = []
        while (start := self._buffer.find(b"\xff\xff")) >= 0:
            self._buffer = self._buffer[start:]
            if len(self._buffer) < 4 or len(self._buffer) < 4 + self._buffer[3]:
                break
            end = 4 + self._buffer[3]
            frame = self._buffer[:end]
            if end < 6 or frame[2] == 0xFF or (sum(frame[2:]) & 0xFF) != 0xFF:
                self._buffer = self._buffer[1:]
                continue
            found.append(Instruction(frame[2], frame[4], frame[5:-1], frame))
            self._buffer = self._buffer[end:]
        return found

    def answer(self, instructions: Iterable[Instruction], now_s: float) -> list[Delivery]:
        """Carry instructions out and answer them."""
        deliveries: list[Delivery] = []
        for instruction in instructions:
            end_s = max(now_s, self._free_s) + self._wire_s(len(instruction.frame))
            if self._echoes:
                deliveries.append((end_s, instruction.frame))
            answers = self._carry_out(instruction, end_s)
            self._free_s = max([end_s, *(due for due, _ in answers)])
            deliveries += answers
        return deliveries

    def run_faults(self, now_s: float) -> None:
        """Let the faults happen that are due."""
        self.schedule.run(now_s, lambda fault: self._fail(fault, now_s))

    def _fail(self, fault: InjectedFault, now_s: float) -> None:
        everybody = list(self.servos) if fault.kind is FaultKind.POWER_DIP else [fault.device]
        for number in everybody:
            servo = self.servos[number]
            match fault.kind:
                case FaultKind.SILENT:
                    self._away_until_s[number] = now_s + fault.seconds
                case FaultKind.RESET | FaultKind.POWER_DIP:
                    servo.restart()
                    self._away_until_s[number] = now_s + fault.seconds
                case FaultKind.OVER_TEMPERATURE:
                    servo.fail(HEAT)
                case FaultKind.OVERLOAD:
                    servo.fail(OVERLOAD)
                case FaultKind.ENCODER_JUMP:
                    servo.encoder_offset_counts += fault.counts
                    if not fault.counts:
                        servo.fail(ENCODER)
                case _:
                    self._answer_faults[number] = AnswerFaults(fault.kind, fault.count, fault.seconds)

    def _carry_out(self, instruction: Instruction, now_s: float) -> list[Delivery]:
        present = {key: servo for key, servo in self.servos.items() if now_s >= self._away_until_s[key]}
        chosen = list(present.values()) if instruction.servo == ALL else []
        if instruction.servo in present:
            chosen = [present[instruction.servo]]
        parameters = instruction.parameters
        if instruction.code == PING:
            return self._answers([(servo, b"") for servo in sorted(chosen, key=lambda one: one.servo)], now_s)
        if instruction.code == READ and instruction.servo != ALL:
            return self._answers([(servo, servo.memory.read(*parameters)) for servo in chosen], now_s)
        if instruction.code == WRITE:
            for servo in chosen:
                servo.write(parameters[0], parameters[1:])
            answering = [servo for servo in chosen if servo.memory.get("status_level") and instruction.servo != ALL]
            return self._answers([(servo, b"") for servo in answering], now_s)
        if instruction.code == SYNC_READ:
            address, length, *wanted = parameters
            return self._answers(
                [(present[key], present[key].memory.read(address, length)) for key in wanted if key in present], now_s
            )
        if instruction.code == SYNC_WRITE:
            address, length, rest = parameters[0], parameters[1], parameters[2:]
            for start in range(0, len(rest), length + 1):
                if (servo := present.get(rest[start])) is not None:
                    servo.write(address, rest[start + 1 : start + 1 + length])
        return []

    def _answers(self, parts: list[tuple[FeetechServo, bytes]], after_s: float) -> list[Delivery]:
        """Answers one after the other."""
        deliveries: list[Delivery] = []
        for servo, data in parts:
            body = bytes([servo.servo, len(data) + 2, servo.hardware_error]) + data
            frame = b"\xff\xff" + body + bytes([0xFF - sum(body) % 256])
            after_s += self._wire_s(len(frame)) + (servo.return_delay_s if self._paced else 0.0)
            deliveries += self._answer_faults[servo.servo].apply(frame, after_s)
        return deliveries

    def _wire_s(self, length: int) -> float:
        baud = min((servo.specification.baud for servo in self.servos.values()), default=1_000_000)
        return length * 10 / baud if self._paced else 0.0
