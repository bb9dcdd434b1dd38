"""Entries of the object dictionary that the driver uses: communication profile CiA 301, drive profile CiA 402."""

from collections.abc import Container, Mapping
from dataclasses import dataclass

from tauscope_drivers.backend import ControlMode


@dataclass(frozen=True)
class DriveObject:
    """One entry of the object dictionary."""

    name: str
    index: int
    subindex: int
    bits: int
    signed: bool = False

    def __hash__(self) -> int:
        """By its place alone: a cycle looks values up by it a hundred times, and all fields take longer."""
        return self.index << 8 | self.subindex

    @property
    def mapping(self) -> int:
        """The entry as a PDO mapping parameter holds it: index, subindex, length."""
        return self.index << 16 | self.subindex << 8 | self.bits

    def __str__(self) -> str:
        return f"{self.name} (0x{self.index:04X}:{self.subindex:02X})"


DEVICE_TYPE = DriveObject("Device type", 0x1000, 0, 32)
DEVICE_NAME = DriveObject("Device name", 0x1008, 0, 0)
SOFTWARE_VERSION = DriveObject("Software version", 0x100A, 0, 0)
GUARD_TIME = DriveObject("Guard time", 0x100C, 0, 16)
LIFE_TIME_FACTOR = DriveObject("Life time factor", 0x100D, 0, 8)
CONSUMER_HEARTBEAT = DriveObject("Consumer heartbeat time", 0x1016, 1, 32)
PRODUCER_HEARTBEAT = DriveObject("Producer heartbeat time", 0x1017, 0, 16)
VENDOR = DriveObject("Vendor-ID", 0x1018, 1, 32)
PRODUCT = DriveObject("Product code", 0x1018, 2, 32)
REVISION = DriveObject("Revision number", 0x1018, 3, 32)

ABORT_CONNECTION = DriveObject("Abort connection option code", 0x6007, 0, 16, signed=True)
ERROR_CODE = DriveObject("Error code", 0x603F, 0, 16)
CONTROLWORD = DriveObject("Controlword", 0x6040, 0, 16)
STATUSWORD = DriveObject("Statusword", 0x6041, 0, 16)
QUICK_STOP_OPTION = DriveObject("Quick stop option code", 0x605A, 0, 16, signed=True)
FAULT_REACTION_OPTION = DriveObject("Fault reaction option code", 0x605E, 0, 16, signed=True)
MODE_OF_OPERATION = DriveObject("Modes of operation", 0x6060, 0, 8, signed=True)
MODE_DISPLAY = DriveObject("Modes of operation display", 0x6061, 0, 8, signed=True)
POSITION_ACTUAL = DriveObject("Position actual value", 0x6064, 0, 32, signed=True)
VELOCITY_ACTUAL = DriveObject("Velocity actual value", 0x606C, 0, 32, signed=True)
TARGET_TORQUE = DriveObject("Target torque", 0x6071, 0, 16, signed=True)
LARGEST_TORQUE = DriveObject("Max torque", 0x6072, 0, 16)
RATED_CURRENT = DriveObject("Motor rated current", 0x6075, 0, 32)
RATED_TORQUE = DriveObject("Motor rated torque", 0x6076, 0, 32)
TORQUE_ACTUAL = DriveObject("Torque actual value", 0x6077, 0, 16, signed=True)
TARGET_POSITION = DriveObject("Target position", 0x607A, 0, 32, signed=True)
LOWEST_POSITION = DriveObject("Software position limit, lowest", 0x607D, 1, 32, signed=True)
HIGHEST_POSITION = DriveObject("Software position limit, highest", 0x607D, 2, 32, signed=True)
INTERPOLATION_DATA = DriveObject("Interpolation data record", 0x60C1, 1, 32, signed=True)
INTERPOLATION_VALUE = DriveObject("Interpolation time period, value", 0x60C2, 1, 8)
INTERPOLATION_EXPONENT = DriveObject("Interpolation time period, exponent", 0x60C2, 2, 8, signed=True)
SUPPORTED_MODES = DriveObject("Supported drive modes", 0x6502, 0, 32)

# mode of operation: interpolated position, which older drives have in place of the cyclic one
INTERPOLATED_POSITION = 7
CYCLIC_POSITION = 8  # mode of operation: cyclic synchronous position
CYCLIC_TORQUE = 10  # mode of operation: cyclic synchronous torque


# modes of operation, the best first, and the target of each
TARGETS: Mapping[ControlMode, Mapping[int, DriveObject]] = {
    ControlMode.POSITION: {CYCLIC_POSITION: TARGET_POSITION, INTERPOLATED_POSITION: INTERPOLATION_DATA},
    ControlMode.TORQUE: {CYCLIC_TORQUE: TARGET_TORQUE},
}


def select_modes(supported: int) -> dict[ControlMode, int]:
    """Mode of operation for each control mode that a drive has. `supported`: 0x6502; bit n - 1 stands for mode n."""
    found = {
        mode: next((number for number in targets if supported >> (number - 1) & 1), None)
        for mode, targets in TARGETS.items()
    }
    return {mode: number for mode, number in found.items() if number is not None}


# optional objects, and what is done where one is absent
SUBSTITUTES: Mapping[DriveObject, str] = {
    ABORT_CONNECTION: (
        "by the standard it goes into fault when the host is silent; make sure of that with the arm supported"
    ),
    QUICK_STOP_OPTION: (
        "a quick stop ends without power, so Tauscope brakes and holds by targets; if the host is gone, the drive "
        "lets go of the joint"
    ),
    FAULT_REACTION_OPTION: "its reaction to a fault is the maker's",
    LARGEST_TORQUE: "Tauscope stops the arm where the measured torque exceeds the joint's limit",
    LOWEST_POSITION: "Tauscope keeps the targets within the joint's range",
    HIGHEST_POSITION: "Tauscope keeps the targets within the joint's range",
    VELOCITY_ACTUAL: "no velocity is recorded, and the arm runs in position mode alone",
    ERROR_CODE: "errors are known by emergency messages alone",
    PRODUCER_HEARTBEAT: "a restart of the drive shows in its power state alone",
    INTERPOLATION_VALUE: "it finds the cycle from SYNC",
}
# optional objects that the driver sets; one that is read-only counts as absent
WRITTEN = frozenset(SUBSTITUTES) - {VELOCITY_ACTUAL, ERROR_CODE}


STAYING_OPTIONS = range(5, 9)  # quick stop options (0x605A) after which a drive keeps its power

GUARDING = (GUARD_TIME, LIFE_TIME_FACTOR)
GUARDED = f"has no {CONSUMER_HEARTBEAT}: the host guards it by remote frames (0x100C, 0x100D)"

# optional objects without which an operator has to try how the arm stops
DOUBTFUL = (ABORT_CONNECTION, QUICK_STOP_OPTION)


def describe_absent(present: Container[DriveObject]) -> list[str]:
    """One line for each optional object that a drive does not have."""
    lines: dict[str, list[str]] = {}
    for entry, substitute in SUBSTITUTES.items():
        if entry not in present:
            lines.setdefault(substitute, []).append(str(entry))
    return [f"has no {' and '.join(names)}: {substitute}" for substitute, names in lines.items()]
