"""Frames against the maker's own examples, a capture, and dynamixel-sdk as an oracle."""

import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import assume, given
from hypothesis import strategies as st

from tauscope_drivers.dynamixel import packets
from tauscope_drivers.dynamixel.packets import DynamixelParser, Status, checksum, decode_fast, decode_status

# ROBOTIS e-Manual, "Protocol 2.0", the examples of each instruction.
INSTRUCTIONS = {
    "ping": (packets.encode_ping(1), "FF FF FD 00 01 03 00 01 19 4E"),
    "ping all": (packets.encode_ping(), "FF FF FD 00 FE 03 00 01 31 42"),
    # of the Y series: 'ERCL' behind a 2
    "clear error": (packets.encode_clear_error(1), "FF FF FD 00 01 08 00 10 02 45 52 43 4C D5 EB"),
    "read": (packets.encode_read(1, 132, 4), "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15"),
    "write": (packets.encode_write(1, 116, b"\x00\x02\x00\x00"), "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89"),
    "sync read": (packets.encode_sync_read([1, 2], 132, 4), "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA"),
    "sync write": (
        packets.encode_sync_write({1: b"\x96\0\0\0", 2: b"\xaa\0\0\0"}, 116),
        "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
    ),
    "fast sync read": (
        packets.encode_sync_read([3, 7, 4], 132, 4, fast=True),
        "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2",
    ),
    "fast sync read of P": (
        packets.encode_sync_read([1, 2], 580, 4, fast=True),
        "FF FF FD 00 FE 09 00 8A 44 02 04 00 01 02 72 F2",
    ),
}

STATUSES = {
    "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D": Status(1, 0, b"\x06\x04\x26"),
    "FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D": Status(2, 0, b"\x06\x04\x26"),
    "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0": Status(1, 0, b"\xa6\0\0\0"),
    "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE": Status(2, 0, b"\x1f\x08\0\0"),
    "FF FF FD 00 01 04 00 55 00 A1 0C": Status(1, 0, b""),
    "FF FF FD 00 02 05 00 55 00 24 8B A9": Status(2, 0, b"\x24"),
}

# A Sync Read answer met in ordinary motion: velocity -10 and position 2045 make FF FF FD, which is stuffed.
STUFFED = bytes.fromhex("FF FF FD 00 14 0F 00 55 00 25 00 F6 FF FF FF FD FD 07 00 00 E4 3B")

# ROBOTIS e-Manual, Fast Sync Read of XC330: IDs 3, 7, 4.
FAST = bytes.fromhex("FF FF FD 00 FE 19 00 55 00 03 A6 00 00 00 84 08 00 07 1F 08 00 00 16 CA 00 04 FF 03 00 00 D1 9E")

data = st.binary(max_size=40) | st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55]), max_size=40).map(bytes)


def frames(received: bytes) -> list[bytes]:
    return list(DynamixelParser().feed(received))


@pytest.mark.parametrize("name", INSTRUCTIONS)
def test_instruction_as_in_the_manual(name: str) -> None:
    encoded, manual = INSTRUCTIONS[name]
    assert encoded.hex(" ").upper() == manual


@pytest.mark.parametrize("manual", STATUSES)
def test_status_as_in_the_manual(manual: str) -> None:
    (frame,) = frames(bytes.fromhex(manual))
    assert decode_status(frame) == STATUSES[manual]


def test_stuffed_answer_of_a_moving_servo() -> None:
    (frame,) = frames(STUFFED)
    status = decode_status(frame)
    assert status == Status(0x14, 0, bytes.fromhex("25 00 F6 FF FF FF FD 07 00 00"))


def test_fast_answers_as_in_the_manual() -> None:
    (frame,) = frames(FAST)
    assert decode_status(frame) is None
    assert decode_fast(frame, [3, 7, 4], 4) == [
        Status(3, 0, b"\xa6\0\0\0"),
        Status(7, 0, b"\x1f\x08\0\0"),
        Status(4, 0, b"\xff\x03\0\0"),
    ]


@pytest.mark.parametrize(("length", "whole"), [(0, 0), (15, 0), (16, 1), (23, 1), (24, 2), (31, 2), (32, 3)])
def test_fast_packet_that_breaks_off_keeps_those_before(length: int, whole: int) -> None:
    assert len(decode_fast(FAST[:length], [3, 7, 4], 4)) == whole


def test_fast_packet_ends_at_the_first_wrong_bit() -> None:
    for position in range(8, len(FAST)):
        damaged = bytearray(FAST)
        damaged[position] ^= 0x40
        assert len(decode_fast(bytes(damaged), [3, 7, 4], 4)) == (position - 8) // 8


@given(servo=st.integers(0, 252), error=st.integers(0, 255), parameters=data)
def test_status_that_the_library_encodes_is_understood(servo: int, error: int, parameters: bytes) -> None:
    library = Protocol2PacketHandler()
    length = len(parameters) + 4
    plain = [0xFF, 0xFF, 0xFD, 0, servo, length & 0xFF, length >> 8, 0x55, error, *parameters, 0, 0]
    stuffed = library.addStuffing(plain)
    crc = library.updateCRC(0, stuffed, len(stuffed) - 2)
    (frame,) = frames(bytes(stuffed[:-2]) + crc.to_bytes(2, "little"))
    assert decode_status(frame) == Status(servo, error, parameters)


def encoded_by_the_library(servo: int, address: int, parameters: bytes) -> bytes:
    sent: list[bytes] = []

    class Port:
        is_using = False

        def clearPort(self) -> None:  # noqa: N802
            pass

        def writePort(self, packet: list[int]) -> int:  # noqa: N802
            sent.append(bytes(packet))
            return len(packet)

    Protocol2PacketHandler().writeTxOnly(Port(), servo, address, len(parameters), list(parameters))
    return sent[0]


@given(servo=st.integers(0, 252), address=st.integers(0, 0xFFFF), parameters=data.filter(len))
def test_write_is_encoded_as_the_library_does(servo: int, address: int, parameters: bytes) -> None:
    # dynamixel-sdk 4.1.0 works out the stuffing of what it sends and forgets it: only without any is it an oracle.
    assume(b"\xff\xff\xfd" not in address.to_bytes(2, "little") + parameters)
    assert packets.encode_write(servo, address, parameters) == encoded_by_the_library(servo, address, parameters)


@given(servo=st.integers(0, 252), parameters=data.filter(len))
def test_write_is_stuffed_as_the_library_would(servo: int, parameters: bytes) -> None:
    length = len(parameters) + 5
    plain = [0xFF, 0xFF, 0xFD, 0, servo, length & 0xFF, length >> 8, 3, 116, 0, *parameters, 0, 0]
    stuffed = bytes(Protocol2PacketHandler().addStuffing(plain))
    assert packets.encode_write(servo, 116, parameters)[:-2] == stuffed[:-2]


@given(st.binary(max_size=400))
def test_checksum_is_the_librarys(frame: bytes) -> None:
    assert checksum(frame) == Protocol2PacketHandler().updateCRC(0, frame, len(frame))


@given(noise=st.binary(max_size=200), servos=st.lists(st.integers(0, 252), max_size=8), length=st.integers(0, 20))
def test_no_input_crashes_a_decoder(noise: bytes, servos: list[int], length: int) -> None:
    for received in (noise, b"\xff\xff\xfd\x00" + noise, b"\xff\xff\xfd\x00\xfe" + noise):
        decode_fast(received, servos, length)
        for frame in frames(received):
            decode_status(frame)


@given(st.lists(st.sampled_from([*map(bytes.fromhex, STATUSES), STUFFED, FAST]), max_size=5), st.data())
def test_frames_are_found_however_they_are_cut(wanted: list[bytes], draw: st.DataObject) -> None:
    stream = b"".join(wanted)
    parser, found = DynamixelParser(), []
    while stream:
        size = draw.draw(st.integers(1, len(stream)))
        found += parser.feed(stream[:size])
        stream = stream[size:]
    assert found == wanted
    assert parser.discarded == 0


# A piece of noise must not be the beginning of a frame itself, or what follows belongs to it until it is complete.
noises = st.binary(max_size=30).filter(lambda noise: b"\xff" not in noise)


@given(before=noises, between=noises)
def test_frames_are_found_in_noise(before: bytes, between: bytes) -> None:
    parser = DynamixelParser()
    assert list(parser.feed(before + STUFFED + between + FAST)) == [STUFFED, FAST]
    assert parser.discarded == len(before) + len(between)


@given(position=st.integers(0, len(STUFFED) - 1), bit=st.integers(0, 7))
def test_damaged_frame_is_let_go_and_the_next_one_found(position: int, bit: int) -> None:
    damaged = bytearray(STUFFED)
    damaged[position] ^= 1 << bit
    found = list(DynamixelParser(longest=40).feed(bytes(damaged) + STUFFED * 3))
    assert bytes(damaged) not in found
    assert found[-1:] == [STUFFED]


def test_echo_of_an_instruction_is_no_status() -> None:
    (frame,) = frames(packets.encode_read(1, 132, 4))
    assert decode_status(frame) is None


def test_alert_bit_and_refusal_are_told_apart() -> None:
    status = Status(1, 0x87, b"")
    assert status.alert
    assert status.refusal == 7
    assert not Status(1, 7, b"").alert


def test_sync_write_of_unequal_lengths_is_refused() -> None:
    with pytest.raises(ValueError, match="same number"):
        packets.encode_sync_write({1: b"\0", 2: b"\0\0"}, 64)
