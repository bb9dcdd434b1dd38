"""Starting the control process of a run whose folder holds everything that it needs."""

import json
import zlib
from pathlib import Path
from typing import Any

from tauscope.errors import AcquisitionError
from tauscope.robot import read_robot
from tauscope.runtime.drivers import find_driver
from tauscope.runtime.options import BackendOrder, RunOrder
from tauscope.runtime.progress import Report
from tauscope.runtime.run_process import RunProcess
from tauscope.server.control.run_order import BackendChoice
from tauscope.server.control.run_workspace import RunWorkspace


def start_control(workspace: RunWorkspace, report: Report, *, sim_socket: Path | None = None) -> RunProcess:
    """Start the control process.

    Raises
    ------
    RobotFileError
        if the robot file was damaged meanwhile
    AcquisitionError
        if files are missing, or the process cannot be started
    """
    request, trajectory = workspace.read_request(), workspace.trajectory
    if request is None or trajectory is None:
        raise AcquisitionError("files of the run are missing or damaged; hand it in again")
    robot_file = workspace.robot / request.robot_file
    order = RunOrder(
        robot=str(robot_file),
        trajectory=str(trajectory),
        backend=BackendOrder(name=request.backend.name, settings=_settings(workspace, request.backend, sim_socket)),
        options=request.options,
    )
    return RunProcess(workspace.control, order, read_robot(robot_file), report=report, beats_by_itself=False)


def _settings(workspace: RunWorkspace, backend: BackendChoice, sim_socket: Path | None) -> dict[str, Any]:
    """The options that the driver has, of what was asked for; the noise of a scenario is this run's own."""
    options = find_driver(backend.name).option_names
    settings: dict[str, Any] = {"time": backend.time, "start": backend.start and list(backend.start)}
    if "scenario" in options:
        scenario = {"seed": zlib.crc32(workspace.folder.name.encode()), **(backend.scenario or {})}
        workspace.scenario.write_text(json.dumps(scenario, ensure_ascii=False), encoding="utf-8")
        settings["scenario"] = str(workspace.scenario)
    if sim_socket is not None and backend.time == "real":
        settings["socket"] = str(sim_socket)
    return {name: value for name, value in settings.items() if name in options and value is not None}
