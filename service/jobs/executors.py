"""Where analysis is done: in processes of this service, or on the machines of a Dask cluster."""

import os
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from typing import Any, ParamSpec, TypeVar

from service.errors import StoreError
from service.jobs.worker_pool import WorkerPool

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

SCHEDULER = "DASK_SCHEDULER_ADDRESS"
"""Environment variable that names the scheduler of a Dask cluster, as in ``tcp://scheduler:8786``."""

PATIENCE_S = 10
"""How long a scheduler may take to answer [s]."""


def open_executor(workers: int) -> Executor:
    """Where analysis is done: on the cluster that the environment names, else in processes of our own.

    The workers of a cluster have to see the data folder under the same path.

    Parameters
    ----------
    workers : int
        largest number of processes of our own

    Raises
    ------
    StoreError
        if the cluster does not answer, or Dask is not installed
    """
    address = os.environ.get(SCHEDULER, "")
    return ClusterExecutor(address) if address else WorkerPool(workers)


class ClusterExecutor(Executor):
    """A Dask cluster; a task whose worker dies again and again ends with BrokenExecutor, as in a pool of processes."""

    def __init__(self, address: str) -> None:
        """Reach the scheduler.

        Parameters
        ----------
        address : str
            as in ``tcp://scheduler:8786``

        Raises
        ------
        StoreError
            if it does not answer, or Dask is not installed
        """
        try:
            from distributed import Client
        except ImportError:
            hint = "install tauscope[fleet], or leave the variable out"
            raise StoreError(f"{SCHEDULER}: Dask is not installed; {hint}") from None
        try:
            self._client = Client(address, timeout=PATIENCE_S, set_as_default=False)
        except (OSError, ValueError) as error:
            hint = "start the scheduler, or leave the variable out"
            raise StoreError(f"{SCHEDULER}={address}: does not answer ({type(error).__name__}); {hint}") from None
        # The same function of the same folder is no known result: its files may be others by now.
        self._executor = self._client.get_executor(pure=False)

    @property
    def width(self) -> int:
        """Tasks that the cluster does at a time, at least one."""
        threads: Any = self._client.nthreads()  # a mapping: this client is not an asynchronous one
        return max(1, sum(threads.values()))

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> "Future[Result]":
        """Have a function called by a worker.

        Parameters
        ----------
        fn : callable
            a function of a module, not a closure
        args : tuple
            its arguments; anything that pickle takes
        kwargs : dict
            its arguments by name
        """
        inner: Future[Result] = self._executor.submit(fn, *args, **kwargs)
        outer: Future[Result] = Future()
        outer.add_done_callback(lambda done: inner.cancel() if done.cancelled() else None)
        inner.add_done_callback(lambda done: _hand_on(done, outer))
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster.

        Parameters
        ----------
        wait : bool
            whether to return only when all tasks have ended
        cancel_futures : bool
            take back what was not begun; a worker that is in the middle of a task finishes it for nobody
        """
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()


def _hand_on(inner: "Future[Any]", outer: "Future[Any]") -> None:
    """Give the end of a task to who waits for it."""
    from distributed import KilledWorker

    if outer.cancelled() or (inner.cancelled() and outer.cancel()):
        return
    error = inner.exception()
    if isinstance(error, KilledWorker):
        outer.set_exception(BrokenExecutor(str(error)))
    elif error is not None:
        outer.set_exception(error)
    else:
        outer.set_result(inner.result())
