"""A serial CAN adapter: what it writes, what is left of that where characters are lost, and when it is pulled out."""

import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tauscope_drivers.canopen.interfaces import SerialAdapterBus
from tauscope_sim.emulation.emulator import PseudoTerminal

FRAME = b"t1818370200011D0C0000\r"
"""Identifier 0x181, eight bytes."""

LAST, LAST_IDENTIFIER = b"\rt7FF0\r", 0x7FF
PATIENCE_S = 10.0
CHARACTERS = [b"t", b"T", b"r", b"d", b"x", b"1", b"8", b"F", b"\r", b"\a", b"\xff"]


@pytest.fixture(scope="module", autouse=True)
def adapters_that_never_tell_their_version() -> Iterator[None]:
    """Nobody waits for long until they do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tauscope_drivers.canopen.interfaces.RESTART_S", 0.1)
        yield


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
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_text_crashes_the_reader(adapter, noise: bytes) -> None:
    assert all(identifier <= 0x1FFFFFFF for identifier, _ in received(adapter, noise))


def frame(identifier: int) -> can.Message:
    """A frame of two bytes."""
    return can.Message(arbitration_id=identifier, data=bytes([identifier, 0xAB]), is_extended_id=False)


def send_all(bus: SerialAdapterBus, *frames: can.Message) -> None:
    """Send frames in their order."""
    for each in frames:
        bus.send(each)


def test_frames_that_are_gathered_go_out_together_and_in_their_order(adapter) -> None:
    terminal, bus = adapter
    terminal.read()
    with bus.gathering():
        send_all(bus, frame(1), frame(2), frame(3))
        assert terminal.read() == b""
    assert terminal.read() == b"t001201AB\rt002202AB\rt003203AB\r"
    bus.send(frame(4))
    assert terminal.read() == b"t004204AB\r"


def test_of_gathered_frames_none_goes_out_where_one_cannot(adapter) -> None:
    """Half of the joints must not move without the others."""
    terminal, bus = adapter
    terminal.read()

    def send_one_and_fail() -> None:
        bus.send(frame(1))
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), bus.gathering():
        send_one_and_fail()
    bus.send(frame(2))
    assert terminal.read() == b"t002202AB\r"


def test_an_adapter_that_is_gone_is_an_error_for_who_reads_and_who_writes(tmp_path: Path) -> None:
    terminal = PseudoTerminal(str(tmp_path / "port"))
    bus = SerialAdapterBus(str(tmp_path / "port"), 1_000_000)
    terminal.close()
    for use in (lambda: bus.recv(PATIENCE_S), lambda: bus.send(frame(1))):
        with pytest.raises((can.CanError, OSError)):
            use()
    with pytest.raises(can.CanError), bus.gathering():
        bus.send(frame(1))
    bus.shutdown()


def test_an_adapter_that_is_gone_can_be_let_go_of(tmp_path: Path) -> None:
    terminal = PseudoTerminal(str(tmp_path / "port"))
    bus = SerialAdapterBus(str(tmp_path / "port"), 1_000_000)
    terminal.close()
    bus.shutdown()
    assert not bus.serialPortOrig.is_open
    bus.shutdown()
