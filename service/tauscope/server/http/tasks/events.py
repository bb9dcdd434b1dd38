"""The events of a job as they happen, as server-sent events."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Annotated, Any, Protocol

from anyio import to_thread
from fastapi import APIRouter, Depends, Header, Request, Response
from fastapi.sse import KEEPALIVE_COMMENT, EventSourceResponse, format_sse_event
from pydantic.json_schema import models_json_schema

from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.tasks.routes import Identifier
from tauscope.server.problems import problem_responses
from tauscope.server.queue.record import EndedEvent, ProgressEvent, StateEvent, StepEvent
from tauscope.server.store.event_log import EventLog, LogFollower, LoggedEvent

EVENT_MODELS = (StateEvent, StepEvent, ProgressEvent, EndedEvent)

POLL_S = 0.1
"""How often a log is looked at [s]."""

HEARTBEAT_S = 10.0
"""Silence after which a comment says that the connection lives [s]."""

LAST_WAIT_S = 3.0
"""How long the end event of a job that has ended is waited for [s]."""

RETRY_MS = 1000
"""How long a client waits before it connects again [ms]."""


class Told(Protocol):
    """Anything that has events."""

    @property
    def events(self) -> EventLog:
        """What happened."""
        ...

    def has_ended(self) -> bool:
        """Whether nothing more will happen."""
        ...


LastEvent = Annotated[
    int,
    Header(
        alias="Last-Event-ID",
        ge=0,
        le=2**53,
        description="id of the last event that is known; the answer begins with the next",
    ),
]


def add_events_route(router: APIRouter, noun: str, find: Callable[[Services, str], Told]) -> None:
    """Give a collection of jobs the route ``/{identifier}/events``."""

    def found(identifier: Identifier, services: ServicesDep) -> Told:
        return find(services, identifier)

    @router.get(
        "/{identifier}/events",
        name=f"follow_events_of_{router.prefix.strip('/')}",
        summary=f"Follow the events of {noun}",
        response_class=Response,
        responses={
            200: {
                "content": {"text/event-stream": {"schema": _stream_schema()}},
                "description": "events, until its end",
            },
            204: {"description": "the end was told before `Last-Event-ID`: do not connect again"},
            **problem_responses("not-found"),
        },
    )
    async def follow_events(
        request: Request, services: ServicesDep, told: Annotated[Told, Depends(found)], after: LastEvent = 0
    ) -> Response:
        """Server-sent events of the kinds `state`, `step`, `progress` and `ended`, from the first one on.

        Every event has the number of its line as id: who was cut off goes on with `Last-Event-ID`, also after the
        service was started again. Comments keep a quiet connection alive. The stream ends after `ended`.
        """
        first = await to_thread.run_sync(_end_number, told, limiter=services.followers)
        if first is not None and after >= first:
            return Response(status_code=204)
        stream = _stream(request, services, told, told.events.follow(after))
        return EventSourceResponse(stream, headers={"X-Accel-Buffering": "no"})


async def _stream(request: Request, services: Services, told: Told, follower: LogFollower) -> AsyncIterator[bytes]:
    """Everything that happens, as it is sent; ends with the job, the client or the service."""
    yield format_sse_event(retry=RETRY_MS)
    quiet = waited = 0.0
    while not services.closing.is_set() and not await request.is_disconnected():
        has_ended, events = await to_thread.run_sync(_news, told, follower, limiter=services.followers)
        if events:
            yield b"".join(_formatted(event) for event in events)
            quiet = 0.0
        if any(event.content.get("kind") == "ended" for event in events) or waited > LAST_WAIT_S:
            return
        waited += POLL_S if has_ended else 0.0
        quiet += POLL_S
        if quiet > HEARTBEAT_S:
            yield KEEPALIVE_COMMENT
            quiet = 0.0
        await asyncio.sleep(POLL_S)


def _news(told: Told, follower: LogFollower) -> tuple[bool, Sequence[LoggedEvent]]:
    """Whether the job has ended, and then what was told until now; nothing is told behind the end."""
    has_ended = told.has_ended()
    events = follower.read()
    ends = (place for place, event in enumerate(events, start=1) if event.content.get("kind") == "ended")
    return has_ended, events[: next(ends, None)]


def _end_number(told: Told) -> int | None:
    """Number of the end event; None where it was not told yet."""
    if not told.has_ended():
        return None
    events = told.events.follow().read()
    return next((event.number for event in events if event.content.get("kind") == "ended"), None)


def _formatted(event: LoggedEvent) -> bytes:
    """An event as it is sent."""
    kind = event.content.get("kind")
    return format_sse_event(
        data_str=json.dumps(event.content, ensure_ascii=False),
        event=kind if isinstance(kind, str) else None,
        id=str(event.number),
    )


def _stream_schema() -> dict[str, Any]:
    """What the data of an event may be."""
    references, _ = models_json_schema(
        [(model, "serialization") for model in EVENT_MODELS], ref_template="#/components/schemas/{model}"
    )
    data = [references[(model, "serialization")] for model in EVENT_MODELS]
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "event": {"type": "string", "enum": ["state", "step", "progress", "ended"]},
            "id": {"type": "string", "description": "number of the event, from 1"},
            "data": {"type": "string", "contentMediaType": "application/json", "contentSchema": {"anyOf": data}},
            "retry": {"type": "integer", "description": "how long to wait before connecting again [ms]"},
        },
    }
