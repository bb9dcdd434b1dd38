"""The description of a driver: its words, its options, and what it does beside moving an arm.

A driver is one package. It names one `Driver` object by the entry point ``tauscope.drivers``. The module of that object
imports bus libraries only inside its methods: choices and help read its words alone.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauscope_drivers.backend import Backend
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.inspection import Finding, FoundDevice, FrameRequest, PlannedFrame

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
    """An arm as a driver is told of it.

    `robot`: the whole robot as Tauscope reads it, for a driver that simulates it.
    `folder`: for files of the driver's own.
    """

    joints: tuple[DriveJoint, ...]
    robot: Any = None
    folder: Path | None = None


class Driver(ABC):
    """One kind of arm; moves nothing by itself."""

    name: str
    """As ``--backend`` calls it: the name of the entry point."""
    title: str
    """What the page calls it."""
    is_simulated: bool = False
    options: tuple[Option, ...] = ()
    file_keys: tuple[str, ...] = ()
    """Keys of a ``drive`` block that name a file, looked up beside the robot file."""

    @property
    def option_names(self) -> tuple[str, ...]:
        """Names of the options."""
        return tuple(option.name for option in self.options)

    @abstractmethod
    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm as a backend, not connected yet; the settings have no other names than those of `options`.

        Raises DriverError: ``refused``: a ``drive`` block or a setting is not valid.
        """


class BusDriver(Driver):
    """Drives on a field bus. Nothing here moves an arm or writes to a drive; every joint needs a ``drive`` block."""

    block_example: str
    """The least ``drive`` block, as a message shows it."""
    port_help: str
    """What ``bus scan`` takes as port."""
    neighbours: str = ""
    """Devices that hang on such a bus and do not answer this driver, in a sentence for who finds nobody."""
    bus_options: tuple[str, ...] = ()
    """Names of the options that replace a key of the first joint's ``drive`` block."""

    @abstractmethod
    def is_meant(self, block: Mapping[str, Any]) -> bool:
        """Whether a ``drive`` block speaks of this bus."""

    @abstractmethod
    def list_adapters(self) -> list[Finding]:
        """Adapters of this machine that the bus may hang on: permissions, settings."""

    @abstractmethod
    def check_blocks(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Everything doubtful in the ``drive`` blocks and the files that they name, without a port."""

    @abstractmethod
    def examine(self, joints: Sequence[DriveJoint]) -> list[Finding]:
        """Adapter and every drive that the robot file names.

        Raises DriverError: ``refused``: a ``drive`` block is not valid.
        """

    @abstractmethod
    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Devices that answer, whoever they belong to.

        Raises DriverError where the port is missing, not permitted or taken.

        `bit_rates`: to try [bit/s]; the usual ones where None.
        """

    @abstractmethod
    def plan_frames(self, joints: Sequence[DriveJoint], request: FrameRequest) -> Iterator[PlannedFrame]:
        """The frames of a run, without a port.

        Raises DriverError: ``refused``: a ``drive`` block or a limit is not possible.
        """

    def read_patience_s(self, settings: Mapping[str, Any]) -> float:
        """How much longer than it takes an answer is waited for [s].

        Raises DriverError ``refused`` where it is no time up to a second.
        """
        patience_s = settings.get(PATIENCE.name, PATIENCE.default)
        is_number = isinstance(patience_s, int | float) and not isinstance(patience_s, bool)
        if not (is_number and 0.0 < patience_s <= _LONGEST_PATIENCE_S):
            text = f"backend {self.name}: patience_s is {patience_s!r:.60}; give seconds up to 1"
            raise DriverError(DriverErrorKind.REFUSED, text)
        return float(patience_s)
