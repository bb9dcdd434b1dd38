"""What is kept of a job beside its input and output: its state, its times, and the problem that it ended in."""

from datetime import datetime
from typing import Literal

from pydantic import AwareDatetime, Field

from tauscope.server.queue.states import JobState, may_follow
from tauscope.server.queue.stored import StoredModel


class JobProblem(StoredModel):
    """Why a job did not succeed."""

    code: str = Field(description="code of the error, as in tauscope.errors, or of the way the job ended")
    detail: str = Field(description="one line: what is wrong, where, and what to do")


class JobRecord(StoredModel):
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
        """The record after a transition.

        Raises
        ------
        ValueError
            if that state may not follow: a fault of the caller's
        """
        if not self.may_become(state):
            raise ValueError(f"a job that is {self.state} cannot become {state}")
        changes: dict[str, object] = {"ended": now}
        if state is JobState.RUNNING:
            changes = {"started": now, "attempts": self.attempts + 1}
        elif state is JobState.QUEUED:
            changes = {"started": None}
        return self.model_copy(update={"state": state, "problem": problem, **changes})

    def given_up(self, now: datetime) -> "JobRecord":
        """The record of a job that waits again because the service ends in good order: that counts as no attempt."""
        return self.moved(JobState.QUEUED, now).model_copy(update={"attempts": max(0, self.attempts - 1)})
