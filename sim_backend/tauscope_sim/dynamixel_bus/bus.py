"""The bus of emulated servos: bytes of a master in, answers with the instants of their arrival out."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from dynamixel_sdk import Protocol2PacketHandler
from typing_extensions import override

from tauscope_drivers.serial_servos.bus import FrameParser
from tauscope_sim.dynamixel_bus.control_memory import WriteRefusedError
from tauscope_sim.dynamixel_bus.servo import EmulatedServo
from tauscope_sim.emulation.fault_kit import AnswerFaults, FaultKind, InjectedFault

BROADCAST_ID = 0xFE
_HEADER = b"\xff\xff\xfd\x00"
_STATUS = 0x55
_library = Protocol2PacketHandler()


@dataclass(frozen=True)
class Instruction:
    """What a master asks."""

    servo: int
    code: int
    parameters: bytes
    length: int  # of the frame on the wire [bytes]


def status_frame(servo: int, error: int, data: bytes) -> bytes:
    """A status packet with stuffing and checksum."""
    length = len(data) + 4
    packet = [*_HEADER, servo, length & 0xFF, length >> 8, _STATUS, error, *data, 0, 0]
    packet = _library.addStuffing(packet)
    crc = _library.updateCRC(0, packet, len(packet) - 2)
    return bytes(packet[:-2]) + crc.to_bytes(2, "little")


def fast_status_frame(answers: list[tuple[int, int, bytes]], servos: int, length: int) -> bytes:
    """The packet of a Fast Sync Read, cut off after the last answer, never stuffed. `length`: data of each [bytes]."""
    total = 1 + servos * (length + 4)
    frame = bytearray([*_HEADER, BROADCAST_ID, total & 0xFF, total >> 8, _STATUS])
    for servo, error, data in answers:
        frame += bytes([error, servo]) + data
        frame += _library.updateCRC(0, frame, len(frame)).to_bytes(2, "little")
    return bytes(frame)


class InstructionParser(FrameParser):
    """Finds whole frames in what a master sends; lengths and checksums are the library's, not the driver's."""

    header, fixed_bytes, longest = _HEADER, 7, 1024

    @override
    def find_end(self, start: bytearray) -> int | None:
        length = int.from_bytes(start[5:7], "little")
        return 7 + length if length >= 3 else None

    @override
    def is_whole(self, frame: bytes) -> bool:
        return _library.updateCRC(0, frame, len(frame) - 2) == int.from_bytes(frame[-2:], "little")


def decode_instruction(frame: bytes) -> Instruction:
    """What a frame asks."""
    body = frame[7:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
    return Instruction(frame[4], body[0], body[1:], len(frame))


Delivery = tuple[float, bytes]  # when bytes arrive at the master [s], and which

Part = tuple[EmulatedServo, int, bytes]  # a servo, and the error and the data of its answer

PING, READ, WRITE, REG_WRITE, ACTION, REBOOT, CLEAR = 0x01, 0x02, 0x03, 0x04, 0x05, 0x08, 0x10
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ, BULK_READ, BULK_WRITE, FAST_BULK_READ = 0x82, 0x83, 0x8A, 0x92, 0x93, 0x9A
_UNKNOWN_INSTRUCTION = 2
_BITS_PER_BYTE = 10
_REBOOT_S = 0.3


class EmulatedBus:
    """Servos on one line."""

    def __init__(self, servos: Sequence[EmulatedServo], *, fast_sync_read: bool = True, paced: bool = True) -> None:
        self.servos = {servo.servo: servo for servo in servos}
        self._fast = fast_sync_read
        self._paced = paced
        self._parser = InstructionParser()
        self._away_until_s = dict.fromkeys(self.servos, 0.0)
        self._answer_faults = {servo: AnswerFaults() for servo in self.servos}
        self._free_s = 0.0
        self._handlers: dict[int, Callable[[Instruction, float], list[Delivery]]] = {
            PING: self._ping,
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._write,
            ACTION: lambda asked, end_s: self._confirm(asked, end_s, lambda servo: _attempt(servo.act)),
            REBOOT: self._reboot,
            CLEAR: lambda asked, end_s: self._confirm(asked, end_s, lambda one: _attempt(one.clear, asked.parameters)),
            SYNC_READ: self._sync_read,
            SYNC_WRITE: self._sync_write,
            BULK_READ: self._bulk_read,
            BULK_WRITE: self._bulk_write,
        }
        if fast_sync_read:
            self._handlers |= {FAST_SYNC_READ: self._fast_sync_read}

    def hear(self, data: bytes, now_s: float) -> list[Instruction]:
        """Instructions in the bytes of a master; every servo that is there hears them, which contents its watchdog."""
        instructions = [decode_instruction(frame) for frame in self._parser.feed(data) if frame[7] != _STATUS]
        if instructions:
            for servo in self._present(now_s):
                servo.hear(now_s)
        return instructions

    def answer(self, instructions: Iterable[Instruction], now_s: float) -> list[Delivery]:
        """Carry instructions out and answer them."""
        deliveries: list[Delivery] = []
        for instruction in instructions:
            end_s = max(now_s, self._free_s) + self._wire_s(instruction.length)
            answers = self._obey(instruction, end_s)
            self._free_s = max([end_s, *(due for due, _ in answers)])
            deliveries += answers
        return deliveries

    def _obey(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        """Answers to an instruction; servos of another protocol on the same line have their own."""
        return self._handlers.get(instruction.code, self._refuse)(instruction, end_s)

    def carry_out(self, fault: InjectedFault, now_s: float) -> None:
        """Let a fault happen now."""
        if fault.kind is FaultKind.POWER_DIP:
            for servo in self.servos:
                self._restart(servo, now_s + fault.seconds)
            return
        servo = self.servos[fault.device]
        match fault.kind:
            case FaultKind.SILENT:
                self._away_until_s[fault.device] = now_s + fault.seconds
            case FaultKind.RESET:
                self._restart(fault.device, now_s + fault.seconds)
            case FaultKind.OVER_TEMPERATURE | FaultKind.OVERLOAD:
                servo.fail(servo.alarms[fault.kind])
            case FaultKind.ENCODER_JUMP:
                servo.encoder_offset_counts += fault.counts
                if not fault.counts:
                    servo.fail(servo.alarms[fault.kind])
            case _:
                self._answer_faults[fault.device] = AnswerFaults(fault.kind, fault.count, fault.seconds)

    def _restart(self, servo: int, back_s: float) -> None:
        self.servos[servo].restart()
        self._away_until_s[servo] = back_s

    def _present(self, now_s: float) -> list[EmulatedServo]:
        return [self.servos[key] for key in sorted(self.servos) if now_s >= self._away_until_s[key]]

    def _find_addressed(self, instruction: Instruction, now_s: float) -> list[EmulatedServo]:
        present = self._present(now_s)
        return [servo for servo in present if instruction.servo in (servo.servo, BROADCAST_ID)]

    def _find_present(self, servos: Sequence[int], now_s: float) -> list[EmulatedServo]:
        present = {servo.servo: servo for servo in self._present(now_s)}
        return [present[key] for key in servos if key in present]

    def _wire_s(self, length: int) -> float:
        baud = min((servo.specification.baud for servo in self.servos.values()), default=1_000_000)
        return length * _BITS_PER_BYTE / baud if self._paced else 0.0

    def _answer(self, servo: EmulatedServo, error: int, data: bytes, after_s: float) -> list[Delivery]:
        frame = status_frame(servo.servo, error | servo.error_byte, data)
        due = after_s + servo.return_delay_s + self._wire_s(len(frame))
        return self._answer_faults[servo.servo].apply(frame, due)

    def _answers(self, parts: list[Part], after_s: float) -> list[Delivery]:
        deliveries: list[Delivery] = []
        for servo, error, data in parts:
            deliveries += self._answer(servo, error, data, after_s)
            after_s += servo.return_delay_s + self._wire_s(11 + len(data))
        return deliveries

    def _ping(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        servos = self._find_addressed(instruction, end_s)
        return self._answers([(servo, 0, servo.memory.read(0, 2) + servo.memory.read(6, 1)) for servo in servos], end_s)

    def _read(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        if instruction.servo == BROADCAST_ID or len(instruction.parameters) != 4:
            return []
        addressed = self._find_addressed(instruction, end_s)
        servos = [servo for servo in addressed if servo.memory.get("Status Return Level")]
        return self._answers([self._value(servo, *_words(instruction.parameters)) for servo in servos], end_s)

    def _value(self, servo: EmulatedServo, address: int, length: int) -> Part:
        try:
            return servo, 0, servo.memory.read(address, length)
        except WriteRefusedError as refusal:
            return servo, refusal.error, b""

    def _write(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        address, data = int.from_bytes(instruction.parameters[:2], "little"), instruction.parameters[2:]
        for servo in self._followers(instruction.servo, end_s):
            if servo.servo != instruction.servo:
                _attempt(servo.write, address, data)
        deliveries: list[Delivery] = []
        for servo in self._find_addressed(instruction, end_s):
            level = servo.memory.get("Status Return Level")
            write = servo.write if instruction.code == WRITE else servo.register
            error = _attempt(write, address, data)
            if instruction.servo != BROADCAST_ID and level == 2:
                deliveries += self._answer(servo, error, b"", end_s)
        return deliveries

    def _confirm(self, instruction: Instruction, end_s: float, act: Callable[[EmulatedServo], int]) -> list[Delivery]:
        """Let every addressed servo do what is asked, and answer with its error; nobody answers what concerns all."""
        parts = [(servo, act(servo), b"") for servo in self._find_addressed(instruction, end_s)]
        return [] if instruction.servo == BROADCAST_ID else self._answers(parts, end_s)

    def _reboot(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        servos = self._find_addressed(instruction, end_s)
        answers = self._confirm(instruction, end_s, lambda _: 0)
        for servo in servos:
            self._restart(servo.servo, end_s + _REBOOT_S)
        return answers

    def _refuse(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        return self._confirm(instruction, end_s, lambda _: _UNKNOWN_INSTRUCTION)

    def _sync_read(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        address, length = _words(instruction.parameters)
        servos = self._find_present(instruction.parameters[4:], end_s)
        return self._answers([self._value(servo, address, length) for servo in servos], end_s)

    def _fast_sync_read(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        """One packet, to which each servo appends its part; who is silent ends it."""
        address, length = _words(instruction.parameters)
        wanted = instruction.parameters[4:]
        present = {servo.servo: servo for servo in self._present(end_s)}
        answers: list[tuple[int, int, bytes]] = []
        faults = AnswerFaults()
        for key in wanted:
            pending = self._answer_faults.get(key, faults)
            if key not in present or (pending.kind is FaultKind.LOSE and pending.apply(b"", 0.0) == []):
                break
            faults = pending if pending.count > 0 else faults
            servo, error, data = self._value(present[key], address, length)
            answers.append((key, error | servo.error_byte, data))
        if not answers:
            return []
        frame = fast_status_frame(answers, len(wanted), length)
        delay_s = max(present[key].return_delay_s for key, _, _ in answers)
        return faults.apply(frame, end_s + delay_s + self._wire_s(len(frame)))

    def _sync_write(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        address, length = _words(instruction.parameters)
        data = instruction.parameters[4:]
        for start in range(0, len(data) - length, 1 + length):
            for servo in self._followers(data[start], end_s):
                _attempt(servo.write, address, data[start + 1 : start + 1 + length])
        return []

    def _bulk_read(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        data = instruction.parameters
        parts: list[Part] = []
        for start in range(0, len(data) - 4, 5):
            for servo in self._find_present(data[start : start + 1], end_s):
                parts.append(self._value(servo, *_words(data[start + 1 : start + 5])))
        return self._answers(parts, end_s)

    def _bulk_write(self, instruction: Instruction, end_s: float) -> list[Delivery]:
        data = instruction.parameters
        start = 0
        while start + 5 <= len(data):
            address, length = _words(data[start + 1 : start + 5])
            for servo in self._followers(data[start], end_s):
                _attempt(servo.write, address, data[start + 5 : start + 5 + length])
            start += 5 + length
        return []

    def _followers(self, number: int, now_s: float) -> list[EmulatedServo]:
        """Servos that carry out what is written to an ID: its own, and those whose Secondary ID it is."""
        return [servo for servo in self._present(now_s) if number in (servo.servo, servo.secondary)]


def _attempt(act: Callable[..., None], *what: Any) -> int:
    """Error of what a servo was asked to do; 0 where it did."""
    try:
        act(*what)
    except WriteRefusedError as refusal:
        return refusal.error
    return 0


def _words(data: bytes) -> tuple[int, int]:
    return int.from_bytes(data[:2], "little"), int.from_bytes(data[2:4], "little")
