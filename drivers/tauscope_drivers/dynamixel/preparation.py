"""Which registers are written before a servo is given torque, in which order, and why: plain data, no port."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.dynamixel.control_table import CURRENT_MODE, WATCHDOG_MOST, WATCHDOG_STEP_S, Item
from tauscope_drivers.dynamixel.servo import MULTI_TURN_COUNTS, JointServo
from tauscope_drivers.errors import DriverError

# items that are read of each servo when it is reached
SETTINGS = (
    "Return Delay Time",
    "Drive Mode",
    "Operating Mode",
    "PWM Limit",
    "Current Limit",
    "Max Position Limit",
    "Min Position Limit",
    "Status Return Level",
    "Velocity Limit",
)
ANSWERS_ALL = 2  # Status Return Level of a servo that answers every instruction

_TIME_BASED_PROFILE = 0x04
_TORQUE_ON_BY_GOAL = 0x08
_ROUNDING = 1e-6


@dataclass(frozen=True)
class RegisterWrite:
    """A value for an item of a servo."""

    item: Item
    value: int
    reason: str


@dataclass(frozen=True)
class ServoTask:
    """What a servo shall do once it has torque."""

    mode: ControlMode
    current_cap: int  # most current [units]
    velocity_cap: int  # largest speed of its target while it tracks positions, 0 for none [units]
    present: int  # Present Position [counts]
    watchdog_steps: int
    low: int = -MULTI_TURN_COUNTS  # of Goal Position [counts]
    high: int = MULTI_TURN_COUNTS  # likewise


def operating_mode(servo: JointServo, mode: ControlMode) -> int:
    """Operating Mode of a servo for a way of control."""
    return CURRENT_MODE if mode is ControlMode.TORQUE else servo.model.family.position_mode


def drive_mode(servo: JointServo, present: int) -> int:
    """Drive Mode without time-based profiles, and without torque that a goal switches on."""
    unwanted = _TIME_BASED_PROFILE | (_TORQUE_ON_BY_GOAL if servo.model.family.torque_on_by_goal else 0)
    return present & ~unwanted


def commissioning_writes(servo: JointServo, settings: Mapping[str, int], *, holds: bool) -> list[RegisterWrite]:
    """What is written when a servo is reached; nothing that moves it, and EEPROM only where it differs."""
    wanted = [("Status Return Level", ANSWERS_ALL, "every instruction is answered")]
    if not holds:
        wanted.append(("Return Delay Time", 0, "no wait before an answer"))
        wanted.append(
            ("Drive Mode", drive_mode(servo, settings["Drive Mode"]), "no profiles by time, no torque by goals")
        )
    items = servo.model.items
    return [RegisterWrite(items[name], value, why) for name, value, why in wanted if settings[name] != value]


def preparing_writes(
    servo: JointServo, settings: Mapping[str, int], task: ServoTask, *, holds: bool
) -> list[RegisterWrite]:
    """What is written to a servo long before it is taken under power: all that does not depend on where it is then."""
    items = servo.model.items
    tracks = task.mode is ControlMode.POSITION
    wanted: list[tuple[str, int, str]] = []
    if holds and tracks:
        wanted.append(("Goal Position", task.present, "stay where it is"))
    if not holds and settings["Operating Mode"] != (mode := operating_mode(servo, task.mode)):
        wanted.append(("Operating Mode", mode, "position under a cap of current" if tracks else "current"))
    wanted.append(("Goal PWM", settings["PWM Limit"], "current is the cap, not voltage"))
    if tracks:
        wanted.append(("Profile Acceleration", 0, "follow each goal at once"))
        wanted.append(("Profile Velocity", task.velocity_cap, "largest speed"))
    current = task.current_cap if tracks else 0
    wanted.append(("Goal Current", current, "cap of current" if tracks else "no current yet"))
    return [RegisterWrite(items[name], value, why) for name, value, why in wanted]


def taking_writes(servo: JointServo, task: ServoTask, *, holds: bool) -> list[RegisterWrite]:
    """What is written to take a prepared servo under power, at once after it has told where it is."""
    items = servo.model.items
    seconds = task.watchdog_steps * WATCHDOG_STEP_S
    wanted = [("Bus Watchdog", task.watchdog_steps, f"stop after {seconds:g} s of silence")]
    if not holds:
        if task.mode is ControlMode.POSITION:
            wanted.insert(0, ("Goal Position", task.present, "stay where it is"))
        wanted.append(("Torque Enable", 1, "torque on"))
    return [RegisterWrite(items[name], value, why) for name, value, why in wanted]


def watchdog_steps(watchdog_s: float) -> int:
    """Bus Watchdog for at most a time. Raises DriverError ``refused``: shorter or longer than the servos can."""
    steps = math.floor(watchdog_s / WATCHDOG_STEP_S + _ROUNDING) if math.isfinite(watchdog_s) else 0
    if not 1 <= steps <= WATCHDOG_MOST:
        raise DriverError.refusal(
            f"a watchdog of {watchdog_s:g} s is not possible; the servos take {WATCHDOG_STEP_S:g} s to "
            f"{WATCHDOG_MOST * WATCHDOG_STEP_S:g} s"
        )
    return steps


def current_cap(servo: JointServo, settings: Mapping[str, int], torque: float) -> int:
    """Most current in all limits [units]. Raises DriverError ``refused``: none. `torque`: may be infinite [Nm or N]."""
    cap = settings["Current Limit"]
    stated_ma = servo.configuration.current_limit_ma
    if stated_ma is not None:
        cap = min(cap, math.floor(stated_ma / abs(servo.units.milliampere) + _ROUNDING))
    if torque != math.inf:
        if servo.units.torque_per_milliampere is not None:
            cap = min(cap, servo.units.current_cap(torque))
        elif stated_ma is None:
            raise DriverError.refusal(
                f"{servo.label}: a torque limit of {torque:g} Nm is no current without a torque constant; state "
                "torque_constant, or drive.current_limit_ma"
            )
    if cap <= 0:
        raise DriverError.refusal(f"{servo.label}: its limits leave no current at all; raise them")
    return cap


def velocity_cap(servo: JointServo, settings: Mapping[str, int], velocity: float) -> int:
    """Profile Velocity in both limits [units]. Raises DriverError ``refused``: none. `velocity`: may be infinite."""
    cap, own = servo.units.velocity_cap(velocity), settings.get("Velocity Limit")
    if own is None:
        return cap
    if own == 0:
        raise DriverError.refusal(f"{servo.label}: its Velocity Limit is 0; raise it with the DYNAMIXEL Wizard")
    return min(cap or own, own)


def position_counts(
    servo: JointServo, settings: Mapping[str, int], low: float, high: float, mode: ControlMode
) -> tuple[int, int]:
    """Lowest and highest Goal Position in limits, infinite where none [rad or m], and the servo's where it has them."""
    lowest, highest = servo.units.counts_within(low, high)
    if mode is ControlMode.POSITION and servo.model.family.position_mode not in _MULTI_TURN_MODES:
        return max(lowest, settings["Min Position Limit"]), min(highest, settings["Max Position Limit"])
    return lowest, highest


_MULTI_TURN_MODES = (4, 5)
