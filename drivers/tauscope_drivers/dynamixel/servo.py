"""A servo that was found on the bus, at its joint, and what its numbers mean there."""

import math
from dataclasses import dataclass

from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import ServoModel, find_model, find_model_by_name
from tauscope_drivers.errors import DriverError

MULTI_TURN_COUNTS = 1_048_575  # Goal Position reaches this far both ways in the current-based position mode of X and MX


@dataclass(frozen=True)
class ServoUnits:
    """What one unit of a servo means at its joint, signed where it is mounted the other way round.

    `torque_per_milliampere`: of the joint; None where the robot file does not say: no maker's figure exists [Nm/mA or
    N/mA].
    """

    radians_per_count: float
    zero_count: int
    velocity_unit: float  # joint velocity for one unit of Present Velocity, signed likewise [rad/s or m/s]
    milliampere: float  # current for one unit of Present Current, signed likewise [mA]
    source: str
    torque_per_milliampere: float | None = None

    @staticmethod
    def of(model: ServoModel, configuration: ServoConfiguration) -> "ServoUnits":
        """Units of a servo of this model at its joint. Raises ValueError where no unit of its current is known."""
        size, source = configuration.milliampere_per_unit, "robot file"
        if size is None:
            if model.current_unit is None:
                raise ValueError(f"no unit of current is known for the {model.label}")
            size, source = model.current_unit
        direction, reduction = configuration.direction, configuration.reduction
        return ServoUnits(
            radians_per_count=direction / (model.counts_per_radian * reduction),
            zero_count=model.zero_count if configuration.zero_count is None else configuration.zero_count,
            velocity_unit=direction * model.velocity_unit / reduction,
            milliampere=direction * size,
            source=source,
            torque_per_milliampere=configuration.torque_per_milliampere,
        )

    def position(self, counts: int) -> float:
        """Joint position [rad or m]."""
        return (counts - self.zero_count) * self.radians_per_count

    def counts(self, position: float) -> int:
        """Nearest count of a joint position. `position`: finite [rad or m]."""
        return round(position / self.radians_per_count) + self.zero_count

    def counts_within(self, low: float, high: float) -> tuple[int, int]:
        """Lowest and highest whole count between two positions, infinite where there is no limit [rad or m]."""
        ends = sorted((low / self.radians_per_count, high / self.radians_per_count))
        lowest = -MULTI_TURN_COUNTS if ends[0] == -math.inf else math.ceil(ends[0] - _ROUNDING) + self.zero_count
        highest = MULTI_TURN_COUNTS if ends[1] == math.inf else math.floor(ends[1] + _ROUNDING) + self.zero_count
        return lowest, highest

    def velocity(self, units: int) -> float:
        """Joint velocity [rad/s or m/s]."""
        return units * self.velocity_unit

    def velocity_cap(self, velocity: float) -> int:
        """Profile Velocity for a largest speed, which may be infinite [rad/s or m/s]; 0 means that there is none."""
        most = velocity / abs(self.velocity_unit)
        return 0 if most > _LARGEST_PROFILE else max(1, math.floor(most))

    def current(self, units: int) -> float:
        """Motor current, positive where it pushes the joint forward [mA]."""
        return units * self.milliampere

    def current_units(self, torque: float) -> int:
        """Nearest Goal Current for a joint torque. `torque`: finite [Nm or N]."""
        return round(torque / self._torque_per_unit())

    def current_cap(self, torque: float) -> int:
        """Largest whole Goal Current within a torque limit [Nm or N]; 0x7FFF where that is infinite."""
        if torque == math.inf:
            return 0x7FFF
        return min(0x7FFF, math.floor(torque / abs(self._torque_per_unit()) + _ROUNDING))

    def _torque_per_unit(self) -> float:
        if self.torque_per_milliampere is None:
            raise ValueError("the joint's torque constant is not known")
        return self.milliampere * self.torque_per_milliampere


_ROUNDING = 1e-9
_LARGEST_PROFILE = 32_767


@dataclass(frozen=True)
class JointServo:
    """A servo and what its numbers mean."""

    number: int  # of the joint, from 1
    configuration: ServoConfiguration
    model: ServoModel
    firmware: int
    units: ServoUnits

    @property
    def servo(self) -> int:
        """ID."""
        return self.configuration.servo

    @property
    def counts_per_speed_unit(self) -> float:
        """One unit of Profile Velocity [counts/s]."""
        return self.model.velocity_unit * self.model.counts_per_radian

    @property
    def label(self) -> str:
        """What messages call it."""
        return f"joint {self.configuration.joint} (servo {self.servo}, {self.model.label})"


def make_servo(number: int, configuration: ServoConfiguration, identity: tuple[int, int] | None) -> JointServo:
    """A servo with its stated identity, or the promised one. Raises DriverError ``cannot-connect``: unfit."""
    place = f"joint {configuration.joint} (servo {configuration.servo})"
    if identity is not None:
        model, firmware = find_model(*identity), identity[1]
    elif configuration.model is not None:
        model, firmware = find_model_by_name(configuration.model), 0
    else:
        raise DriverError.refusal(f"{place}: drive.model is missing; a dry run needs it")
    if configuration.model is not None and find_model_by_name(configuration.model).name != model.name:
        raise _unfit(place, f"is a {model.label}, the robot file says {configuration.model}; correct one of them")
    if not model.senses_current:
        raise _unfit(place, f"is a {model.label}, which does not measure current; use one that does (XM, XH, P, Y …)")
    if "Bus Watchdog" not in model.items:
        raise _unfit(place, f"is a {model.label} without Bus Watchdog; it would run on when the host dies")
    try:
        return JointServo(number, configuration, model, firmware, ServoUnits.of(model, configuration))
    except ValueError as error:
        raise _unfit(place, f"{error}; state drive.milliampere_per_unit") from error


def _unfit(place: str, reason: str) -> DriverError:
    return DriverError.no_connection(f"{place} {reason}")
