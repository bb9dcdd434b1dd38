"""What every field bus can be asked beside moving an arm: who is there, what is wrong, what would be sent."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import AcquisitionError
from tauscope.robot import Joint, Robot
from tauscope.robot.messages import nearest, shown
from tauscope_drivers import Backend, ControlMode, DriveLimits, DriverError
from tauscope_drivers.inspection import Finding, FoundDevice, PlannedFrame, Severity

__all__ = [
    "FieldBus",
    "Finding",
    "FoundDevice",
    "FrameRequest",
    "PlannedFrame",
    "Severity",
    "check_settings",
    "drive_blocks",
    "drivers_words",
]

_LONGEST_PATIENCE_S = 1.0
_USUAL_PATIENCE_S = 0.002


@dataclass(frozen=True, eq=False)
class FrameRequest:
    """Of which run the frames are asked for.

    watchdog_s : float
        time of silence after which they stop by themselves [s]
    targets : (K, n) float64
        positions of the first K cycles; the arm is supposed to stand at the first of them [rad or m]
    cycle_s : float or None
        time between them; None where it is not known [s]
    """

    mode: ControlMode
    limits: DriveLimits
    watchdog_s: float
    targets: NDArray[np.float64]
    cycle_s: float | None = None


class FieldBus(Protocol):
    """One kind of bus. Nothing here moves an arm or writes to a drive."""

    name: str
    """As ``--backend`` calls it."""

    def is_meant(self, robot: Robot) -> bool:
        """Whether the robot file's ``drive`` blocks speak of this bus."""
        ...

    def backend(self, robot: Robot, settings: Mapping[str, Any], folder: Path | None) -> Backend:
        """The arm as a backend, not connected yet.

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

        Raises
        ------
        AcquisitionError
            a ``drive`` block or a limit is not possible
        """
        ...


def check_settings(bus: str, settings: Mapping[str, Any], known: Sequence[str]) -> float:
    """Patience of a bus: how much longer than it takes an answer is waited for [s].

    Raises
    ------
    AcquisitionError
        one is unknown, or the patience is no such time
    """
    names = (*known, "patience_s")
    for key in settings:
        if key not in names:
            raise AcquisitionError(f"backend {bus}: unknown setting {shown(key)}; {nearest(key, names)}")
    patience_s = settings.get("patience_s", _USUAL_PATIENCE_S)
    is_number = isinstance(patience_s, int | float) and not isinstance(patience_s, bool)
    if not (is_number and 0.0 < patience_s <= _LONGEST_PATIENCE_S):
        raise AcquisitionError(f"backend {bus}: patience_s is {shown(patience_s)}; give seconds up to 1")
    return float(patience_s)


def drive_blocks(robot: Robot, example: str, bus_settings: Mapping[str, Any]) -> list[tuple[Joint, dict[str, Any]]]:
    """Every joint with its ``drive`` block; the first of them says which bus.

    Raises
    ------
    AcquisitionError
        a joint has no ``drive`` block
    """
    pairs: list[tuple[Joint, dict[str, Any]]] = []
    for joint in robot.joints:
        if joint.drive is None:
            raise AcquisitionError(
                f"{robot.name}: {joint.name} has no drive block; state its drive, as in drive: {example}"
            )
        pairs.append((joint, {**joint.drive, **({} if pairs else bus_settings)}))
    return pairs


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
