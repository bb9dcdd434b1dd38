"""Which run was asked for: robot, backend, motion and options, as they are kept with the run."""

from typing import Any, Literal

from pydantic import Field, FiniteFloat

from tauscope.runtime.drivers import DEFAULT_BACKEND
from tauscope.runtime.options import RunOptions
from tauscope.server.queue.stored import StoredModel


class BackendChoice(StoredModel):
    """Which arm is moved."""

    name: str = Field(default=DEFAULT_BACKEND, description="backend: name of a driver, installed or not")
    time: Literal["virtual", "real"] = Field(
        default="virtual", description="of the simulated arm: as fast as it computes, or by the clock"
    )
    scenario: dict[str, Any] | None = Field(
        default=None,
        description="what the simulated arm conceals: content of a scenario file; null: nothing",
    )

    start: tuple[FiniteFloat, ...] | None = Field(
        default=None, max_length=100, description="where the simulated arm stands at first, one number a joint"
    )

    def device(self, robot_name: str) -> str:
        """What names the arm: one run at a time has it."""
        return f"{robot_name} on {self.name}"


class RunRequestRecord(StoredModel):
    """What was asked for."""

    form: Literal["tauscope.run-request/1"] = Field(
        default="tauscope.run-request/1", description="name and version of this form"
    )
    robot_file: str = Field(description="name of the robot file in the run's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")
    device: str = Field(description="names the arm: one run at a time has it")
    excitation: str | None = Field(
        default=None, description="identifier of the excitation that is played; null for a trajectory from elsewhere"
    )
    campaign: str | None = Field(default=None, description="identifier of the campaign that it belongs to")
    options: RunOptions = Field(default=RunOptions(), description="how it is run")
