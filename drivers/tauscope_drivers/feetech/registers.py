"""The memory table of an STS3215, the units of its numbers, and other devices by the first bytes of theirs.

Source: Feetech, "STS servo memory table"; addresses and signs agree with rustypot's definition (a test compares them).
Words are little-endian, signs are a bit beside a magnitude.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

COUNTS_PER_TURN = 4096
MIDDLE_COUNT = 2048
COUNTS_PER_RADIAN = COUNTS_PER_TURN / (2.0 * math.pi)

MODEL_NUMBER = 777  # of an STS3215

# other models of the maker that answer on such a bus
NEIGHBOURS = {521: "STS3036", 2825: "STS3250", 11272: "SM8512BL", 1284: "SCS0009"}
# models of Dynamixel protocol 1.0, whose frames are the same: model number at 0, firmware at 2, ID at 3
_ROBOTIS = {
    **{12: "AX-12", 18: "AX-18A", 300: "AX-12W", 24: "RX-24F", 28: "RX-28", 64: "RX-64", 107: "EX-106"},
    **{29: "MX-28", 310: "MX-64", 320: "MX-106"},
}
TORQUE_PER_VOLT = 1.91 / 7.4  # stall torque of the horn per volt, from the data sheet at 7.4 V [Nm/V]
VOLT = 0.1  # one unit of Present Voltage and of the voltage limits [V]
PERMILLE = 1000  # Torque Limit and Present Load at full duty
LARGEST_SPEED = 32_766  # largest Goal Speed that the memory table names

POSITION_MODE = 0
MODE_NAMES = {0: "position", 1: "speed", 2: "open loop", 3: "steps"}

FINE_SPEED = 0x04  # bit of Phase: speeds are in counts/s, else in 50 counts/s
FULL_ANGLE = 0x10  # bit of Phase: Present Position counts whole turns
PROTECTIONS = 0x24  # bits of Unloading Condition: the servo lets go when it is too hot, or overloaded for too long
PROTECTIVE = 44  # Unloading Condition as delivered: heat, current, overload

_COARSE_SPEED = 50


@dataclass(frozen=True)
class Register:
    """A number in the memory table."""

    name: str
    address: int
    size: int = 1
    sign_bit: int | None = None  # bit that says that the magnitude below it is negative; None for numbers without sign

    @property
    def end(self) -> int:
        """Address behind it."""
        return self.address + self.size

    def decode(self, data: bytes) -> int:
        """Number of its bytes."""
        value = int.from_bytes(data, "little")
        if self.sign_bit is None:
            return value
        magnitude = value & (1 << self.sign_bit) - 1
        return -magnitude if value >> self.sign_bit & 1 else magnitude

    def encode(self, value: int) -> bytes:
        """Bytes of a number. Raises OverflowError where it does not fit."""
        bits = 8 * self.size if self.sign_bit is None else self.sign_bit
        if abs(value) >= 1 << bits or (value < 0 and self.sign_bit is None):
            raise OverflowError(f"{self.name} cannot hold {value}")
        sign = 1 << (self.sign_bit or 0) if value < 0 else 0
        return (abs(value) | sign).to_bytes(self.size, "little")


_ALL = (
    Register("Firmware Major Version", 0),
    Register("Firmware Minor Version", 1),
    Register("Byte Order", 2),
    Register("Model Number", 3, 2),
    Register("ID", 5),
    Register("Baud Rate", 6),
    Register("Return Delay Time", 7),
    Register("Response Status Level", 8),
    Register("Min Position Limit", 9, 2),
    Register("Max Position Limit", 11, 2),
    Register("Max Temperature Limit", 13),
    Register("Max Voltage Limit", 14),
    Register("Min Voltage Limit", 15),
    Register("Max Torque Limit", 16, 2),
    Register("Phase", 18),
    Register("Unloading Condition", 19),
    Register("P Coefficient", 21),
    Register("D Coefficient", 22),
    Register("I Coefficient", 23),
    Register("CW Dead Zone", 26),
    Register("CCW Dead Zone", 27),
    Register("Homing Offset", 31, 2, 11),
    Register("Operating Mode", 33),
    Register("Torque Enable", 40),
    Register("Acceleration", 41),
    Register("Goal Position", 42, 2, 15),
    Register("Goal Time", 44, 2),
    Register("Goal Speed", 46, 2, 15),
    Register("Torque Limit", 48, 2),
    Register("Lock", 55),
    Register("Present Position", 56, 2, 15),
    Register("Present Speed", 58, 2, 15),
    Register("Present Load", 60, 2, 10),
    Register("Present Voltage", 62),
    Register("Present Temperature", 63),
    Register("Status", 65),
    Register("Moving", 66),
)

REGISTERS = {register.name: register for register in _ALL}  # registers by name
FIRST_IN_RAM = 40  # what is written from here on is gone with the power; this driver writes nothing below


@dataclass(frozen=True)
class Block:
    """Neighbouring bytes of the memory table."""

    address: int
    length: int

    def decode(self, data: bytes) -> dict[str, int]:
        """Values of the registers that lie wholly within the bytes, which may be more than the block's."""
        return {
            register.name: register.decode(data[register.address - self.address : register.end - self.address])
            for register in _ALL
            if register.address >= self.address and register.end <= self.address + len(data)
        }


IDENTITY = Block(0, 5)
SETTINGS = Block(0, 40)  # all of the EEPROM
TARGETS = Block(40, 16)  # torque, targets and limits in RAM; longer than `FEEDBACK` with all its spare bytes
FEEDBACK = Block(56, 8)  # position, speed, load, voltage, temperature
SPARE_BYTES = 6  # so many bytes may be read behind either of them


def speed_unit(phase: int) -> int:
    """Counts per second of one unit of speed."""
    return 1 if phase & FINE_SPEED else _COARSE_SPEED


def is_supported(servo: int, identity: Mapping[str, int]) -> bool:
    """Whether it is an STS3215. `identity`: the registers of `IDENTITY`."""
    return _robotis_model(servo, identity) is None and _model_number(identity) == MODEL_NUMBER


def describe_device(servo: int, identity: Mapping[str, int]) -> str:
    """Its model, and whether the driver knows it. `identity`: the registers of `IDENTITY`."""
    if (model := _robotis_model(servo, identity)) is not None:
        return f"Dynamixel {model} (protocol 1.0, not supported)"
    number = _model_number(identity)
    if number == MODEL_NUMBER:
        return "STS3215"
    if number in NEIGHBOURS:
        return f"Feetech {NEIGHBOURS[number]} (not supported)"
    return f"model number {number} (not supported)"


def describe_firmware(identity: Mapping[str, int]) -> str:
    """Version of its firmware. `identity`: the registers of `IDENTITY`."""
    return f"{identity['Firmware Major Version']}.{identity['Firmware Minor Version']}"


def _model_number(identity: Mapping[str, int]) -> int:
    """Model number; servos of the SCS series have the high byte first, and say so."""
    number = identity["Model Number"]
    return (number & 0xFF) << 8 | number >> 8 if identity["Byte Order"] == 1 else number


def _robotis_model(servo: int, identity: Mapping[str, int]) -> str | None:
    number = identity["Firmware Major Version"] | identity["Firmware Minor Version"] << 8
    return _ROBOTIS.get(number) if identity["Model Number"] & 0xFF == servo else None
