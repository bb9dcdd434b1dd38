"""Beginning a run with files that lie on the server already."""

import shutil
from pathlib import Path

from tauscope.server.control.leases import Permit
from tauscope.server.control.motions import ready_motion, take_trajectory
from tauscope.server.control.run_manager import RunManager
from tauscope.server.control.run_order import RunRequestRecord
from tauscope.server.control.run_workspace import RunWorkspace
from tauscope.server.queue.excitation_workspace import ExcitationWorkspace


def hand_in_run(
    desk: RunManager,
    robot_folder: Path,
    request: RunRequestRecord,
    excitation: ExcitationWorkspace,
    holder: str | None,
    permit: Permit,
) -> str:
    """Begin a run of an excitation that succeeded.

    Parameters
    ----------
    holder : str or None
        who has the arm already; None where the run takes it itself

    Raises
    ------
    BusyError
        if somebody else has the arm
    LeaseError
        if the arm may not be moved by that leave
    AcquisitionError
        if the trajectory is not there any more
    """
    staged = desk.items.stage()
    try:
        workspace = RunWorkspace(staged)
        workspace.prepare()
        shutil.copytree(robot_folder, workspace.robot, dirs_exist_ok=True)
        take_trajectory(excitation, workspace)
        workspace.write_request(request)
        return desk.submit(staged, ready_motion, holder, permit)
    finally:
        desk.items.discard(staged)
