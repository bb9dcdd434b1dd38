"""Work that takes time: jobs in worker processes, runs in control processes, campaigns that put them together."""

from service.jobs.campaign_desk import CampaignDesk
from service.jobs.campaign_leader import Workshop
from service.jobs.campaign_order import CampaignLinks, CampaignOrder, HeldOutMotion
from service.jobs.campaign_workspace import CampaignWorkspace
from service.jobs.check_work import check_kept_recording
from service.jobs.cluster_executor import ClusterExecutor
from service.jobs.device_claims import BusyError, DeviceClaims
from service.jobs.diagnosis_order import DiagnosisOptions, DiagnosisOrder
from service.jobs.diagnosis_work import run_diagnosis
from service.jobs.diagnosis_workspace import ROLES as DIAGNOSIS_ROLES
from service.jobs.diagnosis_workspace import DiagnosisWorkspace
from service.jobs.drift_watch import DriftWatch
from service.jobs.excitation_order import ExcitationDesignOptions, ExcitationOrder, ForbiddenBox
from service.jobs.excitation_submission import hand_in_excitation
from service.jobs.excitation_work import check_trajectory, read_designed_trajectory, run_excitation
from service.jobs.excitation_workspace import ExcitationWorkspace
from service.jobs.executors import open_executor
from service.jobs.exports import EXPORT_FILES, ExportFormat
from service.jobs.housekeeping import Housekeeping
from service.jobs.identification_order import IdentificationOptions, IdentificationOrder, OrderedRecording
from service.jobs.identification_work import run_identification
from service.jobs.identification_workspace import IdentificationWorkspace
from service.jobs.index_keeper import ChangedItem, IndexKeeper, open_index
from service.jobs.lease import LONGEST_TTL_S, Lease
from service.jobs.lease_errors import LeasedError, LeaseError, LeaseLostError, LeaseNeededError, NotArmedError
from service.jobs.leases import Leases
from service.jobs.messages import without_folders
from service.jobs.model_keeper import ModelKeeper
from service.jobs.motions import DesignedMotion, Motion, ready_motion, take_trajectory
from service.jobs.parameter_trends import ParameterTrend, parameter_trends
from service.jobs.permits import Permit
from service.jobs.queue import JobQueue, QueueFullError
from service.jobs.queued_job import JobKind
from service.jobs.record import JobProblem, JobRecord
from service.jobs.run_desk import RunDesk, run_recording_name
from service.jobs.run_leader import ControlProcess, Live, StartControl
from service.jobs.run_order import BackendChoice, RunRequestRecord
from service.jobs.run_start import start_control
from service.jobs.run_workspace import RunWorkspace
from service.jobs.samples_work import read_kept_samples
from service.jobs.schedule_definition import ScheduleDefinition
from service.jobs.schedule_keeper import ScheduleKeeper, new_boot, parse_schedule
from service.jobs.schedule_start import Repeater
from service.jobs.schedule_template import make_schedule
from service.jobs.states import JobState
from service.jobs.version import tauscope_version
from service.jobs.worker_pool import WorkerPool
from service.jobs.workspace import Workspace

__all__ = [
    "DIAGNOSIS_ROLES",
    "EXPORT_FILES",
    "LONGEST_TTL_S",
    "BackendChoice",
    "BusyError",
    "CampaignDesk",
    "CampaignLinks",
    "CampaignOrder",
    "CampaignWorkspace",
    "ChangedItem",
    "ClusterExecutor",
    "ControlProcess",
    "DesignedMotion",
    "DeviceClaims",
    "DiagnosisOptions",
    "DiagnosisOrder",
    "DiagnosisWorkspace",
    "DriftWatch",
    "ExcitationDesignOptions",
    "ExcitationOrder",
    "ExcitationWorkspace",
    "ExportFormat",
    "ForbiddenBox",
    "HeldOutMotion",
    "Housekeeping",
    "IdentificationOptions",
    "IdentificationOrder",
    "IdentificationWorkspace",
    "IndexKeeper",
    "JobKind",
    "JobProblem",
    "JobQueue",
    "JobRecord",
    "JobState",
    "Lease",
    "LeaseError",
    "LeaseLostError",
    "LeaseNeededError",
    "LeasedError",
    "Leases",
    "Live",
    "ModelKeeper",
    "Motion",
    "NotArmedError",
    "OrderedRecording",
    "ParameterTrend",
    "Permit",
    "QueueFullError",
    "Repeater",
    "RunDesk",
    "RunRequestRecord",
    "RunWorkspace",
    "ScheduleDefinition",
    "ScheduleKeeper",
    "StartControl",
    "WorkerPool",
    "Workshop",
    "Workspace",
    "check_kept_recording",
    "check_trajectory",
    "hand_in_excitation",
    "make_schedule",
    "new_boot",
    "open_executor",
    "open_index",
    "parameter_trends",
    "parse_schedule",
    "read_designed_trajectory",
    "read_kept_samples",
    "ready_motion",
    "run_diagnosis",
    "run_excitation",
    "run_identification",
    "run_recording_name",
    "start_control",
    "take_trajectory",
    "tauscope_version",
    "without_folders",
]
