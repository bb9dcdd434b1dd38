"""What a job tells while it is worked on; every line of a job's ``events.jsonl`` is one of these."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, Field, JsonValue, TypeAdapter, ValidationError

from tauscope.server.queue.record import JobProblem
from tauscope.server.queue.stored import StoredModel


class StateEvent(StoredModel):
    """The job came into another state."""

    kind: Literal["state"] = Field(default="state", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    state: str = Field(description="the state, one that is no end")


class StepEvent(StoredModel):
    """Another step of the work began."""

    kind: Literal["step"] = Field(default="step", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    step: str = Field(description="what is being done, in a few words")


class ProgressEvent(StoredModel):
    """The work came on."""

    kind: Literal["progress"] = Field(default="progress", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    percent: float | None = Field(default=None, description="how much is done, where that is known")
    figures: dict[str, JsonValue] = Field(default={}, description="what is measured meanwhile, by name")


class EndedEvent(StoredModel):
    """The job reached its end; nothing follows."""

    kind: Literal["ended"] = Field(default="ended", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    state: str = Field(description="the end state")
    problem: JobProblem | None = Field(default=None, description="why it did not succeed")


JobEvent = Annotated[StateEvent | StepEvent | ProgressEvent | EndedEvent, Field(discriminator="kind")]
"""Any of the four."""

_EVENTS: TypeAdapter[JobEvent] = TypeAdapter(JobEvent)


def parse_event(content: Mapping[str, Any]) -> JobEvent | None:
    """The event of a line; None where it is none that we know."""
    try:
        return _EVENTS.validate_python(content, strict=False)
    except ValidationError:
        return None
