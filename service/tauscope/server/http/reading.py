"""Files of strangers, read in processes of their own: fair among callers, bounded, and given up with the client."""

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine
from concurrent.futures import BrokenExecutor, Executor
from functools import partial
from typing import Any, ParamSpec, TypeVar

from starlette.requests import ClientDisconnect, Request

from tauscope.server.auth.gate import find_caller
from tauscope.server.problems import ProblemError

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
WIDTH = 2  # files that are read at a time; a caller has one of them, so that another caller finds a process free
MOST_WAITING = 32  # requests that wait for a process
MOST_WAITING_EACH = 8  # requests of one caller that wait, a page's worth of plots
READING = ("queue-full", "limit-exceeded", "worker-lost")  # problems of a route that has a file read
POLL_S = 0.1  # how often a client is asked whether it is still there [s]
RETRY_S = 2  # when a request that found the queue full may come again [s]


class ReadingQueue:
    """Requests that wait for a process to read for them. Used by the event loop only, so that it needs no lock."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._slots = asyncio.Semaphore(WIDTH)
        self._turns: dict[str, asyncio.Lock] = {}
        self._waiting: Counter[str] = Counter()

    def __len__(self) -> int:
        return self._waiting.total()

    async def call(
        self, request: Request, function: Callable[Arguments, Result], *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Result:
        """Call in a process that ends with its client. Raises ProblemError, LimitExceededError or ClientDisconnect."""
        who = find_caller(request.scope)
        caller = who.key or who.name
        if len(self) >= MOST_WAITING + WIDTH or self._waiting[caller] > MOST_WAITING_EACH:
            text = f"{self._waiting[caller]} of your requests wait for a file; repeat this one in {RETRY_S} s"
            raise ProblemError("queue-full", text, headers={"Retry-After": str(RETRY_S)})
        self._waiting[caller] += 1
        try:
            turn = self._turns.setdefault(caller, asyncio.Lock())
            return await _await_unless_gone(request, self._take_turn(turn, partial(function, *args, **kwargs)))
        finally:
            self._waiting[caller] -= 1
            if not self._waiting[caller]:
                del self._waiting[caller], self._turns[caller]

    async def _take_turn(self, turn: asyncio.Lock, function: Callable[[], Result]) -> Result:
        async with turn, self._slots:
            try:
                # Cancelling this cancels the future, which ends the process.
                return await asyncio.wrap_future(self._executor.submit(function))
            except BrokenExecutor:
                text = "the process that read the file ended unexpectedly; is it damaged, or far too large?"
                raise ProblemError("worker-lost", text) from None


async def _await_unless_gone(request: Request, answer: Coroutine[Any, Any, Result]) -> Result:
    task = asyncio.ensure_future(answer)
    try:
        while not (await asyncio.wait({task}, timeout=POLL_S))[0]:
            if await request.is_disconnected():
                raise ClientDisconnect
        return task.result()
    finally:
        if not task.done():
            task.cancel()
            await asyncio.wait({task})
