"""Whether the service can do its work now, and not merely whether it is there."""

import os
import tempfile
from pathlib import Path

from tauscope.server.http.services import Services

LEAST_FREE_BYTES = 64 * 2**20
"""Room on the disk below which no run should begin [bytes]."""

PATIENCE_S = 2.0
"""How long the disk may take [s]."""


def obstacles(services: Services) -> list[str]:
    """Everything that stands in the way of work, each in a few words; asks the disk, so that it may hang."""
    found = ["the service is ending"] if services.closing.is_set() else []
    if not services.jobs.can_work():
        found.append("the Dask cluster does not answer, and jobs wait for it")
    if services.audit.lost:
        found.append(f"{services.audit.lost} entries of the audit log were lost")
    return found + _disk_obstacles(services.settings.data_folder)


def _disk_obstacles(folder: Path) -> list[str]:
    """What is wrong with the data folder: a file is really written."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"ready?")
            file.flush()
            os.fsync(file.fileno())
        status = os.statvfs(folder)
    except OSError as error:
        return [f"the data folder cannot be written to ({error.strerror})"]
    free = status.f_bavail * status.f_frsize
    return [] if free >= LEAST_FREE_BYTES else [f"the disk has {free // 2**20} MiB left"]
