"""The adapter's end of a serial CAN line (Lawicel's ASCII protocol, which python-can calls slcan)."""

import binascii

from tauscope_sim.canopen_bus.drive import Frame

_END, _ERROR = b"\r", b"\a"
_STANDARD, _EXTENDED, _REMOTE, _EXTENDED_REMOTE = b"t", b"T", b"r", b"R"
_IDENTIFIER_DIGITS = {_STANDARD: 3, _EXTENDED: 8, _REMOTE: 3, _EXTENDED_REMOTE: 8}
_LONGEST_LINE = 32


class SerialLine:
    """Takes commands of the host, and turns frames of the bus into text.

    Commands: ``Sn`` and ``sxxyy`` set the bit rate, ``O`` and ``L`` open the channel, ``C`` closes it, ``V`` and ``N``
    ask for version and serial number, ``tiiildd…`` sends a frame. A line that is none of these is answered with a bell.
    """

    def __init__(self) -> None:
        """Closed."""
        self.is_open = False
        self._pending = b""

    def take(self, data: bytes) -> tuple[list[Frame], bytes]:
        """Frames for the bus, and what the adapter answers.

        Extended and remote frames are acknowledged and go nowhere: no drive listens to them.
        """
        *lines, self._pending = (self._pending + data).split(_END)
        if len(self._pending) > _LONGEST_LINE:
            self._pending = b""
        frames: list[Frame] = []
        answers = b""
        for line in lines:
            answers += self._obey(line, frames)
        return frames, answers

    def text(self, frame: Frame) -> bytes:
        """A frame of the bus as the host reads it; nothing where the channel is closed."""
        identifier, payload = frame
        if not self.is_open:
            return b""
        return b"t%03X%d%s" % (identifier, len(payload), binascii.hexlify(payload).upper()) + _END

    def _obey(self, line: bytes, frames: list[Frame]) -> bytes:
        """Answer to one command."""
        command = line[:1]
        if command in (b"O", b"L", b"C"):
            self.is_open = command != b"C"
            return _END
        if command in (b"S", b"s", b"Y", b"Z", b""):
            return _END
        if command == b"V":
            return b"V1013" + _END
        if command == b"N":
            return b"NTAUS" + _END
        if command in _IDENTIFIER_DIGITS and self.is_open:
            frame = _frame(line)
            if frame is None:
                return _ERROR
            if command == _STANDARD:
                frames.append(frame)
            return b"z" + _END
        return _ERROR


def _frame(line: bytes) -> Frame | None:
    """The frame that a line stands for; None where it is none."""
    digits = _IDENTIFIER_DIGITS[line[:1]]
    try:
        identifier, length = int(line[1 : 1 + digits], 16), int(line[1 + digits : 2 + digits])
        payload = b"" if line[:1] in (_REMOTE, _EXTENDED_REMOTE) else binascii.unhexlify(line[2 + digits :])
    except ValueError:
        return None
    sent = length if line[:1] in (_REMOTE, _EXTENDED_REMOTE) else len(payload)
    return (identifier, payload) if sent == length <= 8 else None
