"""A serial port that one process owns, and serial adapters: who may open and who holds them, how late they answer."""

import contextlib
import fcntl
import os
import select
import stat
import termios
import time
from pathlib import Path

import serial
from serial.tools.list_ports import comports

from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.inspection import Finding, Severity

BITS_PER_BYTE = 10  # start bit, eight bits, stop bit
LEAST_LATENCY_S = 0.001  # what an adapter adds to every answer at least [s]: one USB frame

_TTY_DEVICES = Path("/sys/class/tty")
_PROCESSES = Path("/proc")
_LONGEST_DRAIN_NS = 2_000_000
_QUIET_NS = 500_000
_PSEUDO_TERMINALS = range(136, 144)
_FORBIDDEN = "may not be opened", "add your account to the group that owns it (dialout), then log in again"


class SerialPort:
    """An exclusive serial port. `latency_s`: latency timer of the adapter, one USB frame at least [s]."""

    def __init__(self, path: str, baud: int, slack_s: float = 0.002) -> None:
        self.path = path
        self.baudrate = baud
        self.latency_s = LEAST_LATENCY_S
        self.ser: serial.Serial | None = None
        self._slack_s = slack_s

    def open(self) -> None:
        """Open the port and lock it. Raises DriverError ``cannot-connect``: missing, not permitted, or who has it."""
        self.close()
        try:
            self._claim(self.baudrate)
        except (OSError, serial.SerialException, ValueError) as error:
            raise self._refusal(error) from error
        self.latency_s = expect_latency_s(self.path)

    def close(self) -> None:
        """Let go of the port; legal at any time."""
        if self.ser is not None:
            with contextlib.suppress(OSError, serial.SerialException):
                self.ser.close()
        self.ser = None

    def send(self, frame: bytes) -> None:
        """Discard unread input, so that no late answer is taken for the next one, and send a frame."""
        serial_port = self._require_open()
        try:
            serial_port.reset_input_buffer()
            serial_port.write(frame)
        except (OSError, serial.SerialException, termios.error) as error:
            raise self._report_loss(error) from error

    def receive(self, deadline_ns: int) -> bytes:
        """What comes first, or nothing by the deadline."""
        serial_port = self._require_open()
        wait_s = (deadline_ns - time.monotonic_ns()) * 1e-9
        try:
            if not select.select([serial_port.fileno()], [], [], max(0.0, wait_s))[0]:
                return b""
            received = os.read(serial_port.fileno(), 4096)
        except (OSError, serial.SerialException, ValueError) as error:
            raise self._report_loss(error) from error
        if not received:
            raise self._report_loss(OSError("the device is gone"))
        return received

    def drain(self) -> None:
        """Wait until nothing comes any more, two milliseconds at most, and forget what came."""
        end_ns = time.monotonic_ns() + _LONGEST_DRAIN_NS
        while time.monotonic_ns() < end_ns and self.receive(time.monotonic_ns() + _QUIET_NS):
            pass

    def reply_deadline_ns(self, byte_count: int, delay_s: float = 0.0) -> int:
        """Instant by which so many bytes have passed, out and back."""
        wire_s = byte_count * BITS_PER_BYTE / self.baudrate
        return time.monotonic_ns() + round((wire_s + delay_s + 2.0 * self.latency_s + self._slack_s) * 1e9)

    def _claim(self, baud: int) -> None:
        """Open the device, lock it, and ask its driver for low latency."""
        self.ser = serial.Serial(self.path, baud, timeout=0, exclusive=True)
        status = os.fstat(self._require_open().fileno())
        if not (stat.S_ISCHR(status.st_mode) and os.major(status.st_rdev) in _PSEUDO_TERMINALS):
            # The flag of a pseudo terminal would outlive a killed owner, for its emulator keeps it open.
            fcntl.ioctl(self.ser.fileno(), termios.TIOCEXCL)
            with contextlib.suppress(OSError, ValueError, serial.SerialException):
                self.ser.set_low_latency_mode(True)
        self.ser.reset_input_buffer()

    def _require_open(self) -> serial.Serial:
        if self.ser is None:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, f"port {self.path} is not open; connect first")
        return self.ser

    def _refusal(self, error: Exception) -> DriverError:
        holder = find_holder(self.path) if os.path.exists(self.path) else None
        self.close()
        if not os.path.exists(self.path):
            reason, remedy = "is not there", "check the cable and the name of the port"
        elif holder is not None:
            reason, remedy = f"is held by {holder}", "end that program first"
        elif not os.access(self.path, os.R_OK | os.W_OK):
            reason, remedy = _FORBIDDEN
        else:
            reason, remedy = f"cannot be opened ({' '.join(str(error).split())})", "check the device and its baud rate"
        return DriverError.no_connection(f"port {self.path} {reason}; {remedy}")

    def _report_loss(self, error: Exception) -> DriverError:
        reason = " ".join(str(error).split())
        return DriverError(
            DriverErrorKind.LOST, f"port {self.path} is gone ({reason}); check the adapter, its cable and its power"
        )


def read_latency_timer_ms(path: str) -> int | None:
    """Latency timer of a USB adapter [ms]; None where the device has none."""
    name = os.path.basename(os.path.realpath(path))
    try:
        return int((_TTY_DEVICES / name / "device" / "latency_timer").read_text())
    except (OSError, ValueError):
        return None


def expect_latency_s(path: str) -> float:
    """What an adapter adds to every answer, by its timer: one USB frame at least [s]."""
    return max(LEAST_LATENCY_S, (read_latency_timer_ms(path) or 0) * 1e-3)


def find_holder(path: str) -> str | None:
    """Who has a port open, as ``process 123 (name)``; None where none is seen: others' processes show no files."""
    try:
        wanted = os.stat(path).st_rdev
    except OSError:
        return None
    for entry in _PROCESSES.iterdir():
        if entry.name.isdigit() and _has_open(entry, wanted):
            return f"process {entry.name} ({_name(entry)})"
    return None


def _has_open(process: Path, device: int) -> bool:
    with contextlib.suppress(OSError):
        for descriptor in (process / "fd").iterdir():
            with contextlib.suppress(OSError):
                if device and os.stat(descriptor).st_rdev == device:
                    return True
    return False


def _name(process: Path) -> str:
    try:
        return (process / "comm").read_text().strip() or "unnamed"
    except OSError:
        return "unnamed"


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
    if not os.access(path, os.R_OK | os.W_OK):
        reason, remedy = _FORBIDDEN
        return Finding(Severity.FAILURE, path, f"{what}; {reason}", remedy)
    holder = find_holder(path)
    if holder is not None:
        return Finding(Severity.WARNING, path, f"{what}; held by {holder}", "end that program first")
    return Finding(Severity.GOOD, path, what)
