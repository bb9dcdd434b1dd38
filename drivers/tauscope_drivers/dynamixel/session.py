"""The servos of an arm as they were found on the bus, and what they had in EEPROM before a run changed it."""

import contextlib
import json
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.dynamixel.bus import ServoBus
from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import CURRENT_MODE, gear_ratio_of
from tauscope_drivers.dynamixel.group import ServoGroup
from tauscope_drivers.dynamixel.health import Health
from tauscope_drivers.dynamixel.preparation import ANSWERS_ALL, SETTINGS, RegisterWrite, commissioning_writes
from tauscope_drivers.dynamixel.servo import JointServo, make_servo
from tauscope_drivers.errors import DriverError
from tauscope_drivers.serial_servos import bus as serial_bus

# items in EEPROM that the driver changes, in the order in which they are put back: a mode resets others
CHANGED = ("Drive Mode", "Return Delay Time", "Operating Mode")
FOLDER = "TAUSCOPE_STATE"  # environment variable that names the folder, in place of ``~/.local/state/tauscope``


class OriginalSettings:
    """The settings of one servo on one port."""

    def __init__(self, port: str, servo: int) -> None:
        """Read what is kept; nothing is kept where the file is missing or damaged."""
        name = f"{os.path.realpath(port).strip('/').replace('/', '-')}-{servo}.json"
        self._path = _find_folder() / "servos" / name
        self.before: dict[str, int] = {}  # value of each changed item before the first change
        self._after: dict[str, int] = {}
        try:
            content = json.loads(self._path.read_text(encoding="utf-8"))
            before, after = (
                {item: int(value) for item, value in content[kind].items() if item in CHANGED}
                for kind in ("before", "after")
            )
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            return
        if before.keys() == after.keys():
            self.before, self._after = before, after

    def check(self, present: Mapping[str, int]) -> None:
        """Forget everything where an item is not as it was left: it is another servo, or somebody else set it."""
        if any(present.get(name) != value for name, value in self._after.items()):
            self.forget()

    def remember(self, name: str, before: int, after: int) -> None:
        """Keep a change; a disk that does not take it loses it, and the run goes on."""
        self.before.setdefault(name, before)
        self._after[name] = after
        with contextlib.suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.write_text(json.dumps({"before": self.before, "after": self._after}), encoding="utf-8")

    def forget(self) -> None:
        """They are put back, or nobody's."""
        self.before, self._after = {}, {}
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)


def _find_folder() -> Path:
    """Where it is kept; an account without a home has the folder for temporary files."""
    # systemd names the folder of a service, which has no other
    if named := os.environ.get(FOLDER) or os.environ.get("STATE_DIRECTORY"):
        return Path(named.partition(":")[0])
    try:
        return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "tauscope"
    except RuntimeError:
        return Path(tempfile.gettempdir()) / "tauscope"


ELECTRONIC_GEAR = ("Electronic GearRatio Numerator", "Electronic GearRatio Denominator")


@dataclass
class Session:
    """An arm's servos, reached."""

    bus: ServoBus
    servos: tuple[JointServo, ...]
    settings: list[dict[str, int]]
    group: ServoGroup
    health: Health
    originals: tuple[OriginalSettings, ...] = ()

    def read(self, joint: int, names: Iterable[str]) -> dict[str, int]:
        """Items of one servo. `joint`: index of the joint, from 0."""
        return read_items(self.bus, self.servos[joint], names)

    def write(self, joint: int, name: str, value: int) -> None:
        """Write an item of one servo and read it back. `joint`: index of the joint, from 0."""
        servo = self.servos[joint]
        before = self.settings[joint].get(name)
        if self.originals and name in CHANGED and before not in (None, value):
            self.originals[joint].remember(name, before, value)
        try:
            self.bus.write(servo.servo, servo.model.items[name], value)
        except DriverError as error:
            raise DriverError(error.kind, f"{servo.label}: {error}") from error
        if name in self.settings[joint]:
            self.settings[joint][name] = value

    def restore(self) -> None:
        """Put EEPROM back on servos without torque, later on others. Raises DriverError: it is not taken."""
        for joint, kept in enumerate(self.originals):
            before = kept.before
            if not before or self.read(joint, ["Torque Enable"])["Torque Enable"]:
                continue
            for name in CHANGED:
                if name in before:
                    self.bus.write(self.servos[joint].servo, self.servos[joint].model.items[name], before[name])
                    self.settings[joint][name] = before[name]
            kept.forget()

    @property
    def changes(self) -> tuple[str, ...]:
        """What was changed in EEPROM, one line a servo."""
        return tuple(
            f"joint {servo.configuration.joint}: in EEPROM until the arm is let go: "
            + ", ".join(f"{name} {self.settings[joint][name]} in place of {value}" for name, value in before.items())
            for joint, servo in enumerate(self.servos)
            if self.originals and (before := self.originals[joint].before)
        )

    def carry_out(self, joint: int, writes: Iterable[RegisterWrite]) -> None:
        """Write what a plan says, one after the other, each read back. `joint`: index of the joint, from 0."""
        for write in writes:
            self.write(joint, write.item.name, write.value)

    @property
    def enabled(self) -> NDArray[np.bool_]:
        """Whether each servo holds or drives its joint, (n,): not where it has stopped in current mode."""
        in_current_mode = np.array([settings["Operating Mode"] == CURRENT_MODE for settings in self.settings])
        return self.health.has_torque & ~(self.health.is_latched & in_current_mode)

    def read_health(self) -> None:
        """Read the health of all servos, all of it."""
        for joint, servo in enumerate(self.servos):
            for block in servo.model.health_blocks:
                self.health.take(joint, self.bus.read_block(servo.servo, block))


def open_session(bus: ServoBus, configurations: Sequence[ServoConfiguration]) -> Session:
    """Reach every servo, set what moves nothing, read its health. Raises DriverError ``cannot-connect``."""
    bus.return_delay_s = serial_bus.FACTORY_RETURN_DELAY_S
    servos = tuple(_reach(bus, number, servo) for number, servo in enumerate(configurations, 1))
    session = make_session(bus, servos, [read_settings(bus, servo) for servo in servos])
    settings = session.settings
    session.originals = tuple(OriginalSettings(bus.port.path, servo.servo) for servo in servos)
    for kept, present in zip(session.originals, settings, strict=True):
        kept.check(present)
    for joint, servo in enumerate(servos):
        holds = bool(session.health.has_torque[joint])
        session.carry_out(joint, commissioning_writes(servo, settings[joint], holds=holds))
    slowest = max(values["Return Delay Time"] for values in settings) * serial_bus.RETURN_DELAY_UNIT_S
    bus.return_delay_s = max(serial_bus.SHORTEST_RETURN_DELAY_S, slowest)
    serial_bus.learn_latency(bus.port, session.group.probe())
    return session


def make_session(bus: ServoBus, servos: Sequence[JointServo], settings: Sequence[dict[str, int]]) -> Session:
    """The servos as they are, with their health; nothing is written."""
    servos = tuple(servos)
    session = Session(bus, servos, list(settings), ServoGroup(bus, servos), Health(servos))
    session.read_health()
    return session


def read_settings(bus: ServoBus, servo: JointServo) -> dict[str, int]:
    """Settings of a servo with its table's counts and speeds. Raises DriverError ``cannot-connect``: another gear."""
    settings, gear = read_items(bus, servo, SETTINGS), read_items(bus, servo, ELECTRONIC_GEAR)
    numerator, denominator = (gear.get(name, 1) for name in ELECTRONIC_GEAR)
    ratio = gear_ratio_of(servo.model.name)
    if gear and numerator != ratio * denominator:
        raise DriverError.no_connection(
            f"{servo.label}: its Electronic GearRatio is {numerator}:{denominator}, its counts are right at {ratio}:1; "
            "set it back with the wizard, and state a reduction of your own as drive.reduction"
        )
    return settings


def read_items(bus: ServoBus, servo: JointServo, names: Iterable[str]) -> dict[str, int]:
    """Items of a servo by name."""
    wanted = tuple(names)
    try:
        return {
            name: value
            for block in servo.model.blocks(wanted)
            for name, value in bus.read_block(servo.servo, block).items()
        }
    except DriverError as error:
        raise DriverError(error.kind, f"{servo.label}: {error}") from error


def _reach(bus: ServoBus, number: int, configuration: ServoConfiguration) -> JointServo:
    identity = bus.ping(configuration.servo)
    if identity is None:
        raise DriverError.no_connection(
            f"joint {configuration.joint}: servo {configuration.servo} does not answer on {bus.port.path} at "
            f"{bus.port.baudrate} baud; check its power, cable, ID and baud rate"
        )
    servo = make_servo(number, configuration, identity)
    level = servo.model.items["Status Return Level"]
    if bus.read_once(servo.servo, level.address, level.size, serial_bus.PATIENCE_S) is None:  # it answers pings alone
        bus.sync_write([level], {servo.servo: [ANSWERS_ALL]})
    return servo
