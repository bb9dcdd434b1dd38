"""A request that hands a job in: JSON, or a form with the JSON as part `request` and files beside it."""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from fastapi import Request
from pydantic import Field

from tauscope.server.http.documents import JSON, media_type, parse_document, read_document, refuse_media_type
from tauscope.server.http.form import FORM, PartRule, ReceivedForm, receive_form
from tauscope.server.http.openapi import Examples, binary_part, form_body, json_body, model_reference
from tauscope.server.http.robots.files import keep_inline_robot, robot_part_rules
from tauscope.server.http.settings import Settings
from tauscope.server.problems import ProblemError
from tauscope.server.store.robots import RobotStore
from tauscope.strict_model import StrictModel


class RobotRequest(StrictModel):
    """What a request says about a robot."""

    robot: dict[str, Any] | None = Field(
        default=None,
        description="content of a robot file, or {version: …} of a kept robot; in a form, the part `robot` may hold"
        " the file instead",
    )


Document = TypeVar("Document", bound=RobotRequest)


@dataclass(frozen=True)
class Received(Generic[Document]):
    """A request as it arrived."""

    document: Document
    form: ReceivedForm


async def receive_request(
    request: Request,
    kind: type[Document],
    settings: Settings,
    robot_folder: Path,
    further_parts: Mapping[str, PartRule] | None = None,
) -> Received[Document]:
    """Read the body, whichever of the two media types it is.

    Raises
    ------
    ProblemError
        if the request is not as documented
    LimitExceededError
        if something is too large
    """
    if media_type(request) == JSON:
        return Received(await read_document(request, kind, settings.max_document_bytes), ReceivedForm())
    if media_type(request) != FORM:
        raise refuse_media_type(request, JSON, FORM)
    rules = {
        "request": PartRule(settings.max_document_bytes),
        **robot_part_rules(robot_folder),
        **(further_parts or {}),
    }
    form = await receive_form(request, rules)
    return Received(parse_document(form.texts.get("request", b"{}"), kind, within="part request"), form)


def keep_robot(received: Received[Any], folder: Path, robots: RobotStore) -> str:
    """Name of the robot file in the job's folder, written there if it came as JSON or is a kept one.

    Raises
    ------
    ProblemError
        if there is no robot, or two
    RobotFileError
        if its content is not plain data
    NotFoundError
        if it names a version that is not kept
    """
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


def request_body(
    kind: type[RobotRequest], examples: Examples, further_parts: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The body of such a request, for the OpenAPI document.

    Parameters
    ----------
    examples : mapping of str to (str, plain data)
        summary and value by name
    """
    parts = {
        "request": model_reference(kind),
        "robot": binary_part("the robot file (YAML)"),
        "urdf": binary_part("the URDF that the robot file names, by its bare name"),
        **(further_parts or {}),
    }
    form = form_body(parts, required=[])
    return {"requestBody": {"required": True, "content": {**json_body(kind, examples), **form}}}
