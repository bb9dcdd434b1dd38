"""The driver of the simulated arm, as the registry finds it."""

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tauscope.robot.messages import shown
from tauscope_drivers.driver import ArmDescription, Connection, Driver, Option
from tauscope_drivers.errors import DriverError

_LINGER_S = 5.0
_LONGEST_FOLDER = 90  # the path of a socket has room for little more


class SimulatedDriver(Driver):
    """The simulated arm: in virtual time within this process, in real time in one of its own."""

    name = "sim"
    title = "simulated arm"
    is_simulated = True
    options = (
        Option("time", "virtual: as fast as it computes; real: by the clock", "virtual"),
        Option("scenario", "path of a scenario file: what the arm conceals"),
        Option("start", "where the arm stands at first, one number a joint [rad or m]"),
        Option("socket", "where an arm listens that runs by the clock already"),
    )

    def make_backend(self, arm: ArmDescription, settings: Mapping[str, Any]) -> Connection:
        """The arm; one in real time is started where no socket is named, and outlives this process."""
        pace, start = settings.get("time", "virtual"), _posture(settings.get("start"), len(arm.joints))
        if pace not in ("virtual", "real"):
            raise _refusal(f"time is {shown(pace)}; choose virtual or real")
        scenario, socket = _path(settings, "scenario"), _path(settings, "socket")
        if pace == "virtual":
            if socket is not None:
                raise _refusal("a socket belongs to an arm in real time; set time to real, or leave it out")
            from tauscope_sim.driver import SimulatedArm
            from tauscope_sim.scenario_file import read_scenario

            simulated = SimulatedArm(arm.robot, read_scenario(scenario, arm.robot), start_position=start)
            return Connection(simulated, is_real_time=False)
        from tauscope_sim.driver import RemoteSimulatedArm, start_device

        if socket is None:
            folder = arm.folder
            if folder is None or len(str(folder)) > _LONGEST_FOLDER:
                folder = Path(tempfile.mkdtemp(prefix="tauscope-"))
            socket = start_device(arm.robot, folder, scenario=scenario, start_position=start, linger_s=_LINGER_S).socket
        elif scenario is not None or start is not None:
            raise _refusal("scenario and start belong to an arm that is started here; leave out socket")
        return Connection(RemoteSimulatedArm(socket, len(arm.joints)), is_real_time=True)


def _path(settings: Mapping[str, Any], key: str) -> Path | None:
    value = settings.get(key)
    if value is not None and (not isinstance(value, str) or not value):
        raise _refusal(f"{key} is {shown(value)}; give the path of a file")
    return None if value is None else Path(value)


def _posture(start: Any, joint_count: int) -> list[float] | None:
    if start is None:
        return None
    if not isinstance(start, list | tuple) or len(start) != joint_count:
        raise _refusal(f"start has to be {joint_count} numbers, one a joint")
    try:
        posture = [float(value) for value in start]
    except (TypeError, ValueError):
        posture = [math.nan]
    if not all(math.isfinite(value) for value in posture):
        raise _refusal("start has to be finite numbers, one a joint [rad or m]")
    return posture


def _refusal(reason: str) -> DriverError:
    return DriverError.refusal(f"backend sim: {reason}")


DRIVER = SimulatedDriver()  # found by the entry point ``tauscope.drivers``
