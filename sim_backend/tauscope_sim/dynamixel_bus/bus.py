"""The bus of emulated servos: bytes of a master in, answers with the instants of their arrival out."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from tauscope_sim.dynamixel_bus import framing
from tauscope_sim.dynamixel_bus.control_memory import WriteRefusedError
from tauscope_sim.dynamixel_bus.servo import EmulatedServo
from tauscope_sim.emulation.fault_kit import AnswerFaults, FaultKind, InjectedFault

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
        self._parser = framing.InstructionParser()
        self._away_until_s = dict.fromkeys(self.servos, 0.0)
        self._answer_faults = {servo: AnswerFaults() for servo in self.servos}
        self._free_s = 0.0
        self._handlers: dict[int, Callable[[framing.Instruction, float], list[Delivery]]] = {
            PING: self._ping,
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._write,
            ACTION: self._act,
            REBOOT: self._reboot,
            CLEAR: self._clear,
            SYNC_READ: self._sync_read,
            SYNC_WRITE: self._sync_write,
            BULK_READ: self._bulk_read,
            BULK_WRITE: self._bulk_write,
        }
        if fast_sync_read:
            self._handlers |= {FAST_SYNC_READ: self._fast_sync_read}

    def hear(self, data: bytes, now_s: float) -> list[framing.Instruction]:
        """Instructions in the bytes of a master; every servo that is there hears them, which contents its watchdog."""
        instructions = self._parser.feed(data)
        if instructions:
            for servo in self._present(now_s):
                servo.hear(now_s)
        return instructions

    def answer(self, instructions: Iterable[framing.Instruction], now_s: float) -> list[Delivery]:
        """Carry instructions out and answer them."""
        deliveries: list[Delivery] = []
        for instruction in instructions:
            end_s = max(now_s, self._free_s) + self._wire_s(instruction.length)
            answers = self._obey(instruction, end_s)
            self._free_s = max([end_s, *(due for due, _ in answers)])
            deliveries += answers
        return deliveries

    def _obey(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
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

    def _find_addressed(self, instruction: framing.Instruction, now_s: float) -> list[EmulatedServo]:
        present = self._present(now_s)
        return [servo for servo in present if instruction.servo in (servo.servo, framing.BROADCAST_ID)]

    def _find_present(self, servos: Sequence[int], now_s: float) -> list[EmulatedServo]:
        present = {servo.servo: servo for servo in self._present(now_s)}
        return [present[key] for key in servos if key in present]

    def _wire_s(self, length: int) -> float:
        baud = min((servo.specification.baud for servo in self.servos.values()), default=1_000_000)
        return length * _BITS_PER_BYTE / baud if self._paced else 0.0

    def _answer(self, servo: EmulatedServo, error: int, data: bytes, after_s: float) -> list[Delivery]:
        frame = framing.status_frame(servo.servo, error | servo.error_byte, data)
        due = after_s + servo.return_delay_s + self._wire_s(len(frame))
        return self._answer_faults[servo.servo].apply(frame, due)

    def _answers(self, parts: list[Part], after_s: float) -> list[Delivery]:
        deliveries: list[Delivery] = []
        for servo, error, data in parts:
            deliveries += self._answer(servo, error, data, after_s)
            after_s += servo.return_delay_s + self._wire_s(11 + len(data))
        return deliveries

    def _ping(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        servos = self._find_addressed(instruction, end_s)
        return self._answers([(servo, 0, servo.memory.read(0, 2) + servo.memory.read(6, 1)) for servo in servos], end_s)

    def _read(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        if instruction.servo == framing.BROADCAST_ID or len(instruction.parameters) != 4:
            return []
        servos = [
            servo for servo in self._find_addressed(instruction, end_s) if servo.memory.get("Status Return Level")
        ]
        return self._answers([self._value(servo, *_words(instruction.parameters)) for servo in servos], end_s)

    def _value(self, servo: EmulatedServo, address: int, length: int) -> Part:
        try:
            return servo, 0, servo.memory.read(address, length)
        except WriteRefusedError as refusal:
            return servo, refusal.error, b""

    def _write(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        address, data = int.from_bytes(instruction.parameters[:2], "little"), instruction.parameters[2:]
        for servo in self._followers(instruction.servo, end_s):
            if servo.servo != instruction.servo:
                _attempt(partial(servo.write, address, data))
        deliveries: list[Delivery] = []
        for servo in self._find_addressed(instruction, end_s):
            level = servo.memory.get("Status Return Level")
            write = servo.write if instruction.code == WRITE else servo.register
            error = _attempt(partial(write, address, data))
            if instruction.servo != framing.BROADCAST_ID and level == 2:
                deliveries += self._answer(servo, error, b"", end_s)
        return deliveries

    def _act(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        servos = self._find_addressed(instruction, end_s)
        return self._confirm(instruction, [(servo, _attempt(servo.act), b"") for servo in servos], end_s)

    def _clear(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        clear, servos = EmulatedServo.clear, self._find_addressed(instruction, end_s)
        errors = [_attempt(partial(clear, servo, instruction.parameters)) for servo in servos]
        return self._confirm(instruction, [(one, error, b"") for one, error in zip(servos, errors, strict=True)], end_s)

    def _confirm(self, instruction: framing.Instruction, parts: list[Part], end_s: float) -> list[Delivery]:
        """Answers to an instruction; none to one that concerns all."""
        return [] if instruction.servo == framing.BROADCAST_ID else self._answers(parts, end_s)

    def _reboot(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        servos = self._find_addressed(instruction, end_s)
        answers = self._confirm(instruction, [(servo, 0, b"") for servo in servos], end_s)
        for servo in servos:
            self._restart(servo.servo, end_s + _REBOOT_S)
        return answers

    def _refuse(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        servos = self._find_addressed(instruction, end_s)
        return self._confirm(instruction, [(servo, _UNKNOWN_INSTRUCTION, b"") for servo in servos], end_s)

    def _sync_read(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        address, length = _words(instruction.parameters)
        servos = self._find_present(instruction.parameters[4:], end_s)
        return self._answers([self._value(servo, address, length) for servo in servos], end_s)

    def _fast_sync_read(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
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
        frame = framing.fast_status_frame(answers, len(wanted), length)
        delay_s = max(present[key].return_delay_s for key, _, _ in answers)
        return faults.apply(frame, end_s + delay_s + self._wire_s(len(frame)))

    def _sync_write(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        address, length = _words(instruction.parameters)
        data = instruction.parameters[4:]
        for start in range(0, len(data) - length, 1 + length):
            for servo in self._followers(data[start], end_s):
                _attempt(partial(servo.write, address, data[start + 1 : start + 1 + length]))
        return []

    def _bulk_read(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        data = instruction.parameters
        parts: list[Part] = []
        for start in range(0, len(data) - 4, 5):
            for servo in self._find_present(data[start : start + 1], end_s):
                parts.append(self._value(servo, *_words(data[start + 1 : start + 5])))
        return self._answers(parts, end_s)

    def _bulk_write(self, instruction: framing.Instruction, end_s: float) -> list[Delivery]:
        data = instruction.parameters
        start = 0
        while start + 5 <= len(data):
            address, length = _words(data[start + 1 : start + 5])
            for servo in self._followers(data[start], end_s):
                _attempt(partial(servo.write, address, data[start + 5 : start + 5 + length]))
            start += 5 + length
        return []

    def _followers(self, number: int, now_s: float) -> list[EmulatedServo]:
        """Servos that carry out what is written to an ID: its own, and those whose Secondary ID it is."""
        return [servo for servo in self._present(now_s) if number in (servo.servo, servo.secondary)]


def _attempt(act: Callable[[], None]) -> int:
    """Error of what a servo was asked to do; 0 where it did."""
    try:
        act()
    except WriteRefusedError as refusal:
        return refusal.error
    return 0


def _words(data: bytes) -> tuple[int, int]:
    return int.from_bytes(data[:2], "little"), int.from_bytes(data[2:4], "little")
