"""What the library's control tables do not say of a servo: its unit of current, its modes, its watchdog.

Every figure has its source beside it, because what an identification finds is only as right as these.
"""

from collections.abc import Mapping
from dataclasses import dataclass

CURRENT_MODE = 0
POSITION_MODE = 3
CURRENT_BASED_POSITION_MODE = 5

WATCHDOG_STEP_S = 0.02
"""Unit of Bus Watchdog on every family [s]: e-Manual, Bus Watchdog of X, P and Y (100 is 2 000 ms)."""

WATCHDOG_MOST = 127
"""Largest value of Bus Watchdog; -1 is what it latches to."""

_ARDUINO = "ROBOTIS Dynamixel2Arduino, table of units"
_E_MANUAL = "ROBOTIS e-Manual, unit of Present Current"


@dataclass(frozen=True)
class CurrentUnit:
    """What one unit of Present Current and Goal Current is."""

    milliampere: float
    source: str


@dataclass(frozen=True)
class FamilyFacts:
    """What servos of one family have in common.

    `voltage_unit_v`: of Present Input Voltage [V].
    """

    name: str
    position_mode: int
    voltage_unit_v: float = 0.1
    error_is_code: bool = False
    torque_on_by_goal: bool = False


_X = FamilyFacts("X", CURRENT_BASED_POSITION_MODE, torque_on_by_goal=True)
_MX = FamilyFacts("MX", CURRENT_BASED_POSITION_MODE)
_P = FamilyFacts("P", POSITION_MODE)
_Y = FamilyFacts("Y", POSITION_MODE, voltage_unit_v=0.01, error_is_code=True)

_FAMILIES: tuple[tuple[str, FamilyFacts], ...] = (
    ("mx_", _MX),
    ("ym", _Y),
    ("ph", _P),
    ("pm", _P),
    ("h42", _P),
    ("h54", _P),
    ("m42", _P),
    ("m54", _P),
    ("x", _X),
    ("2x", _X),
)

_CURRENT_UNITS: tuple[tuple[str, CurrentUnit], ...] = (
    ("xh430_v", CurrentUnit(1.34, _ARDUINO)),
    ("xm430", CurrentUnit(2.69, _ARDUINO)),
    ("xh430_w", CurrentUnit(2.69, _ARDUINO)),
    ("xd430", CurrentUnit(2.69, _ARDUINO)),
    ("xw430", CurrentUnit(2.69, _ARDUINO)),
    ("xm540", CurrentUnit(2.69, _ARDUINO)),
    ("xh540", CurrentUnit(2.69, _ARDUINO)),
    ("xd540", CurrentUnit(2.69, _ARDUINO)),
    ("xw540", CurrentUnit(2.69, _ARDUINO)),
    ("xl330", CurrentUnit(1.0, _E_MANUAL)),
    ("xc330", CurrentUnit(1.0, _E_MANUAL)),
    ("mx_64", CurrentUnit(3.36, _ARDUINO)),
    ("mx_106", CurrentUnit(3.36, _ARDUINO)),
    ("ph", CurrentUnit(1.0, _E_MANUAL)),
    ("pm", CurrentUnit(1.0, _E_MANUAL)),
    ("h42", CurrentUnit(1.0, _E_MANUAL)),
    ("h54", CurrentUnit(1.0, _E_MANUAL)),
    ("m42", CurrentUnit(1.0, _E_MANUAL)),
    ("m54", CurrentUnit(1.0, _E_MANUAL)),
    ("ym", CurrentUnit(10.0, _E_MANUAL)),
)

MISSING_ITEMS: Mapping[str, Mapping[str, tuple[int, int]]] = {
    "mx_28": {"Bus Watchdog": (98, 1)},
    "mx_64": {"Bus Watchdog": (98, 1)},
    "mx_106": {"Bus Watchdog": (98, 1)},
}
"""Items that the firmware has and the library's tables leave out: e-Manual, MX(2.0), Bus Watchdog, from firmware 38."""


def family_of(model: str) -> FamilyFacts | None:
    """Facts of the family that a model belongs to; None for a family that this driver does not know."""
    return next((facts for prefix, facts in _FAMILIES if model.startswith(prefix)), None)


def gear_ratio_of(model: str) -> int:
    """Turns of the motor a turn of the horn, where the library's table counts the motor's: 1 for all but geared Y.

    A servo of the Y series divides its motor's counts and speeds by its Electronic Gear Ratio, as delivered that of its
    gear: only then are 524 288 counts a turn of the horn, as the tables have them. Source: e-Manual, YM070-210-R099,
    Resolution and Electronic GearRatio Numerator; the model's name ends in the ratio.
    """
    return int(model[-3:]) if model.startswith("ym") else 1


def current_unit_of(model: str) -> CurrentUnit | None:
    """Unit of current of a model; None where no source states one."""
    return next((unit for prefix, unit in _CURRENT_UNITS if model.startswith(prefix)), None)
