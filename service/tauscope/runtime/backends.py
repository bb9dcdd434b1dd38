"""Which backends there are: a name to a factory. Nothing else in service names a backend's own module."""

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauscope.errors import AcquisitionError
from tauscope.extras import require_extra
from tauscope.robot import Robot
from tauscope.robot.messages import nearest, shown
from tauscope_drivers import Backend


@dataclass(frozen=True)
class Connection:
    """A backend, not connected yet, and what its time is."""

    backend: Backend
    is_real_time: bool


_SIMULATION_KEYS = ("time", "scenario", "start", "socket")
_LINGER_S = 5.0
_LONGEST = 90

BackendFactory = Callable[[Robot, Mapping[str, Any], Path | None], Connection]
"""Makes a backend for a robot from settings of its own and a folder for its own files; moves nothing."""


def make_backend(
    name: str,
    robot: Robot,
    settings: Mapping[str, Any],
    *,
    folder: Path | None = None,
    backends: "Mapping[str, BackendFactory] | None" = None,
) -> Connection:
    """The backend of a name.

    Raises
    ------
    AcquisitionError
        there is no such backend, or its settings are not valid
    MissingExtraError
        the backend's optional dependencies are not installed
    """
    known = BACKENDS if backends is None else backends
    if name not in known:
        raise AcquisitionError(f"there is no backend {shown(name)}; {nearest(name, known)}")
    with require_extra(f"backend {name}"):
        return known[name](robot, settings, folder)


def _on_field_bus(name: str) -> BackendFactory:
    """An arm on a field bus; its clock is the machine's."""

    def connection(robot: Robot, settings: Mapping[str, Any], folder: Path | None) -> Connection:
        from tauscope.runtime.field_buses import find_bus

        return Connection(find_bus(name).backend(robot, settings, folder), is_real_time=True)

    return connection


def _simulation(robot: Robot, settings: Mapping[str, Any], folder: Path | None) -> Connection:
    """The simulated arm: in virtual time within this process, in real time in one of its own."""
    for key in settings:
        if key not in _SIMULATION_KEYS:
            raise AcquisitionError(f"backend sim: unknown setting {shown(key)}; {nearest(str(key), _SIMULATION_KEYS)}")
    pace, start = settings.get("time", "virtual"), _posture(settings.get("start"), robot)
    if pace not in ("virtual", "real"):
        raise AcquisitionError(f"backend sim: time is {shown(pace)}; choose virtual or real")
    scenario, socket = _path(settings, "scenario"), _path(settings, "socket")
    if pace == "real":
        return Connection(_real_time_arm(robot, scenario, start, socket, folder), is_real_time=True)
    if socket is not None:
        raise AcquisitionError(
            "backend sim: a socket belongs to an arm in real time; set time to real, or leave it out"
        )
    from tauscope_sim.driver import SimulatedArm
    from tauscope_sim.scenario import Scenario
    from tauscope_sim.scenario_file import read_scenario

    concealed = Scenario() if scenario is None else read_scenario(scenario, robot)
    return Connection(SimulatedArm(robot, concealed, start_position=start), is_real_time=False)


def _real_time_arm(
    robot: Robot, scenario: Path | None, start: list[float] | None, socket: Path | None, folder: Path | None
) -> Backend:
    """An arm that runs already, or one that is started here and outlives this process."""
    from tauscope_sim.driver import RemoteSimulatedArm, start_device

    if socket is None:
        place = Path(tempfile.mkdtemp(prefix="tauscope-")) if folder is None or len(str(folder)) > _LONGEST else folder
        device = start_device(robot, place, scenario=scenario, start_position=start, linger_s=_LINGER_S)
        socket = device.socket
    elif scenario is not None or start is not None:
        raise AcquisitionError(
            "backend sim: scenario and start belong to an arm that is started here; leave out socket"
        )
    return RemoteSimulatedArm(socket, robot.joint_count)


def _path(settings: Mapping[str, Any], key: str) -> Path | None:
    """A path among the settings."""
    value = settings.get(key)
    if value is not None and (not isinstance(value, str) or not value):
        raise AcquisitionError(f"backend sim: {key} is {shown(value)}; give the path of a file")
    return None if value is None else Path(value)


def _posture(start: Any, robot: Robot) -> list[float] | None:
    """Where the simulated arm stands at first."""
    if start is None:
        return None
    if not isinstance(start, list | tuple) or len(start) != robot.joint_count:
        raise AcquisitionError(f"backend sim: start has to be {robot.joint_count} numbers, one a joint")
    try:
        posture = [float(value) for value in start]
    except (TypeError, ValueError):
        posture = [math.nan]
    if not all(math.isfinite(value) for value in posture):
        raise AcquisitionError("backend sim: start has to be finite numbers, one a joint [rad or m]")
    return posture


BACKENDS: Mapping[str, BackendFactory] = {
    "sim": _simulation,
    "dynamixel": _on_field_bus("dynamixel"),
    "canopen": _on_field_bus("canopen"),
}
"""Every backend by its name."""
