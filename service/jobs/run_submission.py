"""Beginning a run with files that lie on the server already."""

import shutil
from pathlib import Path

from service.jobs.excitation_workspace import ExcitationWorkspace
from service.jobs.motions import ready_motion, take_trajectory
from service.jobs.permits import Permit
from service.jobs.run_desk import RunDesk
from service.jobs.run_order import RunRequestRecord
from service.jobs.run_workspace import RunWorkspace


def hand_in_run(
    desk: RunDesk,
    robot_folder: Path,
    request: RunRequestRecord,
    excitation: ExcitationWorkspace,
    holder: str | None,
    permit: Permit,
) -> str:
    """Begin a run of an excitation that succeeded.

    Parameters
    ----------
    desk : RunDesk
        takes it
    robot_folder : Path
        holds the robot file and its URDF
    request : RunRequestRecord
        which run
    excitation : ExcitationWorkspace
        its motion
    holder : str or None
        who has the arm already; None where the run takes it itself
    permit : Permit
        leave to move the arm

    Returns
    -------
    str
        the run's identifier

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
