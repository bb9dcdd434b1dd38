"""A servo that was found on the bus, at its joint."""

from dataclasses import dataclass

from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import ServoModel, find_model, find_model_by_name
from tauscope_drivers.dynamixel.units import ServoUnits, servo_units
from tauscope_drivers.errors import DriverError, DriverErrorKind


@dataclass(frozen=True)
class JointServo:
    """A servo and what its numbers mean.

    `number`: of the joint, from 1.
    """

    number: int
    joint: str
    servo: int
    model: ServoModel
    firmware: int
    units: ServoUnits
    current_limit_ma: float | None = None

    @property
    def counts_per_speed_unit(self) -> float:
        """One unit of Profile Velocity [counts/s]."""
        return self.model.velocity_unit * self.model.counts_per_radian

    @property
    def label(self) -> str:
        """What messages call it."""
        return f"joint {self.joint} (servo {self.servo}, {self.model.label})"


def make_servo(number: int, configuration: ServoConfiguration, identity: tuple[int, int] | None) -> JointServo:
    """A servo of a joint, with the identity that it stated, or without one as its configuration promises it.

    Raises DriverError ``cannot-connect`` where not the model that the robot file names, one that senses no current or
    has no watchdog.

    `number`: of the joint, from 1.
    """
    place = f"joint {configuration.joint} (servo {configuration.servo})"
    if identity is not None:
        model, firmware = find_model(*identity), identity[1]
    elif configuration.model is not None:
        model, firmware = find_model_by_name(configuration.model), 0
    else:
        raise DriverError(DriverErrorKind.REFUSED, f"{place}: drive.model is missing; a dry run needs it")
    if configuration.model is not None and find_model_by_name(configuration.model).name != model.name:
        raise _unfit(place, f"is a {model.label}, the robot file says {configuration.model}; correct one of them")
    if not model.senses_current:
        raise _unfit(place, f"is a {model.label}, which does not measure current; use one that does (XM, XH, P, Y …)")
    if "Bus Watchdog" not in model.items:
        raise _unfit(place, f"is a {model.label} without Bus Watchdog; it would run on when the host dies")
    try:
        units = servo_units(
            model,
            direction=configuration.direction,
            reduction=configuration.reduction,
            zero_count=configuration.zero_count,
            milliampere=configuration.milliampere_per_unit,
            torque_per_milliampere=configuration.torque_per_milliampere,
        )
    except ValueError as error:
        raise _unfit(place, f"{error}; state drive.milliampere_per_unit") from error
    return JointServo(
        number,
        configuration.joint,
        configuration.servo,
        model,
        firmware,
        units,
        configuration.current_limit_ma,
    )


def _unfit(place: str, reason: str) -> DriverError:
    return DriverError(DriverErrorKind.CANNOT_CONNECT, f"{place} {reason}")
