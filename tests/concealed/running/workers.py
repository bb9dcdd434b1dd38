"""Who tries: processes of this machine, or of a Dask cluster."""

import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

from tauscope.server.queue.cluster_executor import SCHEDULER, ClusterExecutor

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""Variables of the environment that give each process one thread of linear algebra: the processes fill the cores."""


@contextmanager
def workers(jobs: int | None = None, scheduler: str | None = None) -> Iterator[Executor]:
    """An executor of trials.

    Parameters
    ----------
    jobs : int or None
        processes of this machine; one a core that this process may use where None
    scheduler : str or None
        address of a Dask scheduler whose workers run in a clone of this repository; where None, the one that the
        environment names, else processes of this machine

    Raises
    ------
    StoreError
        where the scheduler does not answer
    """
    address = scheduler or os.environ.get(SCHEDULER)
    if address:
        executor: Executor = ClusterExecutor(address)
    else:
        for name in THREADS:
            os.environ.setdefault(name, "1")
        executor = ProcessPoolExecutor(jobs or len(os.sched_getaffinity(0)), get_context("spawn"))
    try:
        yield executor
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
