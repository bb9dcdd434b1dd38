"""The drives' end of a CAN bus: frames on the wire, then a serial line (Lawicel's ASCII protocol), or a socket."""

import binascii
import contextlib
import socket
import struct

from tauscope_sim.canopen_bus.drive import REMOTE, Frame
from tauscope_sim.emulation.fault_kit import AnswerFaults, FaultKind, TimedQueue

_END, _ERROR = b"\r", b"\a"
_STANDARD, _EXTENDED, _REMOTE, _EXTENDED_REMOTE = b"t", b"T", b"r", b"R"
_IDENTIFIER_DIGITS = {_STANDARD: 3, _EXTENDED: 8, _REMOTE: 3, _EXTENDED_REMOTE: 8}
_LONGEST_LINE = 32
_REPLIES = {**dict.fromkeys((b"S", b"s", b"Y", b"Z", b""), b""), b"V": b"V1013", b"N": b"NTAUS"}


class SerialLine:
    """Takes commands of the host, and turns frames of the bus into text.

    Commands: ``Sn`` and ``sxxyy`` set the bit rate, ``O`` and ``L`` open the channel, ``C`` closes it, ``V`` and ``N``
    ask for version and serial number, ``tiiildd…`` sends a frame. A line that is none of these is answered with a bell.
    """

    def __init__(self) -> None:
        self.is_open = False
        self._pending = b""

    def take(self, data: bytes) -> tuple[list[Frame], bytes]:
        """Frames for the bus, and the adapter's answers. Extended frames are acknowledged and go nowhere."""
        *lines, self._pending = (self._pending + data).split(_END)
        if len(self._pending) > _LONGEST_LINE:
            self._pending = b""
        frames: list[Frame] = []
        return frames, b"".join([self._obey(line, frames) for line in lines])

    def text(self, frame: Frame) -> bytes:
        """A frame of the bus as the host reads it; nothing where the channel is closed."""
        identifier, payload = frame
        if not self.is_open:
            return b""
        return b"t%03X%d%s" % (identifier, len(payload), binascii.hexlify(payload).upper()) + _END

    def _obey(self, line: bytes, frames: list[Frame]) -> bytes:
        command = line[:1]
        if command in (b"O", b"L", b"C"):
            self.is_open = command != b"C"
            return _END
        if command in _REPLIES:
            return _REPLIES[command] + _END
        if command in _IDENTIFIER_DIGITS and self.is_open:
            frame = _frame(line)
            if frame is None:
                return _ERROR
            if command == _STANDARD:
                frames.append(frame)
            elif command == _REMOTE:
                frames.append((frame[0] | REMOTE, b""))
            return b"z" + _END
        return _ERROR


def _frame(line: bytes) -> Frame | None:
    digits, is_remote = _IDENTIFIER_DIGITS[line[:1]], line[:1] in (_REMOTE, _EXTENDED_REMOTE)
    try:
        identifier, length = int(line[1 : 1 + digits], 16), int(line[1 + digits : 2 + digits])
        payload = b"" if is_remote else binascii.unhexlify(line[2 + digits :])
    except ValueError:
        return None
    return (identifier, payload) if (is_remote or len(payload) == length) and length <= 8 else None


_FRAME = struct.Struct("=IB3x8s")  # the kernel's ``struct can_frame``: identifier with flags, length, padding, data

_HIGHEST_IDENTIFIER = 0x7FF
_LONGEST = 8
_MOST_FRAMES = 1000


class CanSocket:
    """A raw socket on one interface, as a `Port`: its bytes are whole frames of the kernel's form."""

    baud = 1_000_000

    def __init__(self, interface: str) -> None:
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.bind((interface,))
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """Descriptor to wait on."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """What came since the last call; the kernel's bus is there whether anybody else is on it or not."""
        received = bytearray()
        with contextlib.suppress(BlockingIOError):
            for _ in range(_MOST_FRAMES):
                received += self._socket.recv(_FRAME.size)
        return bytes(received)

    def write(self, data: bytes) -> None:
        """Send frames, one after the other; what the kernel has no room for is lost."""
        for start in range(0, len(data), _FRAME.size):
            with contextlib.suppress(OSError):
                self._socket.send(data[start : start + _FRAME.size])

    def close(self) -> None:
        """Leave the bus."""
        self._socket.close()


class SocketLine:
    """Frames in the kernel's form; implements `Line`."""

    def take(self, data: bytes) -> tuple[list[Frame], bytes]:
        """Standard frames for the bus; others go nowhere, for no drive listens to them."""
        frames = []
        for identifier, length, payload in _FRAME.iter_unpack(data):
            if identifier & ~REMOTE <= _HIGHEST_IDENTIFIER and length <= _LONGEST:
                frames.append((identifier, b"" if identifier & REMOTE else payload[:length]))
        return frames, b""

    def text(self, frame: Frame) -> bytes:
        """A frame as the kernel takes it."""
        identifier, payload = frame
        return _FRAME.pack(identifier, len(payload), payload)


_FRAME_BITS = 47  # of a standard frame without data, with the space behind it

_BITS_PER_STUFFED_BIT = 5.0


class Wire:
    """One CAN bus between drives and adapter: a frame after the other, the lowest identifier first.

    Where a frame is disturbed, its sender tries again by itself: a disturbance on CAN costs time and not content. What
    can be lost, doubled or late all the same is lost in the adapter.
    """

    def __init__(self, bit_rate: float) -> None:
        """Idle. `bit_rate`: infinite where frames arrive at once [bit/s]."""
        self.faults: dict[int, AnswerFaults] = {}
        self.arriving = TimedQueue[Frame]()
        self._bit_s = 1.0 / bit_rate
        self._free_s = 0.0

    def carry(self, frames: list[Frame], now_s: float) -> None:
        """Send frames of the drives, that want to be sent now, to the adapter."""
        for frame in sorted(frames):
            self.occupy(frame, now_s)
            faults = self.faults.get(frame[0] & 0x7F)
            kind = faults.next_kind() if faults and 0x180 <= frame[0] < 0x580 else None
            if kind is FaultKind.CORRUPT:  # an error frame, and the whole frame again
                self._free_s += 2.0 * self.duration_s(frame)
            for arrival_s in faults.arrivals(kind, self._free_s) if faults else [self._free_s]:
                self.arriving.put(arrival_s, frame)

    def occupy(self, frame: Frame, now_s: float) -> None:
        """Let a frame take its time."""
        self._free_s = max(now_s, self._free_s) + self.duration_s(frame)

    def duration_s(self, frame: Frame) -> float:
        """Time of a frame on the wire, with as many stuffed bits as mixed data have [s]."""
        bits = _FRAME_BITS + 8 * len(frame[1])
        return (bits + bits / (4.0 * _BITS_PER_STUFFED_BIT)) * self._bit_s
