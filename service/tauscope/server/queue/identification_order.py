"""What is to be identified: the robot's file, the recordings and the options, as they are kept with the job."""

from typing import Annotated, Literal

from pydantic import Field

from tauscope.identification import Estimator, Options
from tauscope.server.queue.stored import StoredModel


class OrderedRecording(StoredModel):
    """A recording of an order."""

    name: str = Field(description="its file name")
    origin: Literal["uploaded", "server"] = Field(description="sent with the request, or lying on the server")
    sha256: str = Field(description="of its bytes when the job was handed in, in hexadecimal")


CutoffFrequency = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class IdentificationOptions(StoredModel):
    """How an identification is done."""

    estimator: Literal["ls", "wls"] = Field(default="wls", description="how the joints' equations are weighted")
    cutoff_hz: CutoffFrequency | Literal["auto"] | None = Field(
        default="auto",
        description="band that torque and regressor share [Hz]; auto: chosen from the data; null: no filter",
    )
    rotor_inertia: bool = Field(default=True, description="whether rotors are added where the data ask for them")

    def to_options(self) -> Options:
        """The options as identification takes them."""
        return Options(Estimator(self.estimator), self.cutoff_hz, self.rotor_inertia)


class IdentificationOrder(StoredModel):
    """Input of an identification job."""

    form: Literal["tauscope.order/1"] = Field(default="tauscope.order/1", description="name and version of this form")
    robot_file: str = Field(description="name of the robot file in the job's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    recordings: tuple[OrderedRecording, ...] = Field(description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")

    @property
    def command(self) -> tuple[str, ...]:
        """The command line that does the same with the same files."""
        options = self.options
        cutoff = "none" if options.cutoff_hz is None else str(options.cutoff_hz)
        words = ["tauscope", "identify", self.robot_file, *(entry.name for entry in self.recordings)]
        words += ["--held-out", *(entry.name for entry in self.held_out)] if self.held_out else []
        words += ["--estimator", options.estimator, "--cutoff", cutoff]
        return (*words, "--rotor-inertia" if options.rotor_inertia else "--no-rotor-inertia")
