"""Who tries: processes of this machine, or of a Dask cluster where the environment names its scheduler."""

import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

SCHEDULER = "DASK_SCHEDULER_ADDRESS"
"""Environment variable with the address of a Dask scheduler whose workers run in a clone of this repository."""


@contextmanager
def workers(jobs: int | None = None) -> Iterator[Executor]:
    """An executor of so many processes, as many as there are cores by default; or of the Dask cluster."""
    address = os.environ.get(SCHEDULER)
    if address:
        from distributed import Client

        with Client(address) as client:
            yield client.get_executor(pure=False)
        return
    executor = ProcessPoolExecutor(jobs or os.cpu_count(), get_context("spawn"))
    try:
        yield executor
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
