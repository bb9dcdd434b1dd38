"""A serial CAN adapter: what it writes, what is left of that where characters are lost, and when it is pulled out."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.canopen.serial_adapter import SerialAdapterBus
from sim_backend.emulation.pseudo_terminal import PseudoTerminal

FRAME = b"t1818370200011D0C0000\r"
"""Identifier 0x181, eight bytes."""

LAST, LAST_IDENTIFIER = b"\rt7FF0\r", 0x7FF
PATIENCE_S = 10.0
CHARACTERS = [b"t", b"T", b"r", b"d", b"x", b"1", b"8", b"F", b"\r", b"\a", b"\xff"]


@pytest.fixture(scope="module")
def adapter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[PseudoTerminal, SerialAdapterBus]]:
    path = str(tmp_path_factory.mktemp("adapter") / "port")
    terminal = PseudoTerminal(path)
    bus = SerialAdapterBus(path, 1_000_000)
    yield terminal, bus
    bus.shutdown()
    terminal.close()


def received(adapter: tuple[PseudoTerminal, SerialAdapterBus], text: bytes) -> list[tuple[int, bytes]]:
    """Frames that come out of what an adapter writes."""
    terminal, bus = adapter
    terminal.write(text + LAST)
    found: list[tuple[int, bytes]] = []
    deadline = time.monotonic() + PATIENCE_S
    while not found or found[-1][0] != LAST_IDENTIFIER:
        assert time.monotonic() < deadline, found
        message = bus.recv(0.1)
        if message is not None:
            found.append((message.arbitration_id, bytes(message.data)))
    return found[:-1]


def test_frames_are_what_the_adapter_writes_with_or_without_a_time(adapter) -> None:
    data = bytes.fromhex("370200011D0C0000")
    assert received(adapter, FRAME + b"z\r" + FRAME[:-1] + b"1F40\r" + b"t0800\r") == [
        (0x181, data),
        (0x181, data),
        (0x080, b""),
    ]


@pytest.mark.parametrize("lost", range(len(FRAME)))
def test_a_frame_that_lacks_a_character_is_lost_and_the_next_is_not(adapter, lost: int) -> None:
    """Without its end it takes the next one with it."""
    next_frame = b"t7018FFFFFFFFFFFFFFFF\r"
    found = received(adapter, FRAME[:lost] + FRAME[lost + 1 :] + next_frame)
    assert found == ([] if lost == len(FRAME) - 1 else [(0x701, b"\xff" * 8)])


@given(
    noise=st.lists(st.sampled_from([b"t", b"T", b"r", b"d", b"x", b"1", b"8", b"F", b"\r", b"\a", b"\xff"])).map(
        b"".join
    )
)
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_text_crashes_the_reader(adapter, noise: bytes) -> None:
    assert all(identifier <= 0x1FFFFFFF for identifier, _ in received(adapter, noise))


def test_an_adapter_that_is_gone_can_be_let_go_of(tmp_path: Path) -> None:
    terminal = PseudoTerminal(str(tmp_path / "port"))
    bus = SerialAdapterBus(str(tmp_path / "port"), 1_000_000)
    terminal.close()
    bus.shutdown()
    assert not bus.serialPortOrig.is_open
    bus.shutdown()
