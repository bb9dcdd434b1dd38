"""Instructions and their answers on one bus of servos, and what a cycle of them takes."""

from collections.abc import Collection, Mapping, Sequence

from tauscope_drivers.clock import Clock
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech import packets
from tauscope_drivers.feetech.packets import ANSWER_BYTES, FeetechParser, Status
from tauscope_drivers.feetech.registers import FEEDBACK, FIRST_IN_RAM, REGISTERS, SPARE_BYTES, TARGETS, Block
from tauscope_drivers.serial_port import SerialPort
from tauscope_drivers.serial_servos.bus import ATTEMPTS, PATIENCE_S, Answers, CycleTraffic, SerialServoBus

_ASK_BYTES = 8
_GOAL_BYTES = 7  # ID, position, time and speed


def count_traffic(servos: int) -> CycleTraffic:
    """A cycle: Sync Write of the goals, Sync Read of all servos, a read of one servo's torque and limits."""
    each = _GOAL_BYTES + 1 + ANSWER_BYTES + FEEDBACK.length
    count = 3 * _ASK_BYTES + servos * each + ANSWER_BYTES + TARGETS.length
    return CycleTraffic(servos, count, servos + 1, 2, "set Return Delay Time to 0 with Feetech's FD")


class FeetechBus(SerialServoBus[Status]):
    """Speaks to the servos of one port; one thread's own.

    After a question that was not answered in time, the next ones ask for another number of bytes: an answer that comes
    late has the wrong length. A servo that may still owe an answer of the same length is not believed.
    """

    def __init__(self, port: SerialPort, clock: Clock | None = None) -> None:
        super().__init__(port, clock)
        self._owes = False

    def ping(self, servo: int) -> bool:
        """Whether a servo answers."""
        return any(self._ask(servo, packets.encode_ping(servo), 0, PATIENCE_S) for _ in range(ATTEMPTS))

    def ping_all(self) -> list[int]:
        """IDs of the servos that answer a ping to all."""
        frames = self._ask_everybody(packets.encode_ping(), ANSWER_BYTES, packets.HIGHEST_ID + 1, FeetechParser())
        statuses = map(packets.decode_status, frames)
        return sorted({status.servo for status in statuses if status is not None and not status.data})

    def read(self, servo: int, block: Block) -> tuple[int, dict[str, int]]:
        """Alarms and registers of one servo, asked repeatedly. Raises DriverError ``cannot-connect``: no answer."""
        for _ in range(ATTEMPTS):
            request = packets.encode_read(servo, block.address, block.length)
            answer = self._ask(servo, request, block.length, PATIENCE_S)
            if answer is not None:
                return answer.alarms, block.decode(answer.data)
        raise DriverError.no_connection(f"servo {servo} does not answer; check its power, cable, ID and baud rate")

    def read_once(self, servo: int, block: Block) -> Status | None:
        """A block and some spare bytes, asked for once; None where no answer came that can be believed."""
        length = self._choose_length([servo], block)
        owed = self._find_owing([servo], length)
        answer = self._ask(servo, packets.encode_read(servo, block.address, length), length)
        if answer is None:
            self._miss([servo], length)
        return None if owed else answer

    def write(self, servo: int, values: Mapping[str, int]) -> None:
        """Write neighbouring registers in RAM, read them back. Raises DriverError ``cannot-connect``, ``refused``."""
        address, data = encode_registers(values)
        for _ in range(ATTEMPTS):
            # A servo whose Response Status Level is 0 does not answer: the registers that it holds now count.
            self._ask(servo, packets.encode_write(servo, address, data), 0, self.return_delay_s)
            found = self.read(servo, Block(address, len(data)))[1]
            if all(found[name] == value for name, value in values.items()):
                return
        name, value = next((name, value) for name, value in values.items() if found[name] != value)
        raise DriverError.refusal(
            f"servo {servo}: {name} was written as {value} and reads {found[name]}; check it with Feetech's FD"
        )

    def sync_write(self, values: Mapping[int, Mapping[str, int]]) -> None:
        """Write the same registers of many servos' RAM; no servo answers."""
        encoded = {servo: encode_registers(own) for servo, own in values.items()}
        if encoded:
            (address,) = {start for start, _ in encoded.values()}
            self.port.send(packets.encode_sync_write({servo: data for servo, (_, data) in encoded.items()}, address))

    def sync_read(self, servos: Sequence[int], block: Block, patience_s: float = 0.0) -> Answers[Status]:
        """Read a block and some spare bytes of many servos."""
        self._drain()
        length = self._choose_length(servos, block)
        owed = self._find_owing(servos, length)
        request = packets.encode_sync_read(servos, block.address, length)
        asked_ns = self._send_question(request)
        answer_bytes, waits_s = len(servos) * (ANSWER_BYTES + length), len(servos) * self.return_delay_s
        deadline = self.port.reply_deadline_ns(len(request) + answer_bytes, waits_s + patience_s)
        found, answered_ns = self._receive_each(servos, length, max(len(request), ANSWER_BYTES + length), deadline)
        self._miss(set(servos) - found.keys(), length)
        believed = {servo: status for servo, status in found.items() if status is not None and servo not in owed}
        usual_s = self._wire_s(answer_bytes) + waits_s
        return self._time_answers(len(servos), asked_ns, answered_ns, usual_s, believed)

    def _receive_each(
        self, servos: Sequence[int], length: int, longest: int, deadline: int
    ) -> tuple[dict[int, Status | None], int]:
        """One answer of each servo, None where two differ, and when the last came."""
        parser, found = FeetechParser(longest), dict[int, Status | None]()
        answered_ns = 0
        while len(found) < len(servos) and (received := self.port.receive(deadline)):
            for frame in parser.feed(received):
                status = packets.decode_status(frame)
                if status is None or status.servo not in servos or len(status.data) != length:
                    continue
                answered_ns = self._clock.now_ns()
                if found.setdefault(status.servo, status) != status:
                    found[status.servo] = None
        return found, answered_ns

    def _ask(self, servo: int, request: bytes, length: int, patience_s: float = 0.0) -> Status | None:
        """Send an instruction to one servo and wait for its answer; an echo of the instruction is none."""
        self._drain()
        self.port.send(request)
        delay_s = self.return_delay_s + patience_s
        deadline = self.port.reply_deadline_ns(len(request) + ANSWER_BYTES + length, delay_s)
        parser = FeetechParser(max(len(request), ANSWER_BYTES + length))
        may_echo = True
        while received := self.port.receive(deadline):
            for frame in parser.feed(received):
                if may_echo and frame == request:
                    may_echo = False
                    continue
                status = packets.decode_status(frame)
                if status is not None and status.servo == servo and len(status.data) == length:
                    return status
        self._owes = True
        return None

    def _drain(self) -> None:
        """Let what comes late pass, where something may."""
        if self._owes:
            self._owes = False
            self.port.drain()

    def _choose_length(self, servos: Sequence[int], block: Block) -> int:
        """The length of which an answer was missed longest ago; the block's own where none was."""
        lengths = range(block.length, block.length + SPARE_BYTES + 1)
        return min(lengths, key=lambda length: max(self._missed_ns.get((servo, length), 0) for servo in servos))

    def _miss(self, servos: Collection[int], length: int) -> None:
        self._owes |= bool(servos)
        super()._miss(servos, length)


def encode_registers(values: Mapping[str, int]) -> tuple[int, bytes]:
    """Address and bytes of neighbouring registers in RAM. Raises ValueError where they are none, or lie in EEPROM."""
    registers = [REGISTERS[name] for name in values]
    ends = [register.end for register in registers[:-1]]
    if registers[0].address < FIRST_IN_RAM or ends != [register.address for register in registers[1:]]:
        raise ValueError(f"{', '.join(values)} cannot be written at once, or not at all")
    return registers[0].address, b"".join(REGISTERS[name].encode(value) for name, value in values.items())
