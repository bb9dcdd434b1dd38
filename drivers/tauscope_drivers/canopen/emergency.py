"""Emergency messages and the error codes behind them (CiA 301, CiA 402), in words with a remedy."""

from tauscope_drivers.errors import HOST_REMEDY, Fault

HEARTBEAT_LOST = 0x8130  # error code of a drive that misses the master
WATCHDOG_CODE = "watchdog"  # `Fault.code` of a host that fell silent

_BLOCKED = "look for a short circuit or a blocked joint"
_SUPPLY, _COOL = "check the supply, then acknowledge", "let it cool down, then acknowledge"
_MANUAL = "see the drive's manual for the code"

# The most specific code comes first: a drive's own code falls back to its group's.
_MEANINGS: tuple[tuple[int, int, str, str, str], ...] = (
    (0xFFFF, 0x2310, "over-current", "continuous over-current", "lower the torque limit or the load, then acknowledge"),
    (0xFF00, 0x2300, "over-current", "current too high at the drive's output", _BLOCKED),
    (0xF000, 0x2000, "over-current", "current outside its range", _BLOCKED),
    (0xFFFF, 0x3210, "over-voltage", "DC link voltage too high", "brake slower, or fit a brake resistor"),
    (0xFFFF, 0x3220, "under-voltage", "DC link voltage too low", _SUPPLY),
    (0xF000, 0x3000, "voltage", "supply voltage outside its range", _SUPPLY),
    (0xFF00, 0x4300, "over-temperature", "drive too hot", _COOL),
    (0xF000, 0x4000, "over-temperature", "temperature outside its range", _COOL),
    (0xF000, 0x5000, "drive-hardware", "hardware fault of the drive", _MANUAL),
    (0xF000, 0x6000, "drive-software", "software fault of the drive", _MANUAL),
    (0xFFFF, 0x7121, "overload", "motor blocked", "free the joint, then acknowledge"),
    (0xFF00, 0x7300, "encoder", "position sensor fault", "check the encoder and its cable"),
    (0xF000, 0x7000, "module", "fault of a further module of the drive", _MANUAL),
    (0xFFFF, HEARTBEAT_LOST, WATCHDOG_CODE, "the master's heartbeat stayed away", HOST_REMEDY),
    (0xFFFF, 0x8140, "bus", "the drive came back from bus-off", "check the cable and both terminators"),
    (0xFF00, 0x8100, "bus", "communication fault", "check the cable, the terminators and the bit rate"),
    (0xFF00, 0x8400, "over-speed", "faster than allowed", "move slower, then acknowledge"),
    (0xFFFF, 0x8611, "following-error", "following error too large", "move slower or enlarge the window (0x6065)"),
    (0xFFFF, 0x8612, "position-limit", "a position limit was reached", "move the joint back by hand"),
    (0xF000, 0x8000, "monitoring", "a monitored value is outside its range", _MANUAL),
    (0xFF00, 0x9000, "external", "fault at an external input", "look at the drive's inputs, the emergency stop too"),
)


def decode_emergency(payload: bytes) -> int | None:
    """Error code of an emergency message; None where its length is not eight bytes."""
    return int.from_bytes(payload[:2], "little") if len(payload) == 8 else None


def describe_error(code: int, joint: int) -> Fault | None:
    """A fault for an error code (0x603F, or an emergency); None for 0x00xx: an error is gone. `joint`: from 1."""
    if code & 0xFF00 == 0:
        return None
    for mask, pattern, name, meaning, remedy in _MEANINGS:
        if code & mask == pattern:
            return Fault(name, joint, f"{meaning}, error code 0x{code:04X}", remedy)
    return Fault("drive", joint, f"error code 0x{code:04X}", "see the drive's manual for the code")
