"""The drives' end of a CAN bus of the kernel (SocketCAN)."""

import contextlib
import socket
import struct

from tauscope_sim.canopen_bus.drive import Frame

_FRAME = struct.Struct("=IB3x8s")
"""The kernel's ``struct can_frame``: identifier with flags, length, padding, data."""

_HIGHEST_IDENTIFIER = 0x7FF
_LONGEST = 8
_MOST_FRAMES = 1000


class CanSocket:
    """A raw socket on one interface, as a `Port`: its bytes are whole frames of the kernel's form."""

    baud = 1_000_000

    def __init__(self, interface: str) -> None:
        """Listen."""
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
        """Standard data frames for the bus; others go nowhere, for no drive listens to them."""
        frames = []
        for identifier, length, payload in _FRAME.iter_unpack(data):
            if identifier <= _HIGHEST_IDENTIFIER and length <= _LONGEST:
                frames.append((identifier, payload[:length]))
        return frames, b""

    def text(self, frame: Frame) -> bytes:
        """A frame as the kernel takes it."""
        identifier, payload = frame
        return _FRAME.pack(identifier, len(payload), payload)
