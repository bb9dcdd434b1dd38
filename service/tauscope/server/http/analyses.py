"""Identifications, diagnoses and rollouts: requests, answers and what is special about these resources."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import Field

from tauscope.closed_loop import RolloutDocument
from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.plots import DiagnosisPlots
from tauscope.errors import IdentificationError, NotFoundError
from tauscope.export.model_file import ModelFile
from tauscope.identification import IdentificationDocument
from tauscope.report.curves import IdentificationPlots
from tauscope.server.http.answers import JobAnswer, JobLinks, require_document
from tauscope.server.http.bodies import to_json_text
from tauscope.server.http.openapi import binary_part, binary_parts
from tauscope.server.http.services import Services
from tauscope.server.http.tasks import queued
from tauscope.server.http.tasks.queued import JobDocument, QueuedTask
from tauscope.server.http.tasks.submission import EXAMPLE_ROBOT, MODEL_FILE, Names, RecordingsRequest, Submission
from tauscope.server.problems import ProblemError
from tauscope.server.queue.analyses import DiagnosisWorkspace, IdentificationWorkspace, RolloutWorkspace
from tauscope.server.queue.task_job import SAVED_MODEL, TRAJECTORY, OrderedRecording, TaskWorkspace
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.identify import IdentificationOptions
from tauscope.tasks.task import ReadingOptions
from tauscope.trajectory.document import TrajectoryDocument

RECORDINGS_EXAMPLE: tuple[str, Any] = (
    "Recordings that lie on the server",
    {"robot": EXAMPLE_ROBOT, "recordings": ["monday.csv", "tuesday.csv"], "held_out": ["wednesday.mcap"]},
)


def name_field(what: str, part: str) -> Any:
    words = f"names of {what}: files of this form, or on the server; null: all files sent as part `{part}`"
    return Field(default=None, description=words)


class IdentificationRequest(RecordingsRequest):
    """What is to be identified."""

    recordings: Names | None = name_field("the recordings that the model is made from", "recordings")
    held_out: Names | None = Field(default=None, description="recordings that judge it; null: every part `held_out`")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")


IDENTIFICATION_EXAMPLES: dict[str, tuple[str, Any]] = {
    "server": RECORDINGS_EXAMPLE,
    "options": (
        "Ordinary least squares without a filter",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["monday.csv"],
            "options": {"estimator": "ls", "cutoff_hz": None, "rotor_inertia": False},
        },
    ),
}


class LinksAnswer(JobLinks):
    plots: str | None = Field(default=None, description="data of its figures, once it succeeded")
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")
    model: str | None = Field(default=None, description="the identified model, once it succeeded")
    exports: dict[str, str] = Field(default={}, description="its exports by format, once it succeeded")


class IdentificationAnswer(JobAnswer):
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions | None = Field(default=None, description="how it is identified")
    refused_exports: dict[str, str] = Field(default={}, description="reason by format that cannot hold this model")
    links: LinksAnswer = Field(description="where to go on")


IDENTIFICATIONS = QueuedTask(
    noun="an identification",
    workspace=IdentificationWorkspace,
    models=(IdentificationRequest, IdentificationAnswer),
    examples=IDENTIFICATION_EXAMPLES,
    summary="Hand in an identification",
    words="The robot is checked at once, recordings are read by the job: follow `Location` until it has ended.",
    parts={
        "recordings": binary_parts("recordings that the model is made from"),
        "held_out": binary_parts("recordings that it is judged by"),
    },
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "invalid-request"),
    documents=(
        queued.result_document("an identification", "identify", IdentificationDocument),
        queued.plots_document("the identification", IdentificationPlots, "torque over time, friction over velocity"),
        JobDocument(
            "model",
            MODEL_FILE,
            "Fetch the model",
            "The identified model, for a rollout.",
            {"model": ModelFile, "description": "the same document as `tauscope identify --model`"},
            missing="an earlier version identified this and kept no model; hand it in again",
        ),
        queued.report_document("identify"),
    ),
    export_words="The identified model for a controller (json, yaml, c, python) or a simulator (urdf, mjcf).",
)


class DiagnosisRequest(RecordingsRequest):
    """What is to be diagnosed."""

    recordings: Names | None = name_field("the recordings that are to be explained", "recordings")
    held_out: Names | None = Field(default=None, description="recordings that confirm findings; null: all sent")
    simulated: Names | None = Field(default=None, description="recordings of your own simulator; null: all sent")
    model: str | dict[str, Any] | None = Field(
        default=None,
        description="model to compare with, for `against` saved: a model document, or the identifier of a diagnosis"
        " that succeeded; in a form, the part `model` may hold the file instead",
    )
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")


DIAGNOSIS_EXAMPLES: dict[str, tuple[str, Any]] = {
    "server": RECORDINGS_EXAMPLE,
    "simulation": (
        "What your own simulation has wrong, and what it lacks",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["monday.csv"],
            "simulated": ["simulated.csv"],
            "options": {"against": "simulation"},
        },
    ),
    "saved": (
        "What has changed since an earlier diagnosis",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["friday.csv"],
            "model": "20261103T101502Z-1f2e3d4c",
            "options": {"against": "saved"},
        },
    ),
}


class DiagnosisLinksAnswer(JobLinks):
    plots: str | None = Field(default=None, description="data of its figures, once it succeeded")
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")
    model: str | None = Field(default=None, description="the model with all findings, once it succeeded")
    scenario: str | None = Field(default=None, description="its findings for the simulated arm, once it succeeded")
    improved_robot: str | None = Field(default=None, description="the robot file with the findings, once it succeeded")
    exports: dict[str, str] = Field(default={}, description="its compensation code by format, once it succeeded")
    next_trajectory: str | None = Field(default=None, description="the motion to record next, where one was planned")


class DiagnosisAnswer(JobAnswer):
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what is explained")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what findings are confirmed by")
    simulated: tuple[OrderedRecording, ...] = Field(default=(), description="what the user's simulator recorded")
    options: DiagnosisOptions | None = Field(default=None, description="how it is diagnosed")
    refused_exports: dict[str, str] = Field(default={}, description="reason by format that cannot hold this model")
    links: DiagnosisLinksAnswer = Field(description="where to go on")


YAML = "text/yaml"  # an alias of application/yaml (RFC 9512), which generators of clients do not read


def keep_model(handed: Submission[Any], find: Callable[[Services, str], TaskWorkspace[Any]]) -> str | None:
    """Put a model, or that of an identifier, into its place; its name. Raises ProblemError, IdentificationError."""
    model, file = handed.document.model, handed.form.file("model")
    if file is not None and model is not None:
        raise ProblemError("invalid-request", "the model came twice, as part model and in part request; send it once")
    if file is not None or model is None:
        return None if file is None else file.name
    path: Path = handed.workspace.uploads(SAVED_MODEL) / MODEL_FILE
    if isinstance(model, str):
        path.write_bytes(require_document(find(handed.services, model).read_output(MODEL_FILE), model))
    else:
        path.write_text(to_json_text(model, "model", IdentificationError), encoding="utf-8")
    return MODEL_FILE


def keep_earlier_model(handed: Submission[DiagnosisRequest]) -> str | None:
    """Put the model into its place. Raises ProblemError if it came twice or is not `against`, or NotFoundError."""
    document, form = handed.document, handed.form
    against, has_simulated = document.options.against, bool(form.files.get("simulated") or document.simulated)
    if (against == "simulation") != has_simulated:
        text = "options.against: simulation and recordings of a simulator belong together; send both or neither"
        raise ProblemError("invalid-request", text)
    if (against == "saved") != (form.file("model") is not None or document.model is not None):
        text = "options.against: saved and a model belong together; send both or neither"
        raise ProblemError("invalid-request", text)
    return keep_model(handed, DIAGNOSES.finished)


DIAGNOSES = QueuedTask(
    noun="a diagnosis",
    workspace=DiagnosisWorkspace,
    models=(DiagnosisRequest, DiagnosisAnswer),
    examples=DIAGNOSIS_EXAMPLES,
    summary="Hand in a diagnosis",
    words="The robot is checked at once, recordings are read by the job: follow `Location` until it has ended.",
    parts={
        "recordings": binary_parts("recordings that are to be explained"),
        "held_out": binary_parts("recordings that findings are confirmed by"),
        "simulated": binary_parts("recordings made in your own simulator"),
        "model": binary_part("a model that an earlier diagnosis saved, to compare with"),
    },
    put_model=keep_earlier_model,
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "excitation", "invalid-request"),
    documents=(
        queued.result_document("a diagnosis", "diagnose", DiagnosisDocument),
        queued.plots_document("the diagnosis", DiagnosisPlots, "residuals over time and by variable, before and after"),
        queued.report_document("diagnose"),
        JobDocument(
            "model",
            MODEL_FILE,
            "Fetch the model with all findings",
            "The extended model.",
            {"model": ModelFile, "description": "the same document as `tauscope diagnose --model`"},
        ),
        queued.text_document(
            "scenario",
            "scenario.yaml",
            YAML,
            "Fetch the findings for the simulated arm",
            "A scenario that the simulated arm plays with the improved robot.",
            "file as `tauscope diagnose --scenario`",
        ),
        queued.text_document(
            "improved-robot",
            "improved-robot.yaml",
            YAML,
            "Fetch the improved robot",
            "The robot file with the identified links and friction.",
            "file as `tauscope diagnose --improved-robot`",
        ),
        JobDocument(
            "next-trajectory",
            TRAJECTORY,
            "Fetch the motion to record next",
            "The motion that best separates, or shows, what is open; a problem where none was planned.",
            {"model": TrajectoryDocument, "description": "a trajectory that `tauscope run` plays"},
            missing="no motion was planned: nothing is open; ask for one with options.next_trajectory",
        ),
    ),
    export_words="Compensation code of the model with all findings (c, python).",
)


class RolloutRequest(RecordingsRequest):
    """What is to be rolled out."""

    recordings: Names | None = name_field("recordings with commands, or with torque", "recordings")
    refine: Names | None = Field(
        default=None,
        description="names of recordings with commands by which the model is refined; null: all files sent as part"
        " `refine`",
    )
    model: str | dict[str, Any] | None = Field(
        default=None,
        description="model to roll out without and with its findings: a model document, or the identifier of an"
        " identification or a diagnosis that succeeded; in a form, the part `model` may hold the file instead",
    )
    options: ReadingOptions = Field(default=ReadingOptions(), description="how the recordings are read")


ROLLOUT_EXAMPLES: dict[str, tuple[str, Any]] = {
    "identified": (
        "A recording on the server, and the model of an identification",
        {"robot": EXAMPLE_ROBOT, "recordings": ["wednesday.mcap"], "model": "20261103T101502Z-1f2e3d4c"},
    )
}


class RolloutLinksAnswer(JobLinks):
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")


class RolloutAnswer(JobAnswer):
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what is rolled out")
    refine: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is refined by")
    options: ReadingOptions | None = Field(default=None, description="how the recordings are read")
    links: RolloutLinksAnswer = Field(description="where to go on")


def find_model(services: Services, identifier: str) -> TaskWorkspace[Any]:
    """The identification or diagnosis that made a model. Raises NotFoundError, or ProblemError without success."""
    try:
        return IDENTIFICATIONS.finished(services, identifier)
    except NotFoundError:
        return DIAGNOSES.finished(services, identifier)


ROLLOUTS = QueuedTask(
    noun="a rollout",
    workspace=RolloutWorkspace,
    models=(RolloutRequest, RolloutAnswer),
    examples=ROLLOUT_EXAMPLES,
    summary="Hand in a rollout",
    words="The robot is checked at once, MuJoCo gets the commands of the recordings in the job: follow `Location` until"
    " it has ended.",
    parts={
        "recordings": binary_parts("recordings with commands, or with torque"),
        "refine": binary_parts("recordings with commands by which the model is refined"),
        "model": binary_part("a model that identify or diagnose saved"),
    },
    put_model=partial(keep_model, find=find_model),
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "export", "invalid-request"),
    documents=(queued.result_document("a rollout", "rollout", RolloutDocument), queued.report_document("rollout")),
)

routers = tuple(task.router() for task in (IDENTIFICATIONS, DIAGNOSES, ROLLOUTS))
