"""Where analysis is done: worker processes of this service, or a Dask cluster that reconnects by itself."""

import asyncio
import logging
import os
import threading
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from tauscope.errors import StoreError
from tauscope.server.queue.worker_pool import WorkerPool, settle

if TYPE_CHECKING:
    from distributed import Client
    from tornado.ioloop import IOLoop


class LoopThread:
    """One event loop for all clients: Dask leaves a loop running for each that does not reach its scheduler."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._loop: IOLoop | None = None
        self._stopping = asyncio.Event()

    def open(self) -> "IOLoop":
        """The running loop, started where it is not. Raises ImportError if Dask is not installed."""
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
        """End the thread, with whatever its clients still had under way, within [s]."""
        if self._loop is not None:
            self._loop.add_callback(self._stopping.set)
            self._thread.join(within_s)


Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
_log = logging.getLogger("tauscope.jobs")
SCHEDULER = "DASK_SCHEDULER_ADDRESS"
"""Environment variable that names the scheduler of a Dask cluster, as in ``tcp://scheduler:8786``."""
TIMEOUT_S = 10  # how long a scheduler may take to answer [s]
CHECK_S = 1.0  # how often the scheduler is looked at: whether it is there, and how many workers it has [s]


class ClusterUnavailableError(BrokenExecutor):
    """The scheduler was lost, with whatever it had in hand. Nothing is said against the task: it can be done again."""


class ClusterExecutor(Executor):
    """A Dask cluster that is reached again where Dask's client has given up; `is_there` is false meanwhile."""

    def __init__(self, address: str, wait_s: float = 0.0) -> None:
        """`wait_s`: for a scheduler that is away [s]. Raises StoreError if it does not answer, or without Dask."""
        self._address, self._wait_s = address, wait_s
        self.width = 1  # tasks that the cluster did at a time when it was last looked at, at least one
        self._closing = threading.Event()
        self._there = threading.Event()
        self._loop = LoopThread("cluster loop")
        try:
            self._client, self._executor = self._open_client()
            self._look()
        except (ImportError, OSError, ValueError) as error:
            self._loop.stop(TIMEOUT_S)
            text = f"{SCHEDULER}={address}: does not answer ({type(error).__name__}); start the scheduler"
            if isinstance(error, ImportError):
                text = f"{SCHEDULER}: Dask is not installed; install tauscope[fleet]"
            raise StoreError(f"{text}, or leave the variable out") from None
        self._watcher = threading.Thread(target=self._watch, name="cluster", daemon=True)
        self._watcher.start()

    def is_there(self) -> bool:
        """Whether the scheduler answers; asks nobody."""
        return self._client.status == "running"

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> "Future[Result]":
        """Raises ClusterUnavailableError if the scheduler is away, RuntimeError after `shutdown`."""
        if self._closing.is_set():
            raise RuntimeError("the cluster was left")
        if not self.is_there():
            self._there.wait(self._wait_s)
        try:
            inner: Future[Result] = self._executor.submit(fn, *args, **kwargs)
        except Exception as error:
            if self.is_there():
                raise
            raise ClusterUnavailableError(f"{self._address}: is away") from error
        outer: Future[Result] = Future()
        outer.add_done_callback(lambda done: inner.cancel() if done.cancelled() else None)
        inner.add_done_callback(lambda done: self._hand_on(done, outer))
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._closing.set()
        self._watcher.join(2 * TIMEOUT_S)
        try:
            self._executor.shutdown(wait=wait and not cancel_futures and self.is_there())
            self._client.close()
        except Exception:  # a scheduler that is away holds up nobody who leaves
            if self.is_there():
                raise
        finally:
            self._loop.stop(TIMEOUT_S)

    def _open_client(self) -> "tuple[Client, Executor]":
        from distributed import Client

        client = Client(self._address, self._loop.open(), timeout=TIMEOUT_S, set_as_default=False)
        # The same function of the same folder is no known result: its files may be others by now.
        return client, client.get_executor(pure=False)

    def _watch(self) -> None:
        while not self._closing.wait(CHECK_S):
            try:
                self._look()
            except Exception:  # whatever Dask raises of a scheduler that goes and comes: the next look tells
                _log.debug("the cluster could not be looked at", exc_info=True)

    def _look(self) -> None:
        if self._client.status == "closed":
            self._there.clear()
            self._client, self._executor = self._open_client()
            _log.warning("the Dask scheduler at %s is back", self._address)
        if self.is_there():
            # `Client.nthreads` asks the same, and waits for ever where the scheduler is lost meanwhile.
            scheduler: Any = self._client.scheduler
            threads: Any = self._client.sync(scheduler.ncores, callback_timeout=TIMEOUT_S)
            self.width = max(1, sum(threads.values()))
            self._there.set()
        else:
            self._there.clear()

    def _hand_on(self, inner: "Future[Any]", outer: "Future[Any]") -> None:
        from distributed import KilledWorker

        if outer.cancelled():
            return
        if inner.cancelled():
            if self._closing.is_set():
                outer.cancel()
            else:
                outer.set_exception(ClusterUnavailableError(f"{self._address}: was lost"))
            return
        error = inner.exception()
        if isinstance(error, KilledWorker):
            error = BrokenExecutor(str(error))
        settle(outer, error, None if error else inner.result())


def open_executor(workers: int, wait_s: float = 0.0, deadline_s: float | None = None) -> Executor:
    """The cluster that the environment names, or processes of our own; bounds in [s]. Raises StoreError."""
    address = os.environ.get(SCHEDULER, "")
    return ClusterExecutor(address, wait_s) if address else WorkerPool(workers, deadline_s=deadline_s)
