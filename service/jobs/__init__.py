"""Work that takes time: its states, its folder, the processes that do it and the queue before them."""

from service.jobs.check_work import check_kept_recording
from service.jobs.exports import EXPORT_FILES, ExportFormat
from service.jobs.identification_work import run_identification
from service.jobs.messages import without_folders
from service.jobs.order import IdentificationOptions, IdentificationOrder, OrderedRecording
from service.jobs.queue import JobQueue, QueueFullError
from service.jobs.record import JobProblem, JobRecord
from service.jobs.states import JobState
from service.jobs.version import tauscope_version
from service.jobs.worker_pool import WorkerPool
from service.jobs.workspace import Workspace

__all__ = [
    "EXPORT_FILES",
    "ExportFormat",
    "IdentificationOptions",
    "IdentificationOrder",
    "JobProblem",
    "JobQueue",
    "JobRecord",
    "JobState",
    "OrderedRecording",
    "QueueFullError",
    "WorkerPool",
    "Workspace",
    "check_kept_recording",
    "run_identification",
    "tauscope_version",
    "without_folders",
]
