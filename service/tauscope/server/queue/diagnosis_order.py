"""What is to be diagnosed, as it is kept with the job."""

from typing import Literal

from pydantic import Field

from tauscope.identification import Options
from tauscope.server.queue.identification_order import CutoffFrequency, OrderedRecording
from tauscope.server.queue.stored import StoredModel


class DiagnosisOptions(StoredModel):
    """How a diagnosis is done."""

    against: Literal["identified", "model", "simulation"] = Field(
        default="identified",
        description="what the recordings are compared with: the best model that they allow, the robot file's model"
        " block, or recordings of a simulator",
    )
    cutoff_hz: CutoffFrequency | Literal["auto"] | None = Field(
        default="auto", description="band of the nominal model's identification [Hz]; auto: chosen; null: no filter"
    )
    next_trajectory: bool = Field(
        default=False, description="whether the next motion is planned also where nothing is open"
    )

    def to_options(self) -> Options:
        """The options as identification takes them."""
        return Options(cutoff_hz=self.cutoff_hz)


class DiagnosisOrder(StoredModel):
    """Input of a diagnosis job."""

    form: Literal["tauscope.diagnosis-order/1"] = Field(
        default="tauscope.diagnosis-order/1", description="name and version of this form"
    )
    robot_file: str = Field(description="name of the robot file in the job's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    recordings: tuple[OrderedRecording, ...] = Field(description="what is to be explained")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what findings are confirmed by")
    simulated: tuple[OrderedRecording, ...] = Field(default=(), description="what the user's simulator recorded")
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")

    @property
    def command(self) -> tuple[str, ...]:
        """The command line that does the same with the same files."""
        options = self.options
        cutoff = "none" if options.cutoff_hz is None else str(options.cutoff_hz)
        words = ["tauscope", "diagnose", self.robot_file, *(entry.name for entry in self.recordings)]
        words += ["--held-out", *(entry.name for entry in self.held_out)] if self.held_out else []
        against = [entry.name for entry in self.simulated] or [options.against]
        return (*words, "--against", *against, "--cutoff", cutoff)
