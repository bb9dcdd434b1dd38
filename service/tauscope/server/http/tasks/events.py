"""The events of a job as they happen, as server-sent events."""

import json
from collections.abc import AsyncIterator, Callable
from typing import Annotated, Any

from anyio import to_thread
from fastapi import APIRouter, Depends, Header, Request, Response
from fastapi.sse import KEEPALIVE_COMMENT, EventSourceResponse, format_sse_event

from tauscope.server.http.answers import Identifier
from tauscope.server.http.openapi import refer_to_model
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.tasks.event_feeds import EventFeeds, EventSource
from tauscope.server.problems import problem_responses
from tauscope.server.queue.job_folder import EndedEvent, ProgressEvent, StateEvent, StepEvent
from tauscope.server.store.event_log import LoggedEvent

EVENT_MODELS = (StateEvent, StepEvent, ProgressEvent, EndedEvent)
HEARTBEAT_S = 10.0  # silence after which a comment says that the connection lives [s]
RETRY_MS = 1000  # how long a client waits before it connects again [ms]
PRESENCE_S = 1.0  # how often a client without news is looked for [s]


LastEvent = Annotated[
    int,
    Header(
        alias="Last-Event-ID",
        ge=0,
        le=2**53,
        description="id of the last event that is known; the answer begins with the next",
    ),
]


_STREAM = """\
Kinds: `state`, `step`, `progress` and `ended`, after which the stream ends. An event's id is its number:
`Last-Event-ID` goes on after it, also after a restart of the service. Comments keep a quiet connection alive."""


def add_events_route(router: APIRouter, noun: str, find: Callable[[Services, str], EventSource]) -> None:
    """Give a collection of jobs the route ``/{identifier}/events``."""

    def find_source(identifier: Identifier, services: ServicesDep) -> EventSource:
        return find(services, identifier)

    @router.get(
        "/{identifier}/events",
        name=f"follow_events_of_{router.prefix.strip('/')}",
        summary=f"Follow the events of {noun}",
        response_class=Response,
        responses={
            200: {"content": {"text/event-stream": {"schema": _stream_schema()}}, "description": _STREAM},
            204: {"description": "the job had ended before `Last-Event-ID`: do not connect again"},
            **problem_responses("not-found"),
        },
    )
    async def follow_events(
        request: Request,
        services: ServicesDep,
        source: Annotated[EventSource, Depends(find_source)],
        after: LastEvent = 0,
    ) -> Response:
        """Server-sent events, from the first one on."""
        first = await to_thread.run_sync(_find_end, source, limiter=services.followers)
        if first is not None and after >= first:
            return Response(status_code=204)
        stream = _stream(request, services.feeds, source, after)
        return EventSourceResponse(stream, headers={"X-Accel-Buffering": "no"})


async def _stream(request: Request, feeds: EventFeeds, source: EventSource, after: int) -> AsyncIterator[bytes]:
    """Everything that happens, as it is sent; ends with the job, the client or the service."""
    yield format_sse_event(retry=RETRY_MS)
    place, quiet_s = 0, 0.0
    with feeds.follow(source) as feed:
        while not await request.is_disconnected():
            events, place = feed.events[place:], len(feed.events)
            new = [event for event in events if event.number > after]
            if new:
                yield b"".join(map(_format_event, new))
                quiet_s = 0.0
            if feed.is_over and place == len(feed.events):
                return
            if place == len(feed.events) and not await feed.wait(PRESENCE_S):
                quiet_s += PRESENCE_S
            if quiet_s > HEARTBEAT_S:
                yield KEEPALIVE_COMMENT
                quiet_s = 0.0


def _find_end(source: EventSource) -> int | None:
    """Number of the end event; None where there is none yet."""
    if not source.has_ended():
        return None
    events = source.events.follow().read()
    return next((event.number for event in events if event.content.get("kind") == "ended"), None)


def _format_event(event: LoggedEvent) -> bytes:
    kind = event.content.get("kind")
    return format_sse_event(
        data_str=json.dumps(event.content, ensure_ascii=False),
        event=kind if isinstance(kind, str) else None,
        id=str(event.number),
    )


def _stream_schema() -> dict[str, Any]:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "event": {"type": "string", "enum": ["state", "step", "progress", "ended"]},
            "id": {"type": "string", "description": "number of the event, from 1"},
            "data": {
                "type": "string",
                "contentMediaType": "application/json",
                "contentSchema": {"anyOf": [refer_to_model(model) for model in EVENT_MODELS]},
            },
            "retry": {"type": "integer", "description": "how long to wait before connecting again [ms]"},
        },
    }
