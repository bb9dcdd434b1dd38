"""What answers, and the routes of items, have in common."""

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from fastapi import Path, Query
from pydantic import ConfigDict, Field

from tauscope.server.problems import Problem, ProblemError, make_problem
from tauscope.server.queue.job_folder import JobProblem, JobState, Workspace
from tauscope.strict_model import StrictModel


class AnswerModel(StrictModel):
    """An answer; it may be made from an object with attributes of the same names."""

    model_config = ConfigDict(from_attributes=True)

    @classmethod
    def describe(cls, entry: object, **more: Any) -> Self:
        """The answer that holds an entry's attributes. `more`: those that it has not, or has by another name."""
        names = (name for name in cls.model_fields if name not in more and hasattr(entry, name))
        return cls.model_validate({name: getattr(entry, name) for name in names} | more)


class PageAnswer(AnswerModel):
    next: str | None = Field(default=None, description="to be given as `after` for the next page; null: it is the last")


ROOT = "/api/v1"
"""Path of the interface."""
Identifier = Annotated[str, Path(description="identifier", examples=["20261103T101502Z-1f2e3d4c"])]
Limit = Annotated[int, Query(ge=1, le=1000, description="most entries of the list")]
After = Annotated[str | None, Query(max_length=255, description="`next` of the page before; null: the first page")]
ENDINGS = ("not-finished", "cancelled", "interrupted", "damaged", "storage-full")
"""Problems of a job without result, beside those of its work."""
SUBMISSION = ("bad-request", "limit-exceeded", "media-type", "robot-file", "invalid-request", "storage-full")
"""Problems of handing anything in that comes with a robot file."""
MOTION = ("busy", "leased", "lease-needed", "lease-lost", "not-armed")
"""Problems of moving an arm that somebody else has, or that the lease does not let move."""


class Links(AnswerModel):
    self_: str = Field(alias="self", description="its state")
    events: str = Field(description="what happens to it, as server-sent events")


class JobLinks(Links):
    result: str | None = Field(default=None, description="its result, once it succeeded")


class MotionLinks(Links):
    stop: str = Field(description="where a POST stops it")


class JobAnswer(AnswerModel):
    id: str = Field(description="identifier", examples=["20261103T101502Z-1f2e3d4c"])
    state: JobState | Literal["damaged"] = Field(
        description="where it stands; interrupted: the service ended first; damaged: its files are missing or damaged"
    )
    step: str | None = Field(default=None, description="what is being done, while it is running")
    created: datetime | None = Field(default=None, description="when it was handed in, UTC")
    started: datetime | None = Field(default=None, description="when its work began, UTC")
    ended: datetime | None = Field(default=None, description="when it ended, UTC")
    problem: Problem | None = Field(default=None, description="why it did not succeed")
    robot: str | None = Field(default=None, description="name of the robot")


def describe_job(workspace: Workspace, here: str) -> dict[str, Any]:
    """The fields of `JobAnswer`; a job whose state cannot be read is said to be damaged."""
    identifier, record = workspace.folder.name, workspace.read_record()
    if record is None:
        return describe_damaged(identifier, here)
    step = workspace.read_step() if record.state is JobState.RUNNING else None
    told = record.model_dump(include={"state", "created", "started", "ended"})
    return {**told, "id": identifier, "step": step, "problem": convert_problem(record.problem, here)}


def describe_damaged(identifier: str, here: str) -> dict[str, Any]:
    detail = f"files of {identifier} are missing or damaged; remove it and hand it in again"
    return {"id": identifier, "state": "damaged", "problem": make_problem("damaged", detail, here)}


def convert_problem(problem: JobProblem | None, here: str) -> Problem | None:
    return None if problem is None else make_problem(problem.code, problem.detail, here)


def require_success(workspace: Workspace) -> None:
    """Raises ProblemError if a job has not succeeded: the problem that it ended in, or that it has not ended."""
    identifier, record = workspace.folder.name, workspace.read_record()
    if record is None:
        raise ProblemError("damaged", f"the state of {identifier} is missing or damaged; remove it")
    if not record.state.is_end:
        text = f"{identifier} is {record.state}; ask for its state until that is an end state"
        raise ProblemError("not-finished", text, headers={"Retry-After": "2"})
    if record.problem is not None:
        raise ProblemError(record.problem.code, record.problem.detail)


def require_document(content: bytes | None, identifier: str) -> bytes:
    """The result of a job. Raises ProblemError where it is damaged: None."""
    if content is None:
        raise ProblemError("damaged", f"the result of {identifier} is missing or damaged; hand it in again")
    return content
