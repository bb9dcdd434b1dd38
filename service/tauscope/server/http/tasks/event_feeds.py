"""The events of jobs that clients follow: one task reads each log once, however many clients follow it."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Protocol

from anyio import to_thread

from tauscope.server.store.event_log import EventLog, LoggedEvent

POLL_S = 0.1  # how often logs are looked at [s]
LAST_WAIT_S = 3.0  # how long the end event of a job that has ended is waited for [s]


class EventSource(Protocol):
    @property
    def events(self) -> EventLog: ...

    def has_ended(self) -> bool: ...


class Feed:
    """The events of one job as far as they are read. Changed by the task that reads, within the event loop."""

    def __init__(self, source: EventSource) -> None:
        self.events: list[LoggedEvent] = []
        self.is_over = False
        self.followers = 0
        self._source, self._log = source, source.events.follow()
        self._news = asyncio.Event()
        self._waited_s = 0.0

    async def wait(self, timeout_s: float) -> bool:
        """Wait for news; False where there was none in time."""
        with suppress(TimeoutError):
            async with asyncio.timeout(timeout_s):
                await self._news.wait()
            return True
        return False

    def read(self) -> tuple[bool, list[LoggedEvent]] | None:
        """Whether the job has ended, and its events until now, none behind the end; None where it cannot be read."""
        try:
            has_ended, events = self._source.has_ended(), self._log.read()
        except OSError:
            return None
        ends = (place for place, event in enumerate(events, start=1) if event.content.get("kind") == "ended")
        return has_ended, events[: next(ends, None)]

    def take(self, has_ended: bool, events: list[LoggedEvent]) -> None:
        self.events += events
        self._waited_s += POLL_S if has_ended else 0.0
        is_ended = any(event.content.get("kind") == "ended" for event in events)
        if is_ended or self._waited_s > LAST_WAIT_S:
            self.end()
        elif events:
            self._wake()

    def end(self) -> None:
        self.is_over = True
        self._wake()

    def _wake(self) -> None:
        news, self._news = self._news, asyncio.Event()
        news.set()


class EventFeeds:
    """The feeds that somebody follows. Used by the event loop only."""

    def __init__(self, closing: threading.Event) -> None:
        self._closing = closing
        self._feeds: dict[Path, Feed] = {}
        self._task: asyncio.Task[None] | None = None

    @contextmanager
    def follow(self, source: EventSource) -> Iterator[Feed]:
        path = source.events.path
        feed = self._feeds.get(path)
        if feed is None or feed.is_over:
            feed = self._feeds[path] = Feed(source)
        feed.followers += 1
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._read_all())
        try:
            yield feed
        finally:
            feed.followers -= 1
            if not feed.followers and self._feeds.get(path) is feed:
                del self._feeds[path]

    async def _read_all(self) -> None:
        while self._feeds:
            feeds = [feed for feed in self._feeds.values() if not feed.is_over]
            if self._closing.is_set():
                for feed in feeds:
                    feed.end()
                return
            found = await to_thread.run_sync(list, map(Feed.read, feeds))  # the thread draws from the map
            for feed, news in zip(feeds, found, strict=True):
                if news is not None:
                    feed.take(*news)
            await asyncio.sleep(POLL_S)
