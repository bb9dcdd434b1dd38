"""The description of a driver: its words, its options, and what it does beside moving an arm.

A driver is one package, whose module ``driver`` holds one `Driver` object. An entry point ``tauscope.drivers`` names
that object. The module imports bus libraries only inside its methods: choices and help read its words alone.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from tauscope_drivers.backend import Backend
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, FoundDevice, FrameRequest, PlannedFrame, failure

_LONGEST_PATIENCE_S = 1.0


@dataclass(frozen=True)
class Option:
    """A setting of a driver; None as default where the robot file or the driver decides."""

    name: str
    help: str
    default: Any = None


PATIENCE = Option("patience_s", "how much longer than the bus takes an answer is waited for [s]", 0.002)


@dataclass(frozen=True)
class Connection:
    """A backend, not connected yet, and whether its clock is the machine's."""

    backend: Backend
    is_real_time: bool


@dataclass(frozen=True)
class ArmDescription:
    """An arm as a driver is told of it."""

    joints: tuple[DriveJoint, ...]
    robot: Any = None  # the whole robot as Tauscope reads it, for a driver that simulates it
    folder: Path | None = None  # for files of the driver's own


class Driver(ABC):
    """One kind of arm; moves nothing by itself."""

    name: str  # as ``--backend`` calls it: the name of the entry point
    title: str  # what the page calls it
    is_simulated: bool = False
    options: tuple[Option, ...] = ()
    file_keys: tuple[str, ...] = ()  # keys of a ``drive`` block that name a file, looked up beside the robot file

    @property
    def option_names(self) -> tuple[str, ...]:
        """Names of the options."""
        return tuple(option.name for option in self.options)

    @abstractmethod
    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm as a backend, not connected yet. Raises DriverError ``refused``: a block or setting is invalid."""


class BusDriver(Driver):
    """Drives on a field bus. Nothing here moves an arm or writes to a drive; every joint needs a ``drive`` block.

    The driver's folder holds ``configuration.read_configuration``, ``doctor.examine`` and ``doctor.scan_bus``, and
    ``dry_run.plan_frames``, with the arguments of the methods here that call them.
    """

    id_key: str  # key by which a ``drive`` block speaks of this bus
    block_example: str  # the least ``drive`` block, as a message shows it
    port_help: str  # what ``bus scan`` takes as port; drivers that state the same share a kind of bus
    answering: str = ""  # devices that answer a scan, for who finds nobody with another driver of the same kind of bus
    neighbours: str = ""  # devices that hang on such a bus and answer no driver, in a sentence for who finds nobody
    bus_options: tuple[str, ...] = ()  # names of the options that replace a key of the first joint's ``drive`` block

    def is_meant(self, block: Mapping[str, Any]) -> bool:
        """Whether a ``drive`` block speaks of this bus."""
        return self.id_key in block

    @abstractmethod
    def list_adapters(self) -> list[Finding]:
        """Adapters of this machine that the bus may hang on: permissions, settings."""

    def check_blocks(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Everything doubtful in the ``drive`` blocks and the files that they name, without a port."""
        try:
            self.load("configuration").read_configuration(joints)
        except DriverError as error:
            return [failure(self.name, str(error))]
        return []

    def examine(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Adapter and every drive that the robot file names. Raises DriverError ``refused``: a block is not valid."""
        return self.load("doctor").examine(joints)

    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Devices that answer. Raises DriverError: no such port, or taken. `bit_rates`: None: the usual [bit/s]."""
        return self.load("doctor").scan_bus(port, bit_rates)

    def plan_frames(self, joints: Sequence[DriveJoint], request: FrameRequest) -> Iterator[PlannedFrame]:
        """The frames of a run, without a port. Raises DriverError ``refused``: a block or a limit is not possible."""
        return self.load("dry_run").plan_frames(joints, request)

    def load(self, module: str) -> Any:
        """A module of the driver's own folder, loaded when it is needed."""
        return import_module(f".{module}", type(self).__module__.rpartition(".")[0])

    def read_patience_s(self, settings: Mapping[str, Any]) -> float:
        """How much longer an answer is waited for [s]. Raises DriverError ``refused`` beyond a second."""
        patience_s = settings.get(PATIENCE.name, PATIENCE.default)
        is_number = isinstance(patience_s, int | float) and not isinstance(patience_s, bool)
        if not (is_number and 0.0 < patience_s <= _LONGEST_PATIENCE_S):
            raise DriverError.refusal(f"backend {self.name}: patience_s is {patience_s!r:.60}; give seconds up to 1")
        return float(patience_s)


class SerialBusDriver(BusDriver):
    """Servos on a serial bus."""

    options = (Option("port", "serial device, in place of the robot file's"), PATIENCE)
    port_help = "serial device"
    bus_options = ("port",)

    def list_adapters(self) -> list[Finding]:
        """Serial ports of this machine."""
        return import_module("tauscope_drivers.serial_port").serial_adapters()
