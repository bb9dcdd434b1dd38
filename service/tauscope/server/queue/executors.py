"""The executors of analysis: worker processes of this service, or a Dask cluster."""

import os
from concurrent.futures import Executor

from tauscope.server.queue.cluster_executor import SCHEDULER, ClusterExecutor
from tauscope.server.queue.worker_pool import WorkerPool


def open_executor(workers: int, wait_s: float = 0.0, deadline_s: float | None = None) -> Executor:
    """Where analysis is done: on the cluster that the environment names, else in processes of our own.

    The workers of a cluster have to see the data folder under the same path. Raises StoreError if the cluster does not
    answer, or Dask is not installed.

    `wait_s`: how long a task waits for a cluster that is away before it ends [s]; `deadline_s`: how long a task may
    take in a process of our own [s].
    """
    address = os.environ.get(SCHEDULER, "")
    return ClusterExecutor(address, wait_s) if address else WorkerPool(workers, deadline_s=deadline_s)
