"""Questions and answers: echoes, foreign, damaged and late answers are none; what was written is read back."""

from collections import deque
from typing import Any

import pytest

from drivers.feetech.test_feetech_packets import answer
from drivers.wired_port import WiredPort
from feetech_bus import ServoSpecification
from tauscope_drivers.clock import MonotonicClock
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.feetech.bus import FeetechBus, encode_registers
from tauscope_drivers.feetech.registers import FEEDBACK, SPARE_BYTES, TARGETS

SERVOS = (1, 2, 3)
NEW, OLD = bytes(range(8)), bytes(8)


class Line:
    """A port whose answers a test lays ready."""

    baudrate = 1_000_000
    latency_s = 0.001

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.coming: deque[bytes] = deque()

    def send(self, frame: bytes) -> None:
        self.sent.append(frame)

    def receive(self, deadline_ns: int) -> bytes:
        return self.coming.popleft() if self.coming else b""

    def drain(self) -> None:
        pass

    def reply_deadline_ns(self, byte_count: int, delay_s: float = 0.0) -> int:
        return MonotonicClock().now_ns() + 10_000_000

    @property
    def length(self) -> int:
        """Bytes that the last group read asked for."""
        return self.sent[-1][6]


@pytest.fixture
def line() -> Line:
    return Line()


@pytest.fixture
def bus(line: Line) -> FeetechBus:
    return FeetechBus(line)  # pyright: ignore[reportArgumentType]


def wired(*registers: dict[str, int], echoes: bool = False) -> FeetechBus:
    WiredPort.wire(
        [(ServoSpecification(number, registers=own), 0.2) for number, own in enumerate(registers, 1)], echoes=echoes
    )
    port: Any = WiredPort("wired", 1_000_000)
    return FeetechBus(port)


def ask(bus: FeetechBus) -> dict[int, bytes]:
    return {servo: status.data[:8] for servo, status in bus.sync_read(SERVOS, FEEDBACK).statuses.items()}


def test_who_answers_is_asked_for_no_more_than_is_wanted(line: Line, bus: FeetechBus) -> None:
    for _ in range(3):
        line.coming.extend(answer(servo, 0, NEW) for servo in SERVOS)
        assert ask(bus) == dict.fromkeys(SERVOS, NEW)
        assert line.length == FEEDBACK.length


def test_late_answers_have_another_length(line: Line, bus: FeetechBus) -> None:
    line.coming.append(answer(1, 0, NEW))
    assert ask(bus) == {1: NEW}
    line.coming.extend(answer(servo, 0, OLD) for servo in SERVOS)
    assert ask(bus) == {}, "what was asked before comes now"
    assert line.length == FEEDBACK.length + 1
    line.coming.extend(answer(servo, 0, OLD + b"?") for servo in SERVOS)
    line.coming.extend(answer(servo, 0, NEW + b"!!") for servo in SERVOS)
    assert ask(bus) == dict.fromkeys(SERVOS, NEW)


def test_a_servo_that_owes_answers_of_every_length_is_not_believed_until_they_cannot_come_any_more(
    line: Line, bus: FeetechBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_ms = 1000
    monkeypatch.setattr("tauscope_drivers.serial_servos.bus.time.monotonic_ns", lambda: now_ms * 1_000_000)

    def hear(*servos: int) -> set[int]:
        line.coming.extend(answer(servo, 0, NEW + bytes(spare)) for spare in range(SPARE_BYTES + 1) for servo in servos)
        heard = set(ask(bus))
        line.coming.clear()
        return heard

    for _ in range(SPARE_BYTES + 1):
        assert hear(1, 3) == {1, 3}
        now_ms += 4
    assert hear(1, 2, 3) == {1, 3}, "an answer of servo 2 may be one of 28 ms ago"
    now_ms += 600
    assert hear(1, 2, 3) == {1, 2, 3}


def test_foreign_and_damaged_answers_are_none(line: Line, bus: FeetechBus) -> None:
    damaged = bytearray(answer(2, 0, NEW))
    damaged[6] ^= 1
    line.coming.extend([answer(9, 0, NEW), bytes(damaged), answer(3, 0, NEW)])
    assert ask(bus) == {3: NEW}


def test_two_answers_that_differ_are_none(line: Line, bus: FeetechBus) -> None:
    line.coming.append(answer(1, 0, NEW) + answer(1, 0, OLD) + answer(2, 0, NEW) + answer(2, 0, NEW))
    assert ask(bus) == {2: NEW}


@pytest.mark.parametrize("echoes", [False, True])
def test_an_adapter_that_echoes_makes_no_difference(echoes: bool) -> None:
    bus = wired({}, {}, echoes=echoes)
    assert bus.ping(1)
    assert bus.ping_all() == [1, 2]
    alarms, values = bus.read(1, FEEDBACK)
    assert alarms == 0
    assert values["Present Position"] == 2178
    bus.write(2, {"Goal Speed": 300, "Torque Limit": 700})
    assert WiredPort.wired.servos[2].memory.get("torque_limit") == 700
    assert set(bus.sync_read((1, 2), FEEDBACK).statuses) == {1, 2}
    assert bus.read_once(2, TARGETS) is not None


@pytest.mark.parametrize("servo", [1, 2])
def test_nobody_answers_by_an_echo(servo: int) -> None:
    bus = wired(*[{}] * (servo - 1), echoes=True)
    assert not bus.ping(servo)
    with pytest.raises(DriverError, match="does not answer") as caught:
        bus.read(servo, FEEDBACK)
    assert caught.value.kind is DriverErrorKind.CANNOT_CONNECT


def test_a_servo_that_answers_reads_alone_is_written_to_as_well() -> None:
    bus = wired({"status_level": 0})
    bus.write(1, {"Torque Limit": 321})
    assert WiredPort.wired.servos[1].memory.get("torque_limit") == 321


def test_a_value_that_is_not_taken_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = wired({})
    monkeypatch.setattr(type(WiredPort.wired.servos[1].memory), "write", lambda *_: [])
    with pytest.raises(DriverError, match="Torque Limit was written as 321 and reads 1000") as caught:
        bus.write(1, {"Torque Limit": 321})
    assert caught.value.kind is DriverErrorKind.REFUSED


@pytest.mark.parametrize("values", [{"Operating Mode": 0}, {"ID": 7}, {"Goal Position": 1, "Torque Limit": 5}])
def test_eeprom_and_registers_with_a_gap_are_never_written(values: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="cannot be written"):
        encode_registers(values)
