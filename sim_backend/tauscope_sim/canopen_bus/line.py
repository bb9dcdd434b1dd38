"""How frames look at the master's end of the bus: the text of a serial adapter, or the kernel's own form."""

from typing import Protocol

from tauscope_sim.canopen_bus.drive import Frame


class Line(Protocol):
    """Turns what a master sends into frames, and frames into what it reads."""

    def take(self, data: bytes) -> tuple[list[Frame], bytes]:
        """Frames for the bus, and what the adapter answers by itself."""
        ...

    def text(self, frame: Frame) -> bytes:
        """A frame of the bus as the host reads it."""
        ...
