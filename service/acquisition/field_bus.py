"""What every field bus can be asked beside moving an arm: who is there, what is wrong, what would be sent."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers import Backend, ControlMode, DriveLimits, DriverError
from drivers.inspection import Finding, FoundDevice, PlannedFrame, Severity
from service.errors import AcquisitionError
from service.robot import Robot

__all__ = [
    "FieldBus",
    "Finding",
    "FoundDevice",
    "FrameRequest",
    "PlannedFrame",
    "Severity",
    "drivers_words",
]


@dataclass(frozen=True, eq=False)
class FrameRequest:
    """Of which run the frames are asked for.

    mode : ControlMode
        who closes the loop
    limits : DriveLimits
        what the drives enforce
    watchdog_s : float
        time of silence after which they stop by themselves [s]
    targets : (K, n) float64
        positions of the first K cycles; the arm is supposed to stand at the first of them [rad or m]
    """

    mode: ControlMode
    limits: DriveLimits
    watchdog_s: float
    targets: NDArray[np.float64]


class FieldBus(Protocol):
    """One kind of bus. Nothing here moves an arm or writes to a drive."""

    name: str
    """As ``--backend`` calls it."""

    def is_meant(self, robot: Robot) -> bool:
        """Whether the robot file's ``drive`` blocks speak of this bus.

        Parameters
        ----------
        robot : Robot
            the arm
        """
        ...

    def backend(self, robot: Robot, settings: Mapping[str, Any], folder: Path | None) -> Backend:
        """The arm as a backend, not connected yet.

        Parameters
        ----------
        robot : Robot
            the arm
        settings : mapping
            of the backend
        folder : Path or None
            for files of its own

        Raises
        ------
        AcquisitionError
            a ``drive`` block or a setting is not valid
        """
        ...

    def adapters(self) -> list[Finding]:
        """Adapters of this machine that the bus may hang on: permissions, settings."""
        ...

    def examine(self, robot: Robot) -> list[Finding]:
        """Adapter and every drive that the robot file names.

        Parameters
        ----------
        robot : Robot
            the arm

        Raises
        ------
        AcquisitionError
            a ``drive`` block is not valid
        """
        ...

    def scan(self, port: str, bit_rates: Sequence[int] | None) -> Iterator[FoundDevice]:
        """Devices that answer, whoever they belong to.

        Parameters
        ----------
        port : str
            where the bus hangs
        bit_rates : sequence of int or None
            to try [bit/s]; the usual ones where None

        Raises
        ------
        AcquisitionError
            the port is missing, not permitted or taken
        """
        ...

    def planned_frames(self, robot: Robot, request: FrameRequest) -> Iterator[PlannedFrame]:
        """The frames of a run, without a port.

        Parameters
        ----------
        robot : Robot
            the arm
        request : FrameRequest
            which run

        Raises
        ------
        AcquisitionError
            a ``drive`` block or a limit is not possible
        """
        ...


@contextmanager
def drivers_words() -> Iterator[None]:
    """What a driver refuses becomes an error of Tauscope's, in the same words.

    Raises
    ------
    AcquisitionError
        in place of `drivers.DriverError`
    """
    try:
        yield
    except DriverError as error:
        raise AcquisitionError(str(error)) from error
