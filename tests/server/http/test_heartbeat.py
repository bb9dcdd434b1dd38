"""Arms move only while requests are answered."""

import asyncio
import threading

from server.conftest import connected
from server.queue.executors import InlineExecutor
from server.queue.waiting import wait_until
from tauscope.server.http import Settings, create_app
from tauscope.server.http.readiness import SILENCE_S, Heartbeat


def test_a_pulse_that_is_not_shown_is_not_felt_for_long() -> None:
    now = [100.0]
    heartbeat = Heartbeat(lambda: now[0])
    for elapsed in (0.0, 0.9 * SILENCE_S):
        now[0] = 100.0 + elapsed
        assert heartbeat.is_alive()
    now[0] = 100.0 + 1.1 * SILENCE_S
    assert not heartbeat.is_alive()
    heartbeat.beat()
    assert heartbeat.is_alive()


def test_an_event_loop_shows_its_pulse_only_while_it_turns() -> None:
    async def live() -> tuple[bool, bool, bool]:
        beats: list[int] = []
        heartbeat = Heartbeat()
        heartbeat.beat = lambda: beats.append(1)
        async with heartbeat.keep_beating():
            await asyncio.sleep(0.3)
            turning = len(beats) > 1
            stuck = len(beats)
            threading.Event().wait(0.3)  # the loop is held up
            return turning, len(beats) == stuck, True

    assert asyncio.run(live()) == (True, True, True)


def test_the_service_has_a_pulse(settings: Settings) -> None:
    app = create_app(settings, InlineExecutor())
    with connected(app):
        heartbeat = app.state.services.heartbeat
        first = heartbeat._last
        wait_until(lambda: heartbeat._last > first)
