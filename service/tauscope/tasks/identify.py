"""Identify: the parameters of an arm from its recordings."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

from pydantic import Field

from tauscope.actuation import make_efforts
from tauscope.export.formats import EXPORT_FILES, ExportFormat, make_export
from tauscope.export.model import of_identification
from tauscope.export.model_file import identified_document, model_file
from tauscope.identification import Estimator, Identification, IdentificationDocument, Options, document, identify
from tauscope.recording import Recording
from tauscope.robot import read_robot
from tauscope.tasks import task

CutoffFrequency = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class IdentificationOptions(task.ReadingOptions):
    """How an identification is done."""

    estimator: Literal["ls", "wls"] = Field(default="wls", description="how the joints' equations are weighted")
    cutoff_hz: CutoffFrequency | Literal["auto"] | None = Field(
        default="auto",
        description="band that torque and regressor share [Hz]; auto: chosen from the data; null: no filter",
    )
    rotor_inertia: bool = Field(default=True, description="whether rotors are added where the data ask for them")
    prior: bool = Field(
        default=True,
        description="whether the most probable bodies are delivered; false: the free least-squares estimate",
    )


class Request(task.TaskRequest):
    """What is to be identified, by the names of its files."""

    recordings: tuple[str, ...] = Field(description="recordings that the model is made from")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that it is judged by")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")


@dataclass(frozen=True, eq=False)
class Result(task.TaskResult):
    """What came of it."""

    held_out: tuple[Recording, ...]
    identification: Identification
    document: IdentificationDocument

    @property
    def outputs(self) -> task.Outputs:
        """``result.json``, ``model.json``, ``plots.json``, ``report.html``, and ``exports/…`` as in `EXPORT_FILES`."""
        exports = {file.output: partial(self._export, kind) for kind, file in EXPORT_FILES.items()}
        documents = {"plots.json": self._plots, "report.html": self._report, "model.json": self._model}
        return task.Outputs({**documents, "result.json": partial(task.json_text, self.document), **exports})

    def _plots(self) -> str:
        from tauscope.report.curves import identification_plots

        return task.json_text(identification_plots(self.identification, self.recordings, self.held_out), None)

    def _report(self) -> str:
        from tauscope.report.identification_report import identification_report

        return identification_report(self.identification, self.recordings, self.held_out, self.provenance)

    def _export(self, export_format: ExportFormat) -> bytes:
        return make_export(export_format, of_identification(self.identification, self.origin))

    def _model(self) -> str:
        return task.json_text(model_file(identified_document(self.identification), self.robot, self.origin))


def perform(request: Request, files: task.Files, progress: task.Progress) -> Result:
    """Read the files and identify the arm. Raises TauscopeError where the data or the robot cannot answer."""
    progress("read robot and recordings")
    robot = read_robot(files.find("robot", request.robot))
    recordings = task.read_recordings(files, "recordings", request.recordings, robot, request.options)
    held_out = task.read_recordings(files, "held_out", request.held_out, robot, request.options)
    robot, recordings, held_out = make_efforts(robot, recordings, held_out)
    asked = request.options
    options = Options(Estimator(asked.estimator), asked.cutoff_hz, asked.rotor_inertia, asked.prior)
    found = identify(robot, recordings, held_out, options, progress)
    return Result(request, files, robot, recordings, held_out, found, document(found))
