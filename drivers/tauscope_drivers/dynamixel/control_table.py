"""Control tables of the servos, from the ``.model`` files that dynamixel-sdk brings along."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import NamedTuple

from tauscope_drivers.errors import DriverError

CURRENT_MODE = 0
POSITION_MODE = 3
CURRENT_BASED_POSITION_MODE = 5

# unit of Bus Watchdog on every family [s]: e-Manual, Bus Watchdog of X, P and Y (100 is 2 000 ms)
WATCHDOG_STEP_S = 0.02
WATCHDOG_MOST = 127  # largest value of Bus Watchdog; -1 is what it latches to

_ARDUINO = "ROBOTIS Dynamixel2Arduino, table of units"
_E_MANUAL = "ROBOTIS e-Manual, unit of Present Current"


class CurrentUnit(NamedTuple):
    """What one unit of Present Current and Goal Current is."""

    milliampere: float
    source: str


@dataclass(frozen=True)
class FamilyFacts:
    """What servos of one family have in common."""

    name: str
    position_mode: int
    error_is_code: bool = False
    torque_on_by_goal: bool = False


_X = FamilyFacts("X", CURRENT_BASED_POSITION_MODE, torque_on_by_goal=True)
_MX = FamilyFacts("MX", CURRENT_BASED_POSITION_MODE)
_P = FamilyFacts("P", POSITION_MODE)
_Y = FamilyFacts("Y", POSITION_MODE, error_is_code=True)

# by the beginnings of the models' names
_PRO = ("ph", "pm", "h42", "h54", "m42", "m54")
_FAMILIES = ((("mx_",), _MX), (("ym",), _Y), (_PRO, _P), (("x", "2x"), _X))
_CURRENT_UNITS = (
    (("xh430_v",), CurrentUnit(1.34, _ARDUINO)),
    (("xm430", "xh430_w", "xd430", "xw430", "xm540", "xh540", "xd540", "xw540"), CurrentUnit(2.69, _ARDUINO)),
    (("mx_64", "mx_106"), CurrentUnit(3.36, _ARDUINO)),
    (("xl330", "xc330", *_PRO), CurrentUnit(1.0, _E_MANUAL)),
    (("ym",), CurrentUnit(10.0, _E_MANUAL)),
)

# items that the firmware has and the library's tables leave out: e-Manual, MX(2.0), Bus Watchdog, from firmware 38
MISSING_ITEMS: Mapping[str, Mapping[str, tuple[int, int]]] = {
    "mx_28": {"Bus Watchdog": (98, 1)},
    "mx_64": {"Bus Watchdog": (98, 1)},
    "mx_106": {"Bus Watchdog": (98, 1)},
}


NEWER_MODELS: Mapping[int, tuple[str, str]] = {1280: ("xw430_t200", "xw430_t200"), 1700: ("xc335_t332", "xc330_t288")}
"""Models that the library's index leaves out, each with a table of the library that holds for it.

Sources: ROBOTIS Dynamixel2Arduino, actuator.h (1280); ROBOTIS dynamixel_hardware_interface, xc335_t332.model (1700: all
items that the driver uses where the XC330-T288 has them, the unit of current left open).
"""

# PRO servos whose firmware has another control table, by model number: ROBOTIS Dynamixel2Arduino, actuator.h
LEGACY_PRO: Mapping[int, str] = {
    **{35072: "L42-10-S300-R", 37928: "L54-30-S400-R", 37896: "L54-30-S500-R", 38176: "L54-50-S290-R"},
    **{38152: "L54-50-S500-R", 43288: "M42-10-S260-R", 46096: "M54-40-S250-R", 46352: "M54-60-S250-R"},
    **{51200: "H42-20-S300-R", 53768: "H54-100-S500-R", 54024: "H54-200-S500-R"},
}


def family_of(model: str) -> FamilyFacts | None:
    """Facts of the family that a model belongs to; None for a family that this driver does not know."""
    return next((facts for beginnings, facts in _FAMILIES if model.startswith(beginnings)), None)


def gear_ratio_of(model: str) -> int:
    """Turns of the motor a turn of the horn, where the library's table counts the motor's: 1 for all but geared Y.

    A servo of the Y series divides its motor's counts and speeds by its Electronic Gear Ratio, as delivered that of its
    gear: only then are 524 288 counts a turn of the horn, as the tables have them. Source: e-Manual, YM070-210-R099,
    Resolution and Electronic GearRatio Numerator; the model's name ends in the ratio.
    """
    return int(model[-3:]) if model.startswith("ym") else 1


_SIGNED = re.compile(
    r"(Present|Goal) (Current|Velocity|Position|PWM)|(Homing|Current|Velocity|PWM) Offset"
    r"|(Position|Velocity) Trajectory|(Max|Min) Position Limit"
)

# what every cycle reads; one contiguous block on every family
STATE_ITEMS = ("Present Current", "Present Velocity", "Present Position")
BYTES_BEFORE_STATE = 3  # bytes of other items right before that block, on every family


@dataclass(frozen=True)
class Item:
    """An entry of a control table."""

    name: str
    address: int
    size: int  # [bytes]
    signed: bool

    def encode(self, value: int) -> bytes:
        """Its bytes."""
        return value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, block: bytes, start: int) -> int:
        """Its value in a block of bytes."""
        offset = self.address - start
        return int.from_bytes(block[offset : offset + self.size], "little", signed=self.signed)


def encode_items(items: Iterable[Item], values: Iterable[int]) -> bytes:
    """Bytes of neighbours in a control table."""
    return b"".join(item.encode(value) for item, value in zip(items, values, strict=True))


@dataclass(frozen=True)
class Block:
    """A stretch of a control table that is read at once."""

    address: int
    length: int  # [bytes]
    items: tuple[Item, ...]

    def decode(self, data: bytes) -> dict[str, int]:
        """Values of its items by name; empty where the data are not as long as the block."""
        if len(data) != self.length:
            return {}
        return {item.name: item.decode(data, self.address) for item in self.items}


@dataclass(frozen=True)
class ServoModel:
    """A model of servo."""

    number: int
    name: str
    family: FamilyFacts
    items: Mapping[str, Item]
    counts_per_radian: float  # of the horn [1/rad]
    zero_count: int
    velocity_unit: float  # one unit of Present Velocity [rad/s]
    current_unit: CurrentUnit | None  # one unit of Present Current; None where no source states it

    @property
    def label(self) -> str:
        """The model as printed on its case: ``XM430-W350``."""
        return describe_model(self.number)

    @property
    def senses_current(self) -> bool:
        """Whether it measures and controls current; without that nothing can be identified."""
        return "Present Current" in self.items and "Goal Current" in self.items

    @property
    def temperature_item(self) -> Item:
        """Temperature of the motor, or the only one it has."""
        return self.items.get("Present Motor Temperature") or self.items["Present Temperature"]

    @property
    def error_item(self) -> Item:
        """Where hardware errors stand."""
        return self.items.get("Hardware Error Status") or self.items["Error Code"]

    @property
    def state_block(self) -> Block:
        """Current, velocity and position."""
        return _block([self.items[name] for name in STATE_ITEMS])

    @property
    def health_blocks(self) -> tuple[Block, ...]:
        """Torque Enable, errors, watchdog, voltage and temperature."""
        others = ("Torque Enable", "Bus Watchdog", "Present Input Voltage")
        return self.blocks((self.error_item.name, self.temperature_item.name, *others))

    @property
    def watched_blocks(self) -> tuple[Block, ...]:
        """What is read in turn while the arm moves, each a short read: watchdog, errors, voltage and temperature.

        Each has a length of its own, reached with the items before it, so that a late answer to one question is never
        taken for the answer to another.
        """
        blocks: list[Block] = []
        warmth = ("Present Input Voltage", self.temperature_item.name)
        for names in (("Bus Watchdog",), (self.error_item.name,), warmth):
            block = _block([self.items[name] for name in names if name in self.items])
            while any(block.length == other.length for other in blocks):
                before = next(item for item in self.items.values() if item.address + item.size == block.address)
                block = _block([before, *block.items])
            blocks.append(block)
        return tuple(blocks)

    def blocks(self, names: Iterable[str], longest: int = 48) -> tuple[Block, ...]:
        """Items in as few stretches as are worth one read; those that the model lacks are left out."""
        wanted = sorted((self.items[name] for name in names if name in self.items), key=lambda item: item.address)
        stretches: list[list[Item]] = []
        for item in wanted:
            if stretches and item.address + item.size - stretches[-1][0].address <= longest:
                stretches[-1].append(item)
            else:
                stretches.append([item])
        return tuple(_block(items) for items in stretches)


def _block(items: Iterable[Item]) -> Block:
    ordered = sorted(items, key=lambda item: item.address)
    start = ordered[0].address
    return Block(start, ordered[-1].address + ordered[-1].size - start, tuple(ordered))


@cache
def model_names() -> Mapping[int, str]:
    """Model numbers and names of every servo that the library has a table of."""
    rows = (line.split("\t") for line in _folder().joinpath("dynamixel.model").read_text("utf-8").splitlines())
    listed = {int(row[0]): row[1].strip().removesuffix(".model") for row in rows if row[0].strip().isdigit()}
    return {number: name for number, (name, _) in NEWER_MODELS.items()} | listed


def describe_model(number: int) -> str:
    """A model as printed on its case, also where the driver does not know it."""
    if number in LEGACY_PRO:
        return f"{LEGACY_PRO[number]} (PRO with legacy firmware, not supported)"
    name = model_names().get(number)
    return f"model number {number}" if name is None else name.upper().replace("_", "-")


@cache
def find_model(number: int, firmware: int = 0) -> ServoModel:
    """The model of a number, with the table of its firmware. Raises DriverError ``cannot-connect`` without a table."""
    if number in LEGACY_PRO:
        raise DriverError.no_connection(
            f"a servo is a {describe_model(number)}: its control table is another one; update its firmware to PRO(A) "
            "where ROBOTIS offers it, or use another servo"
        )
    name = model_names().get(number)
    family = None if name is None else family_of(name)
    if name is None or family is None:
        raise DriverError.no_connection(
            f"a servo states the model number {number}, of which no control table is known; "
            "use a servo of the X, MX(2.0), P, PRO(A) or Y series, or a newer dynamixel-sdk"
        )
    sections = _sections(_table_text(name, firmware))
    rows = ((int(row[0]), int(row[1]), row[2]) for row in sections["control table"] if row[0].isdigit())
    items = {item: Item(item, at, size, _SIGNED.fullmatch(item) is not None) for at, size, item in rows}
    for missing, (address, size) in MISSING_ITEMS.get(name, {}).items():
        items.setdefault(missing, Item(missing, address, size, signed=False))
    shape = {row[0]: float(row[1]) for row in sections.get("type info", [])[1:]}
    units = {row[0]: float(row[1]) for row in sections.get("unit info", [])[1:]}
    zero, lowest = shape["value_of_zero_radian_position"], shape["value_of_min_radian_position"]
    return ServoModel(
        number=number,
        name=name,
        family=family,
        items=items,
        # From the lower half: the files give 4095, not 4096, for half a turn upwards, and six digits of π.
        counts_per_radian=(zero - lowest) / math.pi,
        zero_count=round(zero),
        velocity_unit=units.get("Present Velocity", math.nan),
        current_unit=next((unit for beginnings, unit in _CURRENT_UNITS if name.startswith(beginnings)), None),
    )


def find_model_by_name(name: str) -> ServoModel:
    """The model of a name, with its oldest firmware's table. Raises DriverError ``refused`` where there is none."""
    wanted = name.lower().replace("-", "_")
    for number, known in model_names().items():
        if wanted == known or wanted.startswith(f"{known}_"):
            return find_model(number)
    raise DriverError.refusal(f"model {name!r} is not known; write it as on the case, like XM430-W350")


def _folder() -> Traversable:
    return files("dynamixel_easy_sdk") / "control_table"


def _table_text(name: str, firmware: int) -> str:
    """Text of a model's table; some models have another from firmware 52 on."""
    substitute = dict(NEWER_MODELS.values()).get(name, name)
    names = ([f"{name}_fw52"] if firmware >= 52 else []) + [name, substitute]
    tables = (_folder().joinpath(f"{each}.model") for each in names)
    return next(table for table in tables if table.is_file()).read_text("utf-8")


def _sections(text: str) -> dict[str, list[list[str]]]:
    """Rows of each section of a ``.model`` file, its head line first."""
    _, *parts = re.split(r"^\s*\[(.+)\]\s*$", text, flags=re.MULTILINE)  # names and contents in turn
    return {
        name: [[cell.strip() for cell in line.split("\t")] for line in content.splitlines() if line.strip()]
        for name, content in zip(parts[::2], parts[1::2], strict=True)
    }
