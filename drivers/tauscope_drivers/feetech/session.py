"""The servos of an arm as they were found on the bus."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from tauscope_drivers.errors import HOST_REMEDY, DriverError, DriverErrorKind, Fault, decode_bits
from tauscope_drivers.feetech import registers
from tauscope_drivers.feetech.bus import FeetechBus
from tauscope_drivers.feetech.configuration import ServoConfiguration
from tauscope_drivers.feetech.servo import JointServo
from tauscope_drivers.serial_servos.bus import PATIENCE_S, RETURN_DELAY_UNIT_S, SHORTEST_RETURN_DELAY_S, learn_latency

_PROBES = 3  # answers by which the latency of an adapter is learnt

_WATCHDOG = Fault("watchdog", None, "no goal was sent in time; the servos hold their last one", HOST_REMEDY)
_RESTARTED = (
    "the servo has lost its torque or its limits; it lost power or was restarted",
    "check supply and cable, then acknowledge and enable again",
)

_CLEAR = "then acknowledge"

_BITS: tuple[tuple[int, str, str, str], ...] = (
    (0x01, "voltage", "supply voltage outside its limits", f"check the supply, {_CLEAR}"),
    (0x02, "encoder", "encoder fault", "switch the servo's power off and on; replace it where the fault returns"),
    (0x04, "over-temperature", "too hot", f"let it cool down, {_CLEAR}"),
    (0x08, "over-current", "too much current", f"look for an obstacle, let go of the arm, {_CLEAR}"),
    (0x20, "overload", "overload for too long", f"lower the load, let go of the arm, {_CLEAR}"),
)


def alarm_faults(alarms: int, joint: int) -> tuple[Fault, ...]:
    """Faults that alarms state; empty for 0. `alarms`: the register Status, as every answer has it; `joint`: from 1."""
    return decode_bits(_BITS, alarms, joint, "Status", "see the servo's memory table for the bits")


class Health:
    """Alarms and torque of all servos; alarms stay until they are forgotten."""

    def __init__(self, count: int) -> None:
        self.has_torque = np.zeros(count, dtype=np.bool_)
        self.alarms = [0] * count
        self.starved = False
        self._expected: list[Mapping[str, int]] = [{}] * count
        self._lost = np.zeros(count, dtype=np.bool_)

    def take_targets(self, joint: int, values: Mapping[str, int]) -> None:
        """Take torque and limits as they were read."""
        self.has_torque[joint] = bool(values["Torque Enable"])
        self._lost[joint] |= any(values[name] != value for name, value in self._expected[joint].items())

    def expect(self, joint: int, values: Mapping[str, int]) -> None:
        """State the torque and limits that a servo shall have from now on; one that has others is at fault."""
        self._expected[joint] = values

    def is_sound(self, joint: int) -> bool:
        """Whether a servo has no alarm, and its torque and limits, as far as it was asked."""
        return bool(self.has_torque[joint] and not self._lost[joint] and not self.alarms[joint])

    def forget(self) -> None:
        """The operator knows."""
        self.alarms = [0] * len(self.alarms)
        self.starved = False
        self._lost[:] = False

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Of the arm, then joint by joint."""
        found = [_WATCHDOG] if self.starved else []
        for index, alarms in enumerate(self.alarms):
            found += alarm_faults(alarms, index + 1)
            if self._lost[index] and not alarms:
                found.append(Fault("restarted", index + 1, *_RESTARTED))
        return tuple(found)


@dataclass
class Session:
    """An arm's servos, reached. `unsure`: joints whose servo missed an answer since its limits were read."""

    bus: FeetechBus
    servos: tuple[JointServo, ...]
    settings: list[dict[str, int]]  # EEPROM of each servo
    health: Health
    unsure: set[int] = field(default_factory=set)
    turn: int = 0

    @property
    def identifiers(self) -> list[int]:
        """IDs, in the order of the joints."""
        return [servo.servo for servo in self.servos]

    def read_targets(self, joint: int) -> dict[str, int]:
        """Torque, targets and limits of one servo. `joint`: index of the joint, from 0."""
        values = self._read(joint, registers.TARGETS)
        self._take_targets(joint, values)
        return values

    def read_feedback(self, joint: int) -> dict[str, int]:
        """Position, speed, load, voltage and temperature of one servo. `joint`: index of the joint, from 0."""
        return self._read(joint, registers.FEEDBACK)

    def write(self, joint: int, values: Mapping[str, int]) -> None:
        """Write registers of one servo and read them back. `joint`: index of the joint, from 0."""
        with naming(self.servos[joint]):
            self.bus.write(self.servos[joint].servo, values)

    def watch_next(self) -> None:
        """Read torque and limits of a servo once: of one that has missed an answer, else of the next in turn."""
        count = len(self.servos)
        turns = [(self.turn + step) % count for step in range(count)]
        joint = next((one for one in turns if one in self.unsure), self.turn)
        self.turn = (joint + 1) % count
        answer = self.bus.read_once(self.servos[joint].servo, registers.TARGETS)
        if answer is not None:
            self.health.alarms[joint] |= answer.alarms
            self._take_targets(joint, registers.TARGETS.decode(answer.data))

    def follows(self, joint: int) -> bool:
        """Whether a servo may be sent a goal, which might switch torque on. `joint`: index of the joint, from 0."""
        return self.health.is_sound(joint) and joint not in self.unsure

    def _read(self, joint: int, block: registers.Block) -> dict[str, int]:
        with naming(self.servos[joint]):
            alarms, values = self.bus.read(self.servos[joint].servo, block)
        self.health.alarms[joint] |= alarms
        return values

    def _take_targets(self, joint: int, values: Mapping[str, int]) -> None:
        self.health.take_targets(joint, values)
        self.unsure.discard(joint)


@contextmanager
def naming(servo: JointServo) -> Iterator[None]:
    """Say of whose servo an error is. Raises DriverError where the same, with the joint's name before it."""
    try:
        yield
    except DriverError as error:
        if error.kind is DriverErrorKind.LOST:
            raise
        message = str(error).removeprefix(f"servo {servo.servo}").removeprefix(":").strip()
        raise DriverError(error.kind, f"{servo.label} {message}", error.faults) from error


def open_session(bus: FeetechBus, configurations: Sequence[ServoConfiguration]) -> Session:
    """Reach every servo and read it, no more. Raises DriverError ``cannot-connect``: missing, or of the wrong kind."""
    found = [reach(bus, number, servo) for number, servo in enumerate(configurations, 1)]
    session = make_session(bus, found)
    answers = [bus.sync_read(session.identifiers, registers.FEEDBACK, PATIENCE_S) for _ in range(_PROBES)]
    learn_latency(bus.port, answers)
    return session


def make_session(bus: FeetechBus, found: Sequence[tuple[JointServo, dict[str, int]]]) -> Session:
    """The servos as they are, with their health."""
    servos, settings = tuple(servo for servo, _ in found), [values for _, values in found]
    slowest = max(values["Return Delay Time"] for values in settings) * RETURN_DELAY_UNIT_S
    bus.return_delay_s = max(SHORTEST_RETURN_DELAY_S, slowest)
    session = Session(bus, servos, settings, Health(len(servos)))
    for joint in range(len(servos)):
        session.read_targets(joint)
    return session


def reach(bus: FeetechBus, number: int, configuration: ServoConfiguration) -> tuple[JointServo, dict[str, int]]:
    """A servo and its EEPROM. Raises DriverError ``cannot-connect`` where it does not answer, or is of another kind."""
    servo = JointServo(number, configuration)
    if not bus.ping(servo.servo):
        raise DriverError.no_connection(
            f"{servo.label} does not answer on {bus.port.path} at {bus.port.baudrate} baud; "
            "check its power, cable, ID and baud rate"
        )
    with naming(servo):
        identity = bus.read(servo.servo, registers.IDENTITY)[1]
        if not registers.is_supported(servo.servo, identity):
            device = registers.describe_device(servo.servo, identity)
            raise DriverError.no_connection(f"is {device}; this driver knows the STS3215 alone")
        settings = bus.read(servo.servo, registers.SETTINGS)[1]
    return replace(servo, counts_per_speed_unit=registers.speed_unit(settings["Phase"])), settings
