"""The control table of an emulated servo: bytes, what they mean, and which of them may be written when."""

import re

from dynamixel_easy_sdk import ControlTable

from tauscope_sim.dynamixel_bus.specification import ServoSpecification

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
        self._touched: dict[tuple[int, int], list[tuple[str, int, int]]] = {}
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

    def _items_in(self, address: int, length: int) -> list[tuple[str, int, int]]:
        """Items that a stretch touches, with their first address and size; masters ask for the same ones each cycle."""
        found = self._touched.get((address, length))
        if found is None:
            found = [
                (name, start, size)
                for name, (start, size) in self.items.items()
                if start < address + length and address < start + size
            ]
            self._touched[(address, length)] = found
        return found

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
        """Refuse what the servo would refuse."""
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
        """Whether a value is within the range of an item."""
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
