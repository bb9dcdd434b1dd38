"""Readers take turns: however many ask, a stop finds the event loop free and few threads before it."""

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

AT_A_TIME = 2
"""Reading requests that are worked on at once: threads that share an interpreter do not read faster for being more."""

LONGEST_TURN_S = 0.5
"""A reader that is stuck, with a disk or a lock, keeps its turn no longer [s]."""

_READING = ("GET", "HEAD")
_PROBES = ("/healthz", "/readyz")
"""They take turns among themselves: whoever restarts a service that does not answer stops its arms."""


class TakingTurns:
    """Lets a few reading requests in at a time, in the order in which they came; all others pass at once.

    A turn ends when the answer begins: what is streamed after that, events above all, keeps nobody waiting.
    """

    def __init__(self, app: ASGIApp, at_a_time: int = AT_A_TIME, longest_turn_s: float = LONGEST_TURN_S) -> None:
        """Wrap an application.

        Parameters
        ----------
        longest_turn_s : float
            after which the next one is let in although the answer has not begun [s]
        """
        self.app = app
        self._turns, self._probes = asyncio.Semaphore(at_a_time), asyncio.Semaphore(1)
        self._longest_turn_s = longest_turn_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request when its turn has come."""
        if scope["type"] != "http" or scope["method"] not in _READING:
            return await self.app(scope, receive, send)
        turns = self._probes if scope["path"] in _PROBES else self._turns
        await turns.acquire()
        turn = _Turn(turns, self._longest_turn_s)

        async def send_and_make_room(message: Message) -> None:
            turn.end()
            await send(message)

        try:
            await self.app(scope, receive, send_and_make_room)
        finally:
            turn.end()


class _Turn:
    """One reader's turn; ends once, however often that is said."""

    def __init__(self, turns: asyncio.Semaphore, longest_s: float) -> None:
        self._turns, self._has_ended = turns, False
        self._patience = asyncio.get_running_loop().call_later(longest_s, self.end)

    def end(self) -> None:
        """Let the next one in."""
        if not self._has_ended:
            self._has_ended = True
            self._patience.cancel()
            self._turns.release()
