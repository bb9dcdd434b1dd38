"""A claim on a CAN interface that any number of programs may open: one master at a time moves the drives on it."""

import errno
import socket
import struct
from pathlib import Path

_PEER = struct.Struct("3i")
"""The kernel's ``struct ucred``: process, user, group."""


class ClaimedError(Exception):
    """Another process has the claim; the message names it."""


class BusClaim:
    """Held from construction until `release`, or until the process ends, however it ends.

    It is the name of a socket in the abstract namespace, which the kernel keeps for one process of this machine.
    """

    def __init__(self, interface: str) -> None:
        """Claim.

        Raises
        ------
        ClaimedError
            another process has it
        """
        name = f"\0tauscope-can-{interface}"
        self._socket = socket.socket(socket.AF_UNIX)
        try:
            self._socket.bind(name)
        except OSError as error:
            self._socket.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise ClaimedError(_holder(name)) from error
        self._socket.listen(1)

    def release(self) -> None:
        """Let another process have it."""
        self._socket.close()


def _holder(name: str) -> str:
    """The process that has a name, as ``process 123 (name)``."""
    with socket.socket(socket.AF_UNIX) as visitor:
        visitor.setblocking(False)
        try:
            visitor.connect(name)
            process, _, _ = _PEER.unpack(visitor.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size))
            command = Path("/proc", str(process), "comm").read_text(encoding="utf-8").strip()
        except OSError:
            return "another process"
    return f"process {process} ({command})"
