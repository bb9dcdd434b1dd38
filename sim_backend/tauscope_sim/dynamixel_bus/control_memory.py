"""What an emulated servo is, from ROBOTIS' e-Manual and not from the driver's tables, and its control table."""

import re
from dataclasses import dataclass, field, replace
from functools import cache

from dynamixel_easy_sdk import ControlTable


@dataclass(frozen=True)
class ModelFigures:
    """What distinguishes one model of servo from another."""

    counts_per_turn: int
    zero_count: int
    velocity_unit: float  # one unit of Present Velocity [rad/s]
    milliampere: float  # one unit of Present Current [mA]
    current_limit: int  # largest Goal Current [units]
    velocity_limit: int  # [units]
    pwm_limit: int  # [units]
    modes: tuple[int, ...]
    goal_current_caps_position: bool  # whether Goal Current is the cap of mode 3 (P, Y); in mode 5 it always is
    eeprom: tuple[tuple[int, int], ...]
    gear_ratio: int = 1


# counts a turn, at zero, units of velocity and current, limits of current, velocity and PWM, modes, cap, EEPROM, gear
_X = ModelFigures(4096, 2048, 0.0239691227, 2.69, 1193, 200, 885, (0, 1, 3, 4, 5, 16), False, ((0, 64),))
_P = ModelFigures(1_003_846, 0, 0.0010471976, 1.0, 22_740, 2_900, 2_009, (0, 1, 3, 4, 16), True, ((0, 512),))
_Y_EEPROM = ((0, 8), (10, 15), (32, 152), (256, 512))
_Y = ModelFigures(524_288, 0, 0.0010471976, 10.0, 2_080, 2_020, 1_000, (0, 1, 3), True, _Y_EEPROM, 99)

# XM430-W350, XM540-W270, XL430-W250 (senses no current), XL330-M288, PH54-200-S500 and YM070-210-R099
MODELS: dict[int, ModelFigures] = {
    1020: _X,
    1120: replace(_X, current_limit=2047, velocity_limit=128),
    1060: replace(_X, current_limit=0),
    1200: replace(_X, milliampere=1.0, current_limit=1750),
    2020: _P,
    4030: _Y,
}


@dataclass(frozen=True)
class ServoSpecification:
    """One emulated servo and the joint that it moves."""

    servo: int
    model_number: int = 1020
    firmware: int = 52
    baud: int = 1_000_000  # [bit/s]
    torque_per_milliampere: float = 0.01  # at the joint [Nm/mA or N/mA]
    direction: int = 1
    reduction: float = 1.0  # turns of the horn per turn of the joint
    current_noise_ma: float = 1.0  # standard deviation of what Present Current reads while there is torque [mA]
    registers: dict[str, int] = field(default_factory=dict)

    @property
    def figures(self) -> ModelFigures:
        """Of its model."""
        return MODELS[self.model_number]

    @property
    def counts_per_radian(self) -> float:
        """Counts for one radian (metre) of the joint, signed."""
        return self.direction * self.reduction * self.figures.counts_per_turn / 6.283185307179586

    @property
    def torque_per_unit(self) -> float:
        """Joint torque of one unit of current, signed [Nm or N]."""
        return self.direction * self.figures.milliampere * self.torque_per_milliampere


RANGE_ERROR, LENGTH_ERROR, LIMIT_ERROR, ACCESS_ERROR, RESULT_FAIL = 4, 5, 6, 7, 1

GOALS = ("Goal PWM", "Goal Current", "Goal Velocity", "Goal Position")
BAUD_CODES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)

_SIGNED_STATE = ("Present PWM", "Present Current", "Present Velocity", "Present Position")
_SIGNED = frozenset((*GOALS, *_SIGNED_STATE, "Homing Offset", "Max Position Limit", "Min Position Limit"))
_READ_ONLY = re.compile(
    r"Present|Hardware Error|Error Code|Realtime|Controller State|Backup|Model|Firmware|Registered|Moving( Status)?$"
)
_SYMMETRIC = {"Goal Current": "Current Limit", "Goal PWM": "PWM Limit", "Goal Velocity": "Velocity Limit"}
_LARGEST = {"Torque Enable": 1, "Bus Watchdog": 127, "ID": 252, "Status Return Level": 2, "Return Delay Time": 254}
_FURTHEST_GOAL = 1_048_575
_SIZE = 1024


class WriteRefusedError(Exception):
    """A write that the servo does not take."""

    def __init__(self, error: int) -> None:
        super().__init__(error)
        self.error = error


class ControlMemory:
    """Items by name, bytes by address."""

    def __init__(self, specification: ServoSpecification) -> None:
        self._specification = specification
        table = ControlTable.getControlTable(specification.model_number)
        self.items = {name: (item.address, item.size) for name, item in table.items() if "Indirect" not in name}
        self._starts = {address: (name, size) for name, (address, size) in self.items.items()}
        self._values = dict.fromkeys(self.items, 0)
        self._items_in = cache(self._find_items)  # masters ask for the same ones each cycle
        self.deliver()

    def __contains__(self, name: str) -> bool:
        return name in self.items

    def get(self, name: str) -> int:
        """Value of an item; 0 where the model has none."""
        return self._values.get(name, 0)

    def put(self, name: str, value: int) -> None:
        """Set an item as the servo itself does, without asking whether it may be written."""
        if name in self.items:
            bits = 8 * self.items[name][1]
            value %= 1 << bits
            self._values[name] = value - (1 << bits) if name in _SIGNED and value >> bits - 1 else value

    def read(self, address: int, length: int) -> bytes:
        """A stretch of the table; what is not defined reads as zero."""
        if address + length > _SIZE or length == 0:
            raise WriteRefusedError(ACCESS_ERROR)
        stretch = bytearray(length)
        for name, start, size in self._items_in(address, length):
            begin, end = max(start, address), min(start + size, address + length)
            value = self._values[name].to_bytes(size, "little", signed=self._values[name] < 0)
            stretch[begin - address : end - address] = value[begin - start : end - start]
        return bytes(stretch)

    def _find_items(self, address: int, length: int) -> list[tuple[str, int, int]]:
        """Items that a stretch touches, with their first address and size."""
        return [
            (name, start, size)
            for name, (start, size) in self.items.items()
            if start < address + length and address < start + size
        ]

    def write(self, address: int, data: bytes) -> list[str]:
        """Write whole items as a master does. Raises WriteRefusedError where nothing was written."""
        wanted: list[tuple[str, int]] = []
        start = 0
        while start < len(data):
            if address + start not in self._starts:
                raise WriteRefusedError(ACCESS_ERROR)
            name, size = self._starts[address + start]
            if start + size > len(data):
                raise WriteRefusedError(LENGTH_ERROR)
            value = int.from_bytes(data[start : start + size], "little", signed=name in _SIGNED)
            self._check(name, value)
            wanted.append((name, value))
            start += size
        for name, value in wanted:
            self.put(name, value)
        return [name for name, _ in wanted]

    def deliver(self) -> None:
        """Everything as at the first power-up."""
        specification, figures = self._specification, self._specification.figures
        half = figures.counts_per_turn // 2
        eeprom = {
            "Model Number": specification.model_number,
            "Firmware Version": specification.firmware,
            "ID": specification.servo,
            "Baud Rate": BAUD_CODES.index(specification.baud),
            "Baud Rate (Bus)": BAUD_CODES.index(specification.baud),
            "Secondary ID": 255,
            "Secondary(Shadow) ID": 255,
            "Return Delay Time": 250,
            "Operating Mode": 3,
            "Protocol Type": 2,
            "Temperature Limit": 80,
            "Motor Temperature Limit": 80,
            "Max Voltage Limit": 160,
            "Min Voltage Limit": 95,
            "PWM Limit": figures.pwm_limit,
            "Current Limit": figures.current_limit,
            "Velocity Limit": figures.velocity_limit,
            "Max Position Limit": figures.zero_count + half - 1,
            "Min Position Limit": figures.zero_count - half,
            "Electronic GearRatio Numerator": figures.gear_ratio,
            "Electronic GearRatio Denominator": 1,
            "Shutdown": 0x34,
        }
        for name, value in eeprom.items():
            self.put(name, value)
        self.restart()

    def restart(self) -> None:
        """What lives in RAM as after power-up; goals are as stale as can be."""
        for name in self.items:
            if not self.is_eeprom(name):
                self._values[name] = 0
        figures = self._specification.figures
        ram = {
            "Status Return Level": 2,
            "Goal PWM": figures.pwm_limit,
            "Goal Current": figures.current_limit,
            "Goal Position": figures.zero_count,
            "Present Temperature": 30,
            "Present Motor Temperature": 30,
            "Present Inverter Temperature": 30,
            "Present Input Voltage": 120,
        }
        for name, value in {**ram, **self._specification.registers}.items():
            self.put(name, value)

    def is_eeprom(self, name: str) -> bool:
        """Whether an item survives power-off, and cannot be written under torque."""
        address = self.items[name][0]
        return any(first <= address < after for first, after in self._specification.figures.eeprom)

    def _check(self, name: str, value: int) -> None:
        if _READ_ONLY.match(name):
            raise WriteRefusedError(ACCESS_ERROR)
        if self.is_eeprom(name) and self.get("Torque Enable"):
            raise WriteRefusedError(ACCESS_ERROR)
        if name in GOALS and self.is_latched:
            raise WriteRefusedError(RANGE_ERROR)
        if not self._allows(name, value):
            raise WriteRefusedError(LIMIT_ERROR if name in GOALS else RANGE_ERROR)

    @property
    def is_latched(self) -> bool:
        """Whether the watchdog has fired and was not cleared."""
        return "Bus Watchdog" in self.items and self.get("Bus Watchdog") > 127

    def _allows(self, name: str, value: int) -> bool:
        if name in _SYMMETRIC:
            return abs(value) <= self.get(_SYMMETRIC[name])
        if name == "Profile Velocity":
            return 0 <= value <= self.get("Velocity Limit")
        if name == "Goal Position" and self.get("Operating Mode") == 3:
            return self.get("Min Position Limit") <= value <= self.get("Max Position Limit")
        if name == "Goal Position":
            return abs(value) <= _FURTHEST_GOAL
        if name == "Operating Mode":
            return value in self._specification.figures.modes
        return 0 <= value <= _LARGEST[name] if name in _LARGEST else True
