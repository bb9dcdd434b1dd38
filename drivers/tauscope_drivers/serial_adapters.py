"""Serial adapters of this machine: who may open them, who holds them, how late they pass answers on."""

import os

from serial.tools.list_ports import comports

from tauscope_drivers.inspection import Finding, Severity
from tauscope_drivers.port_holder import find_holder
from tauscope_drivers.serial_port import read_latency_timer_ms


def serial_adapters() -> list[Finding]:
    """Every serial adapter: whether it may be opened, who holds it, and its latency timer."""
    found: list[Finding] = []
    for adapter in sorted(comports(), key=lambda one: one.device):
        what = adapter.description if adapter.description not in (None, "n/a", "") else "serial port"
        found.append(_access(adapter.device, what))
        if read_latency_timer_ms(adapter.device) is not None:
            found.append(latency_finding(adapter.device))
    return found


def latency_finding(path: str) -> Finding:
    """The adapter's latency timer, which caps every rate where it is long."""
    latency_ms = read_latency_timer_ms(path)
    if latency_ms is None:
        return Finding(Severity.GOOD, path, "the adapter has no latency timer")
    if latency_ms <= 1:
        return Finding(Severity.GOOD, path, f"latency timer {latency_ms} ms")
    name = os.path.basename(os.path.realpath(path))
    remedy = f"write 1 to /sys/class/tty/{name}/device/latency_timer, for good by a udev rule"
    # Two reads a cycle wait for it.
    return Finding(
        Severity.WARNING, path, f"latency timer {latency_ms} ms: no more than {500 / latency_ms:.0f} Hz", remedy
    )


def _access(path: str, what: str) -> Finding:
    """Whether this program may open a port."""
    if not os.access(path, os.R_OK | os.W_OK):
        remedy = "add your account to the group that owns it (dialout), then log in again"
        return Finding(Severity.FAILURE, path, f"{what}; may not be opened", remedy)
    holder = find_holder(path)
    if holder is not None:
        return Finding(Severity.WARNING, path, f"{what}; held by {holder}", "end that program first")
    return Finding(Severity.GOOD, path, what)
