"""An event loop in a thread of its own, for the clients of a Dask cluster."""

import asyncio
import threading
from concurrent.futures import Future
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tornado.ioloop import IOLoop


class LoopThread:
    """One event loop for every client that reaches for a cluster, one after the other.

    Dask gives each client a loop of its own otherwise, and one that does not reach its scheduler leaves it running:
    a thread more with every attempt.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._loop: IOLoop | None = None
        self._stopping = asyncio.Event()

    def open(self) -> "IOLoop":
        """The running loop, started where it is not.

        Raises
        ------
        ImportError
            if Dask is not installed
        """
        if self._loop is None:
            from tornado.ioloop import IOLoop

            loop: Future[IOLoop] = Future()

            async def run() -> None:
                loop.set_result(IOLoop.current())
                await self._stopping.wait()

            self._thread = threading.Thread(target=lambda: asyncio.run(run()), name=self._name, daemon=True)
            self._thread.start()
            self._loop = loop.result()
        return self._loop

    def stop(self, within_s: float) -> None:
        """End the thread, with whatever its clients still had under way.

        Parameters
        ----------
        within_s : float
            how long to wait for its end [s]
        """
        if self._loop is not None:
            self._loop.add_callback(self._stopping.set)
            self._thread.join(within_s)
