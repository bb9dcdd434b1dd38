"""Work that takes time: jobs in worker processes, runs in control processes, campaigns that put them together."""

from service.jobs.campaign_desk import CampaignDesk
from service.jobs.campaign_leader import Workshop
from service.jobs.campaign_order import CampaignLinks, CampaignOrder, HeldOutMotion
from service.jobs.campaign_workspace import CampaignWorkspace
from service.jobs.check_work import check_kept_recording
from service.jobs.device_claims import BusyError, DeviceClaims
from service.jobs.diagnosis_order import DiagnosisOptions, DiagnosisOrder
from service.jobs.diagnosis_work import run_diagnosis
from service.jobs.diagnosis_workspace import ROLES as DIAGNOSIS_ROLES
from service.jobs.diagnosis_workspace import DiagnosisWorkspace
from service.jobs.excitation_order import ExcitationDesignOptions, ExcitationOrder, ForbiddenBox
from service.jobs.excitation_submission import hand_in_excitation
from service.jobs.excitation_work import check_trajectory, read_designed_trajectory, run_excitation
from service.jobs.excitation_workspace import ExcitationWorkspace
from service.jobs.exports import EXPORT_FILES, ExportFormat
from service.jobs.identification_order import IdentificationOptions, IdentificationOrder, OrderedRecording
from service.jobs.identification_work import run_identification
from service.jobs.identification_workspace import IdentificationWorkspace
from service.jobs.messages import without_folders
from service.jobs.motions import DesignedMotion, Motion, ready_motion, take_trajectory
from service.jobs.queue import JobKind, JobQueue, QueueFullError
from service.jobs.record import JobProblem, JobRecord
from service.jobs.run_desk import RunDesk, run_recording_name
from service.jobs.run_leader import ControlProcess, Live, StartControl
from service.jobs.run_order import BackendChoice, RunRequestRecord
from service.jobs.run_start import start_control
from service.jobs.run_workspace import RunWorkspace
from service.jobs.states import JobState
from service.jobs.version import tauscope_version
from service.jobs.worker_pool import WorkerPool
from service.jobs.workspace import Workspace

__all__ = [
    "DIAGNOSIS_ROLES",
    "EXPORT_FILES",
    "BackendChoice",
    "BusyError",
    "CampaignDesk",
    "CampaignLinks",
    "CampaignOrder",
    "CampaignWorkspace",
    "ControlProcess",
    "DesignedMotion",
    "DeviceClaims",
    "DiagnosisOptions",
    "DiagnosisOrder",
    "DiagnosisWorkspace",
    "ExcitationDesignOptions",
    "ExcitationOrder",
    "ExcitationWorkspace",
    "ExportFormat",
    "ForbiddenBox",
    "HeldOutMotion",
    "IdentificationOptions",
    "IdentificationOrder",
    "IdentificationWorkspace",
    "JobKind",
    "JobProblem",
    "JobQueue",
    "JobRecord",
    "JobState",
    "Live",
    "Motion",
    "OrderedRecording",
    "QueueFullError",
    "RunDesk",
    "RunRequestRecord",
    "RunWorkspace",
    "StartControl",
    "WorkerPool",
    "Workshop",
    "Workspace",
    "check_kept_recording",
    "check_trajectory",
    "hand_in_excitation",
    "read_designed_trajectory",
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
