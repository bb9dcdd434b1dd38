"""Diagnose: what an arm's model leaves out."""

from dataclasses import dataclass
from functools import partial
from typing import Literal

from pydantic import Field

from tauscope.actuation import make_efforts
from tauscope.diagnosis import (
    Diagnosis,
    DiagnosisDocument,
    against_model,
    against_simulation,
    compare_with_saved,
    diagnose,
    document,
)
from tauscope.diagnosis.documents.plots import diagnosis_plots
from tauscope.diagnosis.extended_model import model_document
from tauscope.diagnosis.next_experiment import PlannedExperiment, planned_experiment
from tauscope.errors import ExcitationError, IdentificationError
from tauscope.export.formats import CODE_FILES, EXPORT_FILES, ExportFormat, make_export
from tauscope.export.model import of_diagnosis
from tauscope.export.model_file import identified_document, model_file, read_extended_model
from tauscope.export.simulation_files import improved_robot, scenario_text
from tauscope.identification import Options
from tauscope.recording import Recording
from tauscope.robot import read_robot
from tauscope.tasks import task
from tauscope.tasks.identify import CutoffFrequency
from tauscope.trajectory import trajectory_json
from tauscope.trajectory.csv_format import trajectory_csv
from tauscope.trajectory.files import DEFAULT_RATE_HZ


class DiagnosisOptions(task.ReadingOptions):
    """How a diagnosis is done."""

    against: Literal["identified", "model", "simulation", "saved"] = Field(
        default="identified",
        description="what the recordings are compared with: the best model that they allow, the robot file's model"
        " block, recordings of a simulator, or a model that an earlier diagnosis saved",
    )
    cutoff_hz: CutoffFrequency | Literal["auto"] | None = Field(
        default="auto", description="band of the nominal model's identification [Hz]; auto: chosen; null: no filter"
    )
    next_trajectory: bool = Field(
        default=False, description="whether the next motion is planned also where nothing is open"
    )
    headroom: bool = Field(
        default=False,
        description="whether a black box says how much of held-out motion is still predictable; needs the headroom"
        " extra and held-out recordings",
    )


class Request(task.TaskRequest):
    """What is to be diagnosed, by the names of its files."""

    recordings: tuple[str, ...] = Field(description="recordings that are to be explained")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that confirm findings")
    simulated: tuple[str, ...] = Field(default=(), description="recordings made in the user's own simulator")
    model: str | None = Field(default=None, description="model that an earlier diagnosis saved")
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")

    @property
    def command(self) -> tuple[str, ...]:
        """The command line that does the same."""
        compared = (*self.simulated, *self.inputs["model"])
        return task.command_words(
            "diagnose",
            self.robot,
            recordings=self.recordings,
            held_out=self.held_out,
            against=compared or (self.options.against,),
            cutoff=self.options.cutoff_hz,
            **({"headroom": True} if self.options.headroom else {}),
            **self.options.words,
        )


@dataclass(frozen=True, eq=False)
class Result(task.TaskResult):
    """What came of it."""

    held_out: tuple[Recording, ...]
    diagnosis: Diagnosis
    document: DiagnosisDocument
    planned: PlannedExperiment | None
    refusal: ExcitationError | None  # why the next motion cannot be planned within the robot's limits

    @property
    def outputs(self) -> task.Outputs:
        """documents, improved robot and scenario, exports, and the motion where one was planned."""
        made = {
            "plots.json": lambda: task.json_text(diagnosis_plots(self.diagnosis), None),
            "model.json": self._model,
            "scenario.yaml": lambda: scenario_text(self.diagnosis),
            "improved-robot.yaml": self._improved_robot,
            "report.html": self._report,
            "result.json": lambda: task.json_text(self.document),
            **{file.output: partial(self._export, kind) for kind, file in {**EXPORT_FILES, **CODE_FILES}.items()},
        }
        if self.planned is not None:
            trajectory = self.planned.trajectory
            made["trajectory.json"] = lambda: trajectory_json(trajectory)
            made["trajectory.csv"] = lambda: trajectory_csv(trajectory, DEFAULT_RATE_HZ)
        return task.Outputs(made)

    def _improved_robot(self) -> str:
        source = self.files.find("robot", self.request.robot)
        target = self.files.target("improved-robot.yaml")
        return improved_robot(self.diagnosis, source, source if target is None else target)

    def _export(self, export_format: ExportFormat) -> bytes:
        return make_export(export_format, of_diagnosis(self.diagnosis, self.origin))

    def _model(self) -> str:
        found = self.diagnosis
        plain = identified_document(found.identification) if found.findings else None
        return task.json_text(model_file(model_document(found), found.robot, self.origin, plain))

    def _report(self) -> str:
        from tauscope.report.diagnosis_report import diagnosis_report

        return diagnosis_report(self.diagnosis, self.document, self.provenance, self.planned)


def perform(request: Request, files: task.Files, progress: task.Progress) -> Result:
    """Read the files and diagnose the arm. Raises TauscopeError where the data or the robot cannot answer."""
    if request.options.against == "saved" and request.model is None:
        raise IdentificationError("against saved: no model was given; give one, or compare with something else")
    if request.options.headroom:
        from tauscope.headroom import require_black_box

        require_black_box(len(request.held_out))
    progress("read robot and recordings")
    robot = read_robot(files.find("robot", request.robot))
    saved = None if request.model is None else read_extended_model(files.find("model", request.model), robot)
    recordings = task.read_recordings(files, "recordings", request.recordings, robot, request.options)
    held_out = task.read_recordings(files, "held_out", request.held_out, robot, request.options)
    robot, recordings, held_out = make_efforts(robot, recordings, held_out)
    simulated = task.read_recordings(files, "simulated", request.simulated, robot, request.options)
    options = Options(cutoff_hz=request.options.cutoff_hz)
    found = diagnose(robot, recordings, held_out, options, progress)
    if simulated:
        progress("compare with the simulation")
        found = against_simulation(found, simulated, options)
    elif saved is not None:
        progress("compare with the saved model")
        found = compare_with_saved(found, saved)
    elif request.options.against == "model":
        progress("compare with the model")
        found = against_model(found)
    planned, refusal = None, None
    try:
        planned = planned_experiment(found, progress, asked=request.options.next_trajectory)
    except ExcitationError as error:
        progress(f"no next experiment: {error}")
        refusal = error
    headroom = None
    if request.options.headroom:
        from tauscope.headroom import measure_headroom

        progress("train a black box")
        headroom = measure_headroom(found)
    target = files.target("trajectory.json") or files.target("trajectory.csv")
    name = None if planned is None or target is None else str(target)
    told = document(found, planned, name, headroom)
    return Result(request, files, found.robot, recordings, held_out, found, told, planned, refusal)
