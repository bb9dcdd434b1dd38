"""A few readers at a time; a stop, and whoever asks whether the service is there, pass all of them."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from starlette.types import Message, Receive, Scope, Send

from tauscope.server.http import processor_wait as processor_wait_module
from tauscope.server.http.processor_wait import LONGEST_PAUSE_S
from tauscope.server.http.protection import ConcurrencyLimiter

NEVER_S = 3600.0


class Work:
    """An application whose answers begin and end when the test says so."""

    def __init__(self) -> None:
        self.entered: list[str] = []
        self.probes_wait = False
        self.may_begin, self.may_end = asyncio.Event(), asyncio.Event()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.entered.append(scope["path"])
        if scope["path"] == "/broken":
            raise ValueError(scope["path"])
        if scope["path"].startswith("/slow") or self.probes_wait:
            await self.may_begin.wait()
        await send({"type": "http.response.start", "status": 200, "headers": []})
        if scope["path"].startswith("/slow"):
            await self.may_end.wait()
        await send({"type": "http.response.body", "body": b""})


async def receive() -> Message:
    """No request here has a body."""
    return {"type": "http.request", "body": b""}


async def send(message: Message) -> None:
    """Nobody looks at the answers."""


@pytest.fixture(autouse=True)
def processor_wait(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """How long the event loop has waited for a processor [s]: the last number."""
    waits = [0.0]
    monkeypatch.setattr(processor_wait_module, "read_processor_wait", lambda: waits[-1])
    return waits


async def settle() -> None:
    """Until nobody can go on by themselves."""
    for _ in range(20):
        await asyncio.sleep(0)


def play(
    scene: Callable[[Work, Callable[[str, str], asyncio.Task[None]]], Awaitable[None]], slot_timeout_s: float = NEVER_S
) -> None:
    """A scene with an application that lets two readers in at a time."""

    async def run() -> None:
        work = Work()
        slots = ConcurrencyLimiter(work, readers=2, slot_timeout_s=slot_timeout_s)

        def ask(method: str, path: str) -> asyncio.Task[None]:
            scope = {"type": "http", "method": method, "path": path}
            return asyncio.create_task(slots(scope, receive, send))

        await scene(work, ask)
        work.may_begin.set()
        work.may_end.set()

    asyncio.run(run())


@pytest.mark.parametrize(
    ("method", "path"),
    [("POST", "/api/v1/runs/r/stop"), ("POST", "/api/v1/stop"), ("GET", "/healthz"), ("GET", "/readyz")],
)
def test_it_passes_readers_that_wait(method: str, path: str) -> None:
    async def scene(work: Work, ask: Callable[[str, str], asyncio.Task[None]]) -> None:
        readers = [ask("GET", f"/slow/{number}") for number in range(5)]
        await settle()
        await ask(method, path)
        assert work.entered == ["/slow/0", "/slow/1", path]
        work.may_begin.set()
        work.may_end.set()
        await asyncio.gather(*readers)
        assert work.entered == ["/slow/0", "/slow/1", path, "/slow/2", "/slow/3", "/slow/4"]

    play(scene)


def test_probes_take_turns_among_themselves() -> None:
    """Two hundred of them hold up a stop as readers do."""

    async def scene(work: Work, ask: Callable[[str, str], asyncio.Task[None]]) -> None:
        probes = [ask("GET", "/healthz") for _ in range(3)]
        work.probes_wait = True
        await settle()
        assert work.entered == ["/healthz"]
        work.may_begin.set()
        await asyncio.gather(*probes)
        assert work.entered == 3 * ["/healthz"]

    play(scene)


def test_a_turn_ends_when_the_answer_begins() -> None:
    """Whoever follows events follows them for hours."""

    async def scene(work: Work, ask: Callable[[str, str], asyncio.Task[None]]) -> None:
        followers = [ask("GET", f"/slow/{number}") for number in range(5)]
        work.may_begin.set()
        await settle()
        assert len(work.entered) == 5
        assert not any(follower.done() for follower in followers)
        work.may_end.set()
        await asyncio.gather(*followers)

    play(scene)


def test_a_turn_ends_with_an_error_and_with_a_reader_that_goes() -> None:
    async def scene(work: Work, ask: Callable[[str, str], asyncio.Task[None]]) -> None:
        for _ in range(3):
            with pytest.raises(ValueError, match="broken"):
                await ask("GET", "/broken")
        gone = [ask("GET", "/slow/gone") for _ in range(4)]
        await settle()
        for reader in gone:
            reader.cancel()
        await asyncio.gather(*gone, return_exceptions=True)
        await ask("GET", "/other")
        assert work.entered[-1] == "/other"

    play(scene)


def test_readers_that_are_stuck_let_others_in_after_a_while() -> None:
    async def scene(work: Work, ask: Callable[[str, str], asyncio.Task[None]]) -> None:
        stuck = [ask("GET", "/slow/stuck") for _ in range(2)]
        await ask("GET", "/other")
        assert not any(reader.done() for reader in stuck)
        work.may_begin.set()
        work.may_end.set()
        await asyncio.gather(*stuck)
        await asyncio.gather(*(ask("GET", "/other") for _ in range(3)))

    play(scene, slot_timeout_s=0.0)


def test_readers_that_wait_when_the_service_ends_are_let_go() -> None:
    work, statuses, closing = Work(), [], []

    async def note(message: Message) -> None:
        statuses.append(message.get("status"))

    async def run() -> None:
        slots = ConcurrencyLimiter(work, readers=1, slot_timeout_s=NEVER_S, is_closing=lambda: bool(closing))
        scopes = [{"type": "http", "method": "GET", "path": f"/slow/{number}"} for number in range(200)]
        readers = [asyncio.create_task(slots(scope, receive, note)) for scope in scopes]
        await settle()
        closing.append(True)
        work.may_begin.set()
        work.may_end.set()
        await asyncio.gather(*readers)

    asyncio.run(run())
    assert work.entered == ["/slow/0"]
    assert (statuses.count(200), statuses.count(503)) == (1, 199)


def test_readers_pause_where_processors_are_scarce_and_nothing_else_does(processor_wait: list[float]) -> None:
    async def scene(work: Work, ask: Callable[[str, str], asyncio.Task[None]]) -> None:
        work.may_end.set()
        first = ask("GET", "/slow/1")
        await settle()
        processor_wait.append(10.0)
        work.may_begin.set()
        await first
        began = asyncio.get_running_loop().time()
        await ask("POST", "/api/v1/stop")
        await ask("GET", "/healthz")
        assert asyncio.get_running_loop().time() - began < 0.5 * LONGEST_PAUSE_S
        given_up = ask("GET", "/slow/2")
        await settle()
        given_up.cancel()
        await ask("GET", "/slow/3")
        assert asyncio.get_running_loop().time() - began >= 0.9 * LONGEST_PAUSE_S
        await asyncio.gather(ask("GET", "/slow/4"), ask("GET", "/slow/5"))  # no slot was lost

    play(scene)
