"""Frames as dynamixel-sdk itself stuffs and checks them; nothing is shared with `tauscope_drivers.dynamixel.packets`.

Only the removal of stuffing is our own: that of dynamixel-sdk 4.1.0 compares bytes that it has overwritten.
"""

from dataclasses import dataclass

from dynamixel_sdk import Protocol2PacketHandler

BROADCAST_ID = 0xFE
_HEADER = b"\xff\xff\xfd\x00"
_STATUS = 0x55
_LONGEST = 1024
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
    """The common packet of a Fast Sync Read, cut off after the last answer; it is never stuffed.

    `length`: data of each [bytes].
    """
    total = 1 + servos * (length + 4)
    frame = bytearray([*_HEADER, BROADCAST_ID, total & 0xFF, total >> 8, _STATUS])
    for servo, error, data in answers:
        frame += bytes([error, servo]) + data
        frame += _library.updateCRC(0, frame, len(frame)).to_bytes(2, "little")
    return bytes(frame)


class InstructionParser:
    """Finds instructions in what a master sends; answers of other servos are passed over."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, received: bytes) -> list[Instruction]:
        """Instructions that are complete now."""
        self._buffer += received
        found: list[Instruction] = []
        while True:
            start = self._buffer.find(_HEADER)
            if start < 0:
                del self._buffer[: max(0, len(self._buffer) - 3)]
                return found
            del self._buffer[:start]
            if len(self._buffer) < 7:
                return found
            length = int.from_bytes(self._buffer[5:7], "little")
            end = 7 + length
            if length < 3 or end > _LONGEST:
                del self._buffer[0]
            elif len(self._buffer) < end:
                return found
            elif _library.updateCRC(0, self._buffer, end - 2) != int.from_bytes(self._buffer[end - 2 : end], "little"):
                del self._buffer[0]
            else:
                frame = list(self._buffer[:end])
                del self._buffer[:end]
                if frame[7] != _STATUS:
                    found.append(_instruction(frame))


def _instruction(frame: list[int]) -> Instruction:
    body = _remove_stuffing(frame[7:-2])
    return Instruction(frame[4], body[0], bytes(body[1:]), len(frame))


def _remove_stuffing(stuffed: list[int]) -> list[int]:
    """Byte by byte: FD after FF FF FD is left out."""
    plain: list[int] = []
    skipped = False
    for byte in stuffed:
        skipped = byte == 0xFD and not skipped and plain[-3:] == [0xFF, 0xFF, 0xFD]
        if not skipped:
            plain.append(byte)
    return plain
