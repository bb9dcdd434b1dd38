"""The record of a job: its states, times and problem, and the events that it reports."""

from collections.abc import Mapping
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AwareDatetime, Field, JsonValue

from tauscope.strict_model import StrictModel


def without_folders(text: str, *folders: Path) -> str:
    """A message that calls files by their names alone, and says nothing of the server's folders."""
    for folder in folders:
        text = text.replace(f"{folder}/", "")
    return text


class JobState(StrEnum):
    """Where a job stands; four of the six are ends."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    INTERRUPTED = "interrupted"

    @property
    def is_end(self) -> bool:
        """Whether nothing will happen to the job any more."""
        return not TRANSITIONS[self]


TRANSITIONS: Mapping[JobState, frozenset[JobState]] = {
    JobState.QUEUED: frozenset({JobState.RUNNING, JobState.CANCELLED, JobState.INTERRUPTED}),
    JobState.RUNNING: frozenset(
        {JobState.QUEUED, JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED, JobState.INTERRUPTED}
    ),
    JobState.SUCCEEDED: frozenset(),
    JobState.FAILED: frozenset(),
    JobState.CANCELLED: frozenset(),
    JobState.INTERRUPTED: frozenset(),
}
"""For each state, the states that may follow. A job goes back to `queued` where the service ended before it did, and is
`interrupted` where that happens again and again, or where it moves an arm."""


def may_follow(before: JobState, after: JobState) -> bool:
    """Whether a job may go from one state to another."""
    return after in TRANSITIONS[before]


class JobProblem(StrictModel):
    """Why a job did not succeed."""

    code: str = Field(description="code of the error, as in tauscope.errors, or of the way the job ended")
    detail: str = Field(description="one line: what is wrong, where, and what to do")


class JobRecord(StrictModel):
    """A job's state and times."""

    form: Literal["tauscope.job/1"] = Field(default="tauscope.job/1", description="name and version of this form")
    state: JobState = Field(description="where the job stands")
    created: AwareDatetime = Field(description="when it was handed in")
    started: AwareDatetime | None = Field(default=None, description="when its work began")
    ended: AwareDatetime | None = Field(default=None, description="when it reached its end state")
    problem: JobProblem | None = Field(default=None, description="why it did not succeed")
    attempts: int = Field(default=0, ge=0, description="how often its work was begun and not given up in good order")

    def may_become(self, state: JobState) -> bool:
        """Whether a state may follow."""
        return may_follow(self.state, state)

    def moved(self, state: JobState, now: datetime, problem: JobProblem | None = None) -> "JobRecord":
        """The record after a transition. Raises ValueError if that state may not follow: a fault of the caller's."""
        if not self.may_become(state):
            raise ValueError(f"a job that is {self.state} cannot become {state}")
        changes: dict[str, object] = {"ended": now}
        if state is JobState.RUNNING:
            changes = {"started": now, "attempts": self.attempts + 1}
        elif state is JobState.QUEUED:
            changes = {"started": None}
        return self.model_copy(update={"state": state, "problem": problem, **changes})

    def requeue(self, now: datetime) -> "JobRecord":
        """The record of a job that waits again because the service ends in good order: that counts as no attempt."""
        return self.moved(JobState.QUEUED, now).model_copy(update={"attempts": max(0, self.attempts - 1)})


class StateEvent(StrictModel):
    """The job came into another state."""

    kind: Literal["state"] = Field(default="state", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    state: str = Field(description="the state, one that is no end")


class StepEvent(StrictModel):
    """Another step of the work began."""

    kind: Literal["step"] = Field(default="step", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    step: str = Field(description="what is being done, in a few words")


class ProgressEvent(StrictModel):
    """The work came on."""

    kind: Literal["progress"] = Field(default="progress", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    percent: float | None = Field(default=None, description="how much is done, where that is known")
    figures: dict[str, JsonValue] = Field(default={}, description="what is measured meanwhile, by name")


class EndedEvent(StrictModel):
    """The job reached its end; nothing follows."""

    kind: Literal["ended"] = Field(default="ended", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    state: str = Field(description="the end state")
    problem: JobProblem | None = Field(default=None, description="why it did not succeed")


JobEvent = Annotated[StateEvent | StepEvent | ProgressEvent | EndedEvent, Field(discriminator="kind")]
"""Any of the four."""
