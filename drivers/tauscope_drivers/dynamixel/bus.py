"""Instructions and their answers on one bus, each with its error byte, and what a cycle of them takes."""

import struct
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from tauscope_drivers.clock import Clock
from tauscope_drivers.dynamixel import packets
from tauscope_drivers.dynamixel.control_table import Block, Item, encode_items
from tauscope_drivers.dynamixel.packets import DynamixelParser, Status
from tauscope_drivers.errors import DriverError
from tauscope_drivers.serial_port import SerialPort, expect_latency_s
from tauscope_drivers.serial_servos import bus as serial_bus
from tauscope_drivers.serial_servos.configuration import BusConfiguration


class Turns:
    """Keeps the answers of a Sync Read apart from late answers to an earlier one, which look the same.

    Servos answer in turn. An answer that comes out of turn says that it, or one before it, is a late one: both are let
    go. So are two answers of one servo that differ; of two that are equal, one is kept. Servos that owe an answer to
    an earlier question are not believed among themselves: what comes from nobody else is likely what they owe.
    """

    def __init__(self, servos: Sequence[int], owed: Collection[int] = ()) -> None:
        self._place = {servo: place for place, servo in enumerate(servos)}
        self._list_owing = frozenset(owed)
        self._found: dict[int, Status] = {}
        self._contradicted: set[int] = set()
        self._heard: set[int] = set()
        self._last = -1

    @property
    def complete(self) -> bool:
        """Whether every servo has answered."""
        return len(self._found) + len(self._contradicted) >= len(self._place)

    @property
    def answers(self) -> dict[int, Status]:
        """What can be believed, by ID."""
        return {} if self._found.keys() <= self._list_owing else dict(self._found)

    @property
    def unheard(self) -> set[int]:
        """Servos of which nothing has come, be it believed or not."""
        return self._place.keys() - self._heard

    def take(self, status: Status) -> None:
        """Take an answer."""
        servo = status.servo
        place = self._place.get(servo)
        if place is not None:
            self._heard.add(servo)
        if place is None or servo in self._contradicted or self._found.get(servo) == status:
            return
        if servo in self._found:
            del self._found[servo]
            self._contradicted.add(servo)
            return
        if place > self._last:
            self._found[servo] = status
        else:
            self._found = {other: kept for other, kept in self._found.items() if self._place[other] < place}
        self._last = place


_AFTERTHOUGHT_NS = 2_000_000
_STATUS_BYTES = 11
_STATE_BYTES = 10
_PING_ANSWER_BYTES = 14
_SYNC_BYTES = 14
_READ_BYTES = 14
_SPEED_BYTES = 4
_FAST_BYTES = 8
_FAST_SERVO_BYTES = 4


def count_traffic(
    servos: int, *, goal_bytes: int = 4, health_bytes: int = 3, fast: bool = False, families: int = 1
) -> serial_bus.CycleTraffic:
    """A cycle of so many servos. `health_bytes`: that one servo is asked for besides; 0 for no such read [bytes]."""
    write = families * _SYNC_BYTES + servos * (1 + goal_bytes)
    ask = families * _SYNC_BYTES + servos
    answers = servos * (_STATUS_BYTES + _STATE_BYTES)
    if fast:
        answers = families * _FAST_BYTES + servos * (_STATE_BYTES + _FAST_SERVO_BYTES)
    health = _READ_BYTES + _STATUS_BYTES + health_bytes if health_bytes else 0
    return serial_bus.CycleTraffic(
        servos,
        write + ask + answers + health,
        (families if fast else servos) + bool(health_bytes),
        families + bool(health_bytes),
        "write Return Delay Time = 0",
    )


def has_room_for_speeds(traffic: serial_bus.CycleTraffic, timing: serial_bus.BusTiming, cycle_s: float) -> bool:
    """Whether a cycle is long enough to send each servo a speed with its goal."""
    more = traffic.servos * _SPEED_BYTES
    return serial_bus.largest_rate_hz(replace(traffic, bytes=traffic.bytes + more), timing) * cycle_s >= 1.0


def planned_budget(configuration: BusConfiguration[Any]) -> tuple[serial_bus.CycleTraffic, serial_bus.BusTiming]:
    """Before the servos are reached: with what they will be set to."""
    timing = serial_bus.BusTiming(
        configuration.baud, serial_bus.SHORTEST_RETURN_DELAY_S, expect_latency_s(configuration.port)
    )
    return count_traffic(len(configuration.servos)), timing


class ServoBus(serial_bus.SerialServoBus[Status]):
    """Speaks to the servos of one port; one thread's own."""

    def __init__(self, port: SerialPort, clock: Clock | None = None) -> None:
        super().__init__(port, clock)
        self._answered_ns = 0

    def ping(self, servo: int) -> tuple[int, int] | None:
        """Model number and firmware of a servo; None where it does not answer."""
        for _ in range(serial_bus.ATTEMPTS):
            answer = self._ask(servo, packets.encode_ping(servo), 3, serial_bus.PATIENCE_S)
            if answer is not None and len(answer.data) == 3:
                return struct.unpack("<HB", answer.data)
        return None

    def ping_all(self) -> dict[int, tuple[int, int]]:
        """Model number and firmware of every servo that answers a ping to all, by ID."""
        ping = packets.encode_ping()
        frames = self._ask_everybody(ping, _PING_ANSWER_BYTES, packets.HIGHEST_ID + 1, DynamixelParser())
        statuses = map(packets.decode_status, frames)
        found = {status.servo: status.data for status in statuses if status is not None and len(status.data) == 3}
        return {servo: struct.unpack("<HB", found[servo]) for servo in sorted(found)}

    def read_once(self, servo: int, address: int, length: int, patience_s: float = 0.0) -> Status | None:
        """A stretch of a control table, asked for once; None where no whole answer came."""
        return self._ask(servo, packets.encode_read(servo, address, length), length, patience_s)

    def read_block(self, servo: int, block: Block) -> dict[str, int]:
        """Values of a block by name. Raises DriverError: ``cannot-connect``: no answer; ``refused``: no such block."""
        answer = None
        for _ in range(serial_bus.ATTEMPTS):
            answer = self.read_once(servo, block.address, block.length, serial_bus.PATIENCE_S)
            if answer is not None and not answer.refusal and len(answer.data) == block.length:
                return block.decode(answer.data)
        raise _failure(servo, f"{block.items[0].name} cannot be read", answer)

    def read(self, servo: int, item: Item) -> int:
        """Value of an item. Raises DriverError: ``cannot-connect``: no answer; ``refused``: there is no such item."""
        return self.read_block(servo, Block(item.address, item.size, (item,)))[item.name]

    def write(self, servo: int, item: Item, value: int) -> None:
        """Write an item and read it back. Raises DriverError: ``cannot-connect``: no answer; ``refused``: not taken."""
        answer = None
        for _ in range(serial_bus.ATTEMPTS):
            request = packets.encode_write(servo, item.address, item.encode(value))
            answer = self._ask(servo, request, 0, serial_bus.PATIENCE_S)
            if answer is not None and answer.refusal:
                raise _failure(servo, f"{item.name} = {value} is refused", answer)
            # A write whose answer was lost may have arrived: what counts is what the servo holds now.
            if self.read(servo, item) == value:
                return
        raise DriverError.refusal(f"servo {servo}: {item.name} was written as {value} and reads otherwise; check it")

    def clear_error(self, servo: int) -> None:
        """Let a servo of the Y series forget its error; whether it did is what its Error Code says."""
        for _ in range(serial_bus.ATTEMPTS):
            if self._ask(servo, packets.encode_clear_error(servo), 0, serial_bus.PATIENCE_S) is not None:
                return

    def sync_write(self, items: Sequence[Item], values: Mapping[int, Sequence[int]]) -> None:
        """Write items of many servos at once; no servo answers."""
        encoded = {servo: encode_items(items, own) for servo, own in values.items()}
        self.port.send(packets.encode_sync_write(encoded, items[0].address))

    def sync_read(
        self, servos: Sequence[int], block: Block, *, fast: bool = False, patience_s: float = 0.0, spare: int = 0
    ) -> serial_bus.Answers[Status]:
        """Read the same block of many servos.

        Nothing in an answer says to which question it belongs. Where an earlier one was not answered in time, as many
        bytes before the block as make another length are read with it, so that what comes late has the wrong length.
        """
        if any(self._find_owing(servos, block.length + surplus) for surplus in range(spare + 1)):
            self.port.drain()
        surplus = min(range(spare + 1), key=lambda surplus: self._last_missed_ns(servos, block.length + surplus))
        length = block.length + surplus
        owed = self._find_owing(servos, length)
        request = packets.encode_sync_read(servos, block.address - surplus, length, fast=fast)
        self._answered_ns = asked_ns = self._send_question(request)
        receive = self._receive_fast if fast else self._receive_each
        waits_s = len(servos) * self.return_delay_s + patience_s
        found = receive(servos, length, len(request), waits_s, owed)
        answer_bytes = _fast_bytes(servos, length) if fast else len(servos) * (_STATUS_BYTES + length)
        usual_s = self._wire_s(answer_bytes) + len(servos) * self.return_delay_s
        wanted = {servo: replace(status, data=status.data[surplus:]) for servo, status in found.items()}
        return self._time_answers((tuple(servos), fast), asked_ns, self._answered_ns, usual_s, wanted)

    def _last_missed_ns(self, servos: Sequence[int], length: int) -> int:
        """When the last answer of this length was missed that may still be under way; zero where none is."""
        return max((self._missed_ns[servo, length] for servo in self._find_owing(servos, length)), default=0)

    def _receive_each(
        self, servos: Sequence[int], length: int, sent: int, waits_s: float, owed: set[int]
    ) -> dict[int, Status]:
        """One status packet of each servo, in their order; where answers are owed, also what comes after the last."""
        answer_bytes = _STATUS_BYTES + length
        deadline = self.port.reply_deadline_ns(sent + len(servos) * answer_bytes, waits_s)
        # Stuffing lengthens an answer by a third at most.
        parser = DynamixelParser(longest=answer_bytes + length // 3 + 1)
        turns = Turns(servos, owed)
        while received := self.port.receive(deadline):
            for frame in parser.feed(received):
                status = packets.decode_status(frame)
                if status is not None and len(status.data) == length and not status.refusal:
                    turns.take(status)
                    self._answered_ns = self._clock.now_ns()
            if turns.complete:
                if not owed:
                    break
                deadline = min(deadline, time.monotonic_ns() + _AFTERTHOUGHT_NS)
        self._miss(turns.unheard, length)
        return turns.answers

    def _receive_fast(
        self, servos: Sequence[int], length: int, sent: int, waits_s: float, owed: set[int]
    ) -> dict[int, Status]:
        """One packet of all servos, or what is whole of one that breaks off; none where there are two that differ."""
        answer_bytes = _fast_bytes(servos, length)
        deadline = self.port.reply_deadline_ns(sent + answer_bytes, waits_s)
        parser = DynamixelParser(longest=answer_bytes)
        packets_found: list[list[Status]] = []
        while received := self.port.receive(deadline):
            decoded = [packets.decode_fast(frame, servos, length) for frame in parser.feed(received)]
            packets_found += [statuses for statuses in decoded if statuses and statuses not in packets_found]
            if packets_found:
                self._answered_ns = self._clock.now_ns()
                if not owed:
                    break
                deadline = min(deadline, time.monotonic_ns() + _AFTERTHOUGHT_NS)
        if not packets_found:
            packets_found = [packets.decode_fast(parser.pending, servos, length)]
        answers = {status.servo: status for status in packets_found[0]} if len(packets_found) == 1 else {}
        self._miss(set(servos) - answers.keys(), length)
        return answers

    def _ask(self, servo: int, request: bytes, length: int, patience_s: float) -> Status | None:
        if self._find_owing([servo], length):
            self.port.drain()
        self.port.send(request)
        delay_s = self.return_delay_s + patience_s
        deadline = self.port.reply_deadline_ns(len(request) + _STATUS_BYTES + length, delay_s)
        parser = DynamixelParser()
        while received := self.port.receive(deadline):
            for frame in parser.feed(received):
                status = packets.decode_status(frame)
                if status is not None and status.servo == servo and (len(status.data) == length or status.refusal):
                    return status
        self._miss([servo], length)
        return None


def _fast_bytes(servos: Sequence[int], length: int) -> int:
    return _FAST_BYTES + len(servos) * (length + _FAST_SERVO_BYTES)


def _failure(servo: int, what: str, answer: Status | None) -> DriverError:
    if answer is None:
        return DriverError.no_connection(
            f"servo {servo} does not answer ({what}); check its power, cable, ID and baud rate"
        )
    reason = packets.REFUSALS.get(answer.refusal, f"error {answer.refusal}")
    return DriverError.refusal(f"servo {servo}: {what}: {reason}; check the servo with its wizard")
