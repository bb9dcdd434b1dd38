"""A pseudo terminal whose far end looks like a serial adapter."""

import contextlib
import errno
import fcntl
import os
import struct
import tty

_TCGETS2 = 0x802C542A
_TERMIOS2 = "=4I20B2I"


class PseudoTerminal:
    """The near end, a `Port`; a master opens the far end by the name that was linked to it.

    The far end is not kept open here, so that whoever has it open is a master.
    """

    def __init__(self, link: str) -> None:
        self._near, far = os.openpty()
        tty.setraw(far)
        self._link = link
        temporary = f"{link}.{os.getpid()}"
        os.symlink(os.ttyname(far), temporary)
        os.replace(temporary, link)
        os.close(far)
        os.set_blocking(self._near, False)

    def fileno(self) -> int:
        """Descriptor to wait on."""
        return self._near

    def read(self) -> bytes | None:
        """What a master sent; None where no master has it open."""
        try:
            return os.read(self._near, 4096)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno == errno.EIO:
                return None
            raise

    def write(self, data: bytes) -> None:
        """Send to the master; lost where there is none, or where it reads nothing."""
        with contextlib.suppress(BlockingIOError, OSError):
            os.write(self._near, data)

    @property
    def baud(self) -> int:
        """What the master has set [bit/s]."""
        settings = fcntl.ioctl(self._near, _TCGETS2, bytes(struct.calcsize(_TERMIOS2)))
        return struct.unpack(_TERMIOS2, settings)[-1]

    def close(self) -> None:
        """Hang up."""
        os.close(self._near)
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._link)
