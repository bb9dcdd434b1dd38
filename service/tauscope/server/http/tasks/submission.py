"""A request that hands a job in: JSON, or a form with the JSON as part `request` and files beside it."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, Self, TypeVar

from fastapi import Request
from pydantic import AfterValidator, Field, FiniteFloat, model_validator
from pydantic_core import PydanticCustomError

from tauscope.errors import RobotFileError, ScenarioError
from tauscope.robot import Robot
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.xml_text import LARGEST_XML
from tauscope.runtime.drivers import BackendName, find_driver
from tauscope.server.http import bodies
from tauscope.server.http.answers import ROOT, AnswerModel
from tauscope.server.http.openapi import ROBOT_PARTS, Examples, form_body, json_body, refer_to_model
from tauscope.server.http.services import Services
from tauscope.server.http.settings import Settings
from tauscope.server.problems import ProblemError
from tauscope.server.queue.received_files import INLINE_NAME
from tauscope.server.store.files import FILE_NAME_PATTERN, FILE_NAME_RULE, is_file_name
from tauscope.server.store.robots import RobotStore, RobotVersion
from tauscope.strict_model import StrictModel
from tauscope.tasks.run import BackendChoice
from tauscope.tasks.task import ROLES

EXAMPLE_ROBOT: dict[str, Any] = {
    "name": "pendulum",
    "kinematics": {"dh": [{"theta": 0, "d": 0, "a": 0.5, "alpha": 0}]},
    "gravity": [0, -9.81, 0],
    "joints": [{"name": "hinge", "limits": {"position": [-2.9, 2.9], "velocity": 2}}],
    "model": {
        "links": [
            {
                "mass": 1,
                "first_moment": [-0.25, 0, 0],
                "inertia": {"xx": 0.01, "yy": 0.1, "zz": 0.1, "xy": 0, "xz": 0, "yz": 0},
            }
        ]
    },
}
"""Every example of a request repeats it: as small as a robot can be."""


class RobotCheckRequest(StrictModel):
    """A robot to be checked."""

    robot: dict[str, Any] = Field(description="content of a robot file")


class RobotVersionAnswer(AnswerModel):
    version: str = Field(description="of its content; a request's robot may be {version: …}")
    name: str = Field(description="as in its file")
    robot_file: str = Field(description="which of its files is the robot file")
    created: datetime = Field(description="when it was kept, UTC")
    link: str = Field(description="path of its resource")

    @classmethod
    def of(cls, robot: RobotVersion) -> "RobotVersionAnswer":
        return cls(**asdict(robot), link=f"{ROOT}/robots/versions/{robot.version}")


def robot_part_rules(folder: Path) -> dict[str, bodies.PartRule]:
    return {
        "robot": bodies.PartRule(LARGEST_ROBOT_FILE, folder, default_name="robot.yaml"),
        "urdf": bodies.PartRule(LARGEST_XML, folder),
    }


def keep_inline_robot(folder: Path, robot: Mapping[str, Any]) -> str:
    """Write a robot that came as JSON. Raises RobotFileError if it is not plain data, or too large."""
    text = bodies.to_json_text(robot, "robot", RobotFileError)
    (folder / INLINE_NAME).write_text(text, encoding="utf-8")
    return INLINE_NAME


MODEL_FILE = "model.json"


class RobotRequest(StrictModel):
    """What a request says about a robot."""

    robot: dict[str, Any] | None = Field(
        default=None,
        description="content of a robot file, or {version: …} of a kept robot; in a form, the part `robot` may hold"
        " the file instead",
    )


def _check_file_name(value: str) -> str:
    if not is_file_name(value):
        raise PydanticCustomError("file_name", "is no name of a recording; {rule}", {"rule": FILE_NAME_RULE})
    return value


FileName = Annotated[str, AfterValidator(_check_file_name), Field(json_schema_extra={"pattern": FILE_NAME_PATTERN})]
Names = Annotated[list[FileName], Field(max_length=1000)]


class RecordingsRequest(RobotRequest):
    """What a request says about recordings: lists of names, each name once a list."""

    @model_validator(mode="after")
    def _check_once(self) -> Self:
        for names in (getattr(self, role, None) or [] for role in ROLES if role != "model"):
            twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
            if twice is not None:
                raise PydanticCustomError("twice", "{name} is listed twice; list it once", {"name": twice})
        return self


Document = TypeVar("Document", bound=RobotRequest)


@dataclass(frozen=True)
class Received(Generic[Document]):
    document: Document
    form: bodies.ReceivedForm


@dataclass(frozen=True)
class Submission(Received[Document]):
    """What was handed in; `workspace` is the staged folder that its files lie in, the robot's among them."""

    request: Request
    services: Services
    workspace: Any
    robot_file: str
    robot: Robot

    @property
    def robot_fields(self) -> dict[str, Any]:
        """What every order says of its robot."""
        return {"robot_file": self.robot_file, "robot_name": self.robot.name}


async def receive_request(
    request: Request,
    kind: type[Document],
    settings: Settings,
    robot_folder: Path,
    further_parts: Mapping[str, bodies.PartRule],
) -> Received[Document]:
    """Read JSON or a form. Raises ProblemError or LimitExceededError."""
    if bodies.media_type(request) == bodies.JSON:
        return Received(await bodies.read_document(request, kind, settings.max_document_bytes), bodies.ReceivedForm())
    if bodies.media_type(request) != bodies.FORM:
        raise bodies.refuse_media_type(request, bodies.JSON, bodies.FORM)
    rules = {
        "request": bodies.PartRule(settings.max_document_bytes),
        **robot_part_rules(robot_folder),
        **further_parts,
    }
    form = await bodies.receive_form(request, rules)
    return Received(bodies.parse_document(form.texts.get("request", b"{}"), kind, within="part request"), form)


def keep_robot(received: Received[Any], folder: Path, robots: RobotStore) -> str:
    """Name of the robot file. Raises ProblemError without one or with two, RobotFileError, NotFoundError."""
    file, inline = received.form.file("robot"), received.document.robot
    if file is not None and inline is not None:
        raise ProblemError("invalid-request", "the robot came twice, as part robot and in part request; send it once")
    if file is not None:
        return file.name
    if inline is None:
        raise ProblemError("invalid-request", "no robot was sent; send part robot, or the field robot in the JSON")
    if inline.keys() == {"version"}:
        robot = robots.find(str(inline["version"]))
        shutil.copytree(robots.files(robot.version), folder, dirs_exist_ok=True)
        return robot.robot_file
    return keep_inline_robot(folder, inline)


def request_body(kind: type[RobotRequest], examples: Examples, further_parts: Mapping[str, Any]) -> dict[str, Any]:
    form = form_body({"request": refer_to_model(kind), **ROBOT_PARTS, **further_parts}, required=[])
    return {"requestBody": {"required": True, "content": {**json_body(kind, examples), **form}}}


class BackendRequest(StrictModel):
    """Which arm is moved; what is left out, the operator of the service has decided."""

    name: BackendName | None = Field(default=None, description="backend; null: the service's own")
    time: Literal["virtual", "real"] | None = Field(
        default=None,
        description="of the simulated arm: as fast as it computes, or by the clock; null: the service's own",
    )
    scenario: dict[str, Any] | None = Field(default=None, description="effects that the simulated arm conceals")
    keep_settings: bool = Field(default=False, description="whether servos keep in EEPROM what a run changed")
    start: tuple[FiniteFloat, ...] | None = Field(
        default=None,
        max_length=100,
        description="where the simulated arm stands at first, one number a joint [rad or m]; null: at zero",
    )


def choose_backend(settings: Settings, request: BackendRequest, robot: Robot) -> BackendChoice:
    """Raises ScenarioError, or RobotFileError if a drive names a file or a simulated arm has no model."""
    if request.scenario is not None:
        bodies.to_json_text(request.scenario, "scenario", ScenarioError)
    name = request.name or settings.backend
    driver = find_driver(name)
    _refuse_files(robot, driver.file_keys)
    if driver.is_simulated and len(robot.model.links or ()) != robot.link_count:
        raise RobotFileError(
            f"{robot.name}: the {name} backend needs a model: mass, first_moment and inertia of all {robot.link_count}"
            " links; state model.links, give a URDF with inertials, or take the improved robot of a diagnosis"
        )
    return BackendChoice(
        name=name,
        time=request.time or settings.sim_time,
        scenario=request.scenario,
        start=request.start,
        keep_settings=request.keep_settings,
    )


def _refuse_files(robot: Robot, keys: Sequence[str]) -> None:
    """Refuse drives' own files: nothing in a request would bring them."""
    for joint in robot.joints:
        for key in keys:
            if (joint.drive or {}).get(key) is not None:
                hint = "leave it out, or run this arm with tauscope run"
                raise RobotFileError(f"{joint.name}: drive.{key} names a file, which cannot be sent; {hint}")
