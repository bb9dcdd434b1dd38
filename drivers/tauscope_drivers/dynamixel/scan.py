"""Who is on a bus, at any of the usual baud rates."""

from collections.abc import Iterator, Sequence

from tauscope_drivers.dynamixel.bus import ServoBus
from tauscope_drivers.dynamixel.control_table import model_names
from tauscope_drivers.dynamixel.port import SerialPort
from tauscope_drivers.inspection import FoundDevice

USUAL_BAUDS = (57_600, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 115_200, 4_500_000, 9_600)
"""Rates that servos can be set to, the factory's first [bit/s]."""


def scan_bus(path: str, bauds: Sequence[int] = USUAL_BAUDS, *, slack_s: float = 0.002) -> Iterator[FoundDevice]:
    """Every servo that answers a ping to all, one baud rate after the other; about a second each.

    Parameters
    ----------
    bauds : sequence of int
        rates to try [bit/s]
    slack_s : float
        how much longer than the bus takes an answer is waited for [s]

    Raises
    ------
    DriverError
        ``cannot-connect``: the port is missing, not permitted or taken
    """
    for baud in bauds:
        port = SerialPort(path, baud, slack_s)
        port.open()
        try:
            found = ServoBus(port).ping_all()
        finally:
            port.close()
        for servo, (number, firmware) in found.items():
            name = model_names().get(number)
            label = f"model number {number}" if name is None else name.upper().replace("_", "-")
            yield FoundDevice(servo, baud, label, str(firmware))
