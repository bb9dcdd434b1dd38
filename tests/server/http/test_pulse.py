"""Arms move only while requests are answered."""

import asyncio
import threading

from server.conftest import connected
from server.queue.executors import InlineExecutor
from server.queue.waiting import wait_until
from tauscope.server.http import Settings, create_app
from tauscope.server.http.heartbeat import PATIENCE_S, Heartbeat


def test_a_pulse_that_is_not_shown_is_not_felt_for_long() -> None:
    now = [100.0]
    pulse = Heartbeat(lambda: now[0])
    for elapsed in (0.0, 0.9 * PATIENCE_S):
        now[0] = 100.0 + elapsed
        assert pulse.is_alive()
    now[0] = 100.0 + 1.1 * PATIENCE_S
    assert not pulse.is_alive()
    pulse.beat()
    assert pulse.is_alive()


def test_an_event_loop_shows_its_pulse_only_while_it_turns() -> None:
    async def live() -> tuple[bool, bool, bool]:
        beats: list[int] = []
        pulse = Heartbeat()
        pulse.beat = lambda: beats.append(1)
        async with pulse.beating():
            await asyncio.sleep(0.3)
            turning = len(beats) > 1
            stuck = len(beats)
            threading.Event().wait(0.3)  # the loop is held up
            return turning, len(beats) == stuck, True

    assert asyncio.run(live()) == (True, True, True)


def test_the_service_has_a_pulse(settings: Settings) -> None:
    app = create_app(settings, InlineExecutor())
    with connected(app):
        pulse = app.state.services.pulse
        first = pulse._last
        wait_until(lambda: pulse._last > first)
