"""A question to a group, and what comes late: the length of an answer says which question it belongs to."""

from collections import deque
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.clock import MonotonicClock
from tauscope_drivers.dynamixel.bus import ServoBus
from tauscope_drivers.dynamixel.control_table import BYTES_BEFORE_STATE, family_of, find_model, model_names
from tauscope_drivers.dynamixel.packets import encode_write
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_sim.dynamixel_bus.bus import status_frame

BLOCK = find_model(1020).state_block
SERVOS = (1, 2, 3)
OLD, NEW = b"old state.", b"new state."
LATEST_ANSWER_MS = 500


class Line:
    """A port whose answers a test lays ready, or that gives every question its answer."""

    baudrate = 1_000_000
    latency_s = 0.001

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.coming: deque[bytes] = deque()
        self.answers: bytes | None = None

    def send(self, frame: bytes) -> None:
        self.sent.append(frame)
        if self.answers is not None:
            surplus = bytes(self.asked[1] - len(self.answers))
            self.coming.extend(status_frame(servo, 0, surplus + self.answers) for servo in SERVOS)

    def receive(self, deadline_ns: int) -> bytes:
        return self.coming.popleft() if self.coming else b""

    def drain(self) -> None:
        pass

    def reply_deadline_ns(self, byte_count: int, delay_s: float = 0.0) -> int:
        return MonotonicClock().now_ns() + 10_000_000

    @property
    def asked(self) -> tuple[int, int]:
        """First address and length of the last question."""
        parameters = self.sent[-1][8:]
        return int.from_bytes(parameters[:2], "little"), int.from_bytes(parameters[2:4], "little")


def ask(bus: ServoBus) -> dict[int, bytes]:
    answers = bus.sync_read(SERVOS, BLOCK, spare=BYTES_BEFORE_STATE)
    return {servo: status.data for servo, status in answers.statuses.items()}


def test_who_answers_is_asked_for_no_more_than_is_wanted() -> None:
    line = Line()
    bus = ServoBus(line)  # pyright: ignore[reportArgumentType]
    for _ in range(3):
        line.coming.extend(status_frame(servo, 0, NEW) for servo in SERVOS)
        assert ask(bus) == dict.fromkeys(SERVOS, NEW)
        assert line.asked == (BLOCK.address, BLOCK.length)


def test_late_answers_have_another_length() -> None:
    line = Line()
    bus = ServoBus(line)  # pyright: ignore[reportArgumentType]
    assert ask(bus) == {}
    line.coming.extend(status_frame(servo, 0, OLD) for servo in SERVOS)
    assert ask(bus) == {}, "what was asked before comes now"
    assert line.asked == (BLOCK.address - 1, BLOCK.length + 1)
    line.coming.extend(status_frame(servo, 0, b"!" + OLD) for servo in SERVOS)
    line.coming.extend(status_frame(servo, 0, b"??" + NEW) for servo in SERVOS)
    assert ask(bus) == dict.fromkeys(SERVOS, NEW)


def test_an_answer_from_long_ago_is_not_believed_where_every_length_was_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    now_ms = 1000
    monkeypatch.setattr("tauscope_drivers.serial_servos.bus.time.monotonic_ns", lambda: now_ms * 1_000_000)
    line = Line()
    bus = ServoBus(line)  # pyright: ignore[reportArgumentType]
    for _ in range(BYTES_BEFORE_STATE + 1):
        assert ask(bus) == {}
        now_ms += 35
    line.coming.extend(status_frame(SERVOS[1], 0, bytes(surplus) + OLD) for surplus in range(BYTES_BEFORE_STATE + 1))
    assert ask(bus) == {}, "one of them has the length that is asked for, and was asked for 105 ms ago or more"


def test_servos_that_come_back_are_believed_once_nothing_can_be_late(monkeypatch: pytest.MonkeyPatch) -> None:
    now_ms = 1000
    monkeypatch.setattr("tauscope_drivers.serial_servos.bus.time.monotonic_ns", lambda: now_ms * 1_000_000)
    line = Line()
    bus = ServoBus(line)  # pyright: ignore[reportArgumentType]
    for _ in range(2 * (BYTES_BEFORE_STATE + 1)):
        assert ask(bus) == {}
        now_ms += 5
    line.answers = NEW
    believed_ms = []
    for _ in range(2 * LATEST_ANSWER_MS // 5):
        if ask(bus):
            believed_ms.append(now_ms)
        now_ms += 5
    assert believed_ms[0] <= 1000 + 2 * 5 * (BYTES_BEFORE_STATE + 1) + LATEST_ANSWER_MS
    assert len(believed_ms) == 1 + (now_ms - 5 - believed_ms[0]) // 5, "from then on every one"


def test_every_table_has_bytes_before_its_state() -> None:
    for number, name in model_names().items():
        if family_of(name) is None or not (model := find_model(number)).senses_current:
            continue
        known = {item.address + k for item in model.items.values() for k in range(item.size)}
        start = model.state_block.address
        assert known >= set(range(start - BYTES_BEFORE_STATE, start)), name


STATUSES = st.builds(status_frame, st.sampled_from((*SERVOS, 4, 253)), st.integers(0, 255), st.binary(max_size=14))
"""Whole packets, of servos that were asked and of others, with any error byte and of any length."""

NOISE = st.lists(st.binary(max_size=40) | STATUSES | st.just(encode_write(1, 64, b"\x01")), max_size=12)
"""What may come in place of an answer: pieces, answers to other questions, instructions that are echoed."""


@given(NOISE, st.booleans())
def test_whatever_comes_a_group_answers_with_its_own_or_not_at_all(noise: list[bytes], fast: bool) -> None:
    line = Line()
    bus = ServoBus(line)  # pyright: ignore[reportArgumentType]
    for _ in range(2):
        line.coming.extend(noise)
        answers = bus.sync_read(SERVOS, BLOCK, fast=fast, spare=BYTES_BEFORE_STATE)
        line.coming.clear()
        assert answers.statuses.keys() <= set(SERVOS)
        for servo, status in answers.statuses.items():
            assert status.servo == servo
            assert BLOCK.decode(status.data).keys() == {item.name for item in BLOCK.items}


@given(NOISE)
def test_whatever_comes_a_servo_is_read_written_and_pinged_or_refused_in_one_line(noise: list[bytes]) -> None:
    line = Line()
    bus = ServoBus(line)  # pyright: ignore[reportArgumentType]
    item = find_model(1020).items["Goal Position"]
    for ask_one in (lambda: bus.read(1, item), lambda: bus.write(1, item, 7), lambda: bus.ping(1), bus.ping_all):
        line.coming.extend(noise)
        error = refusal(ask_one)
        line.coming.clear()
        if error is None:
            continue
        assert error.kind in (DriverErrorKind.CANNOT_CONNECT, DriverErrorKind.REFUSED)
        assert "\n" not in str(error)
        assert ";" in str(error), "what happened; what to do"


def refusal(ask_one: Callable[[], object]) -> DriverError | None:
    """The error in which a question ends, if it does."""
    try:
        ask_one()
    except DriverError as error:
        return error
    return None
