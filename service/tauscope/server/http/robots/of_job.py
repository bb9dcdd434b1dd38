"""The route that tells the robot of a job: what it looks like, and the files that it came in."""

from collections.abc import Callable
from pathlib import Path

from fastapi import APIRouter
from pydantic import Field

from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.urdf_xml import LARGEST_URDF
from tauscope.server.http.jobs.routes import Identifier
from tauscope.server.http.robots.files import check_received_robot
from tauscope.server.http.robots.models import RobotReportAnswer
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.models import AnswerModel
from tauscope.server.problems import ProblemError, problem_responses

FindRobot = Callable[[Services, str], tuple[Path, str | None]]
"""Folder of a job's robot and name of the robot file in it; None where the job's files are damaged."""


class RobotFileAnswer(AnswerModel):
    """A file of a robot."""

    name: str = Field(description="its bare name")
    content: str = Field(description="its text")


class JobRobotAnswer(AnswerModel):
    """The robot of a job."""

    report: RobotReportAnswer = Field(description="the robot at a glance")
    robot_file: str = Field(description="which of the files is the robot file")
    files: list[RobotFileAnswer] = Field(description="robot file and URDF as they were sent")


def add_robot_route(router: APIRouter, noun: str, find: FindRobot) -> None:
    """Give a collection of jobs the route ``/{identifier}/robot``."""

    @router.get(
        "/{identifier}/robot",
        name=f"get_robot_of_{noun.rpartition(' ')[2]}",
        summary=f"Fetch the robot of {noun}",
        responses=problem_responses("not-found", "damaged", "robot-file"),
    )
    def get_robot(identifier: Identifier, services: ServicesDep) -> JobRobotAnswer:
        """Its joints, limits and frames, and the very files that were sent: they can be handed in again."""
        folder, robot_file = find(services, identifier)
        if robot_file is None:
            raise ProblemError("damaged", f"files of {identifier} are missing or damaged; it has no robot any more")
        report = RobotReportAnswer.of(check_received_robot(folder, robot_file))
        files = [path for path in sorted(folder.iterdir()) if path.is_file() and not path.is_symlink()]
        return JobRobotAnswer(report=report, robot_file=robot_file, files=[_read(path) for path in files])


def _read(path: Path) -> RobotFileAnswer:
    """A text file, as far as such a file may be long."""
    with path.open("rb") as file:
        content = file.read(max(LARGEST_ROBOT_FILE, LARGEST_URDF))
    return RobotFileAnswer(name=path.name, content=content.decode("utf-8", errors="replace"))
