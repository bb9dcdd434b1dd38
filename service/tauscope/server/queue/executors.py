"""The executors of analysis: worker processes of this service, or a Dask cluster."""

import gc
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any, ParamSpec, TypeVar

from tauscope.server.queue.cluster_executor import SCHEDULER, ClusterExecutor

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_environment = threading.Lock()


class WorkerPool(Executor):
    """A pool of spawned processes, one BLAS thread each, made anew after a process died.

    Jobs that were in a pool when one of its processes died end with BrokenProcessPool.
    """

    def __init__(self, workers: int) -> None:
        """Make the pool; no process is started before it is needed."""
        self._workers = workers
        self._lock = threading.Lock()
        self._pool: ProcessPoolExecutor | None
        self._pool, self._lifeline = self._new_pool()

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> "Future[Result]":
        """Have a function called in a process.

        Raises
        ------
        RuntimeError
            after `shutdown`
        """
        with self._lock, _one_thread_each():
            if self._pool is None:
                raise RuntimeError("the pool is shut down")
            try:
                return self._pool.submit(fn, *args, **kwargs)
            except BrokenProcessPool:
                self._lifeline.close()
                self._pool, self._lifeline = self._new_pool()
                return self._pool.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes."""
        with self._lock:
            pool, self._pool = self._pool, None
            if cancel_futures:
                self._lifeline.close()
        if pool is not None:
            pool.shutdown(wait=wait, cancel_futures=cancel_futures)
        self._lifeline.close()
        # A pool whose processes were ended is part of a cycle, and holds semaphores that outlive this process.
        del pool
        gc.collect()

    def _new_pool(self) -> tuple[ProcessPoolExecutor, Connection]:
        """A pool, and the end of the pipe whose closing ends its processes."""
        context = multiprocessing.get_context("spawn")
        watched, lifeline = context.Pipe(duplex=False)
        pool = ProcessPoolExecutor(self._workers, context, initializer=_begin_process, initargs=(watched,))
        return pool, lifeline


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """What processes that are started meanwhile find in their environment; the user's own settings stay."""
    with _environment:
        added = [name for name in _THREAD_SETTINGS if name not in os.environ]
        os.environ.update(dict.fromkeys(added, "1"))
        try:
            yield
        finally:
            for name in added:
                del os.environ[name]


def _begin_process(watched: Connection) -> None:
    """Leave Ctrl-C to the service, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_service, args=(watched,), daemon=True).start()


def _end_with_service(watched: Connection) -> None:
    """End this process when the service closes its end of the pipe, or is gone."""
    parent = multiprocessing.parent_process()
    sentinels: list[Any] = [watched] if parent is None else [watched, parent.sentinel]
    wait(sentinels)
    os._exit(1)


def open_executor(workers: int, wait_s: float = 0.0) -> Executor:
    """Where analysis is done: on the cluster that the environment names, else in processes of our own.

    The workers of a cluster have to see the data folder under the same path.

    Parameters
    ----------
    wait_s : float
        how long a task waits for a cluster that is away before it ends [s]

    Raises
    ------
    StoreError
        if the cluster does not answer, or Dask is not installed
    """
    address = os.environ.get(SCHEDULER, "")
    return ClusterExecutor(address, wait_s) if address else WorkerPool(workers)
