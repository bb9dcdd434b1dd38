"""Frames: bytes of the maker's examples, and whatever noise surrounds them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.feetech import packets
from tauscope_drivers.feetech.packets import LONGEST_FRAME, FeetechParser, Status, decode_status

SERVOS = st.integers(0, packets.HIGHEST_ID)
DATA = st.binary(max_size=40)


def answer(servo: int, alarms: int, data: bytes) -> bytes:
    """Written out, for an answer is no instruction of the driver's."""
    body = bytes([servo, len(data) + 2, alarms]) + data
    return b"\xff\xff" + body + bytes([0xFF - sum(body) % 256])


@pytest.mark.parametrize(
    ("frame", "wire"),
    [
        (packets.encode_ping(1), "FF FF 01 02 01 FB"),
        (packets.encode_read(1, 0x38, 2), "FF FF 01 04 02 38 02 BE"),
        (packets.encode_write(1, 0x2A, bytes([0, 8, 0, 0, 0xE8, 3])), "FF FF 01 09 03 2A 00 08 00 00 E8 03 D5"),
        (packets.encode_sync_read([1, 2], 0x38, 8), "FF FF FE 06 82 38 08 01 02 36"),
        (
            packets.encode_sync_write({1: b"\x00\x08", 2: b"\x00\x08"}, 0x2A),
            "FF FF FE 0A 83 2A 02 01 00 08 02 00 08 35",
        ),
    ],
)
def test_instructions_are_the_makers(frame: bytes, wire: str) -> None:
    assert frame == bytes.fromhex(wire)


def test_servos_get_as_many_bytes_each() -> None:
    with pytest.raises(ValueError, match="same number"):
        packets.encode_sync_write({1: b"\0", 2: b"\0\0"}, 42)


@given(SERVOS, st.integers(0, 255), DATA)
def test_an_answer_comes_out_as_it_went_in(servo: int, alarms: int, data: bytes) -> None:
    (frame,) = FeetechParser().feed(answer(servo, alarms, data))
    assert decode_status(frame) == Status(servo, alarms, data)


@given(st.lists(st.tuples(SERVOS, st.integers(0, 255), DATA), max_size=5), st.data())
def test_frames_are_found_however_the_bytes_are_cut(answers: list[tuple[int, int, bytes]], data: st.DataObject) -> None:
    wire = b"".join(answer(*one) for one in answers)
    parser, found, start = FeetechParser(), [], 0
    while start < len(wire):
        end = data.draw(st.integers(start + 1, len(wire)))
        found += [decode_status(frame) for frame in parser.feed(wire[start:end])]
        start = end
    assert found == [Status(*one) for one in answers]


@given(st.binary(max_size=60), SERVOS, DATA)
def test_what_is_found_in_noise_has_a_right_checksum(noise: bytes, servo: int, data: bytes) -> None:
    for frame in FeetechParser().feed(noise + answer(servo, 0, data) + noise):
        assert frame.startswith(b"\xff\xff")
        assert sum(frame[2:]) % 256 == 255
        assert frame[3] == len(frame) - 4


@given(st.binary(max_size=20).filter(lambda noise: b"\xff" not in noise), SERVOS, st.integers(0, 63), DATA)
def test_an_answer_behind_noise_is_found(noise: bytes, servo: int, alarms: int, data: bytes) -> None:
    assert [decode_status(frame) for frame in FeetechParser().feed(noise + answer(servo, alarms, data))] == [
        Status(servo, alarms, data)
    ]


@given(SERVOS, st.integers(0, 63), st.binary(min_size=1, max_size=40), st.data())
def test_one_wrong_bit_is_never_an_answer_of_the_same_length(
    servo: int, alarms: int, sent: bytes, data: st.DataObject
) -> None:
    frame = bytearray(answer(servo, alarms, sent))
    place, bit = data.draw(st.integers(0, len(frame) - 1)), data.draw(st.integers(0, 7))
    frame[place] ^= 1 << bit
    statuses = [decode_status(found) for found in FeetechParser(len(frame)).feed(bytes(frame))]
    assert all(status is None or len(status.data) != len(sent) for status in statuses)


def test_a_damaged_length_does_not_swallow_the_next_answer() -> None:
    damaged = bytearray(answer(1, 0, b"\x01\x02"))
    damaged[3] = 0xF0
    whole = answer(2, 0, b"\x03\x04")
    assert list(FeetechParser(longest=8).feed(bytes(damaged) + whole)) == [whole]
    assert LONGEST_FRAME == 4 + 255


def test_what_is_sent_to_all_is_no_answer() -> None:
    assert decode_status(packets.encode_sync_read([1, 2, 3], 56, 8)) is None
