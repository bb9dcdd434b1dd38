"""Which arm is moved: what the request leaves open, the operator of the service has decided."""

from typing import Any, Literal

from pydantic import Field, FiniteFloat

from tauscope.errors import RobotFileError, ScenarioError
from tauscope.robot import Robot
from tauscope.robot.messages import one_line
from tauscope.server.http.documents import to_json_text
from tauscope.server.http.settings import Settings
from tauscope.server.models import StrictModel
from tauscope.tasks.run import BackendChoice


class BackendRequest(StrictModel):
    """Which arm is moved; what is left out, the operator of the service has decided."""

    name: Literal["sim", "dynamixel", "canopen"] | None = Field(
        default=None, description="backend; null: the service's own"
    )
    time: Literal["virtual", "real"] | None = Field(
        default=None,
        description="of the simulated arm: as fast as it computes, or by the clock; null: the service's own",
    )
    scenario: dict[str, Any] | None = Field(
        default=None, description="what the simulated arm conceals: content of a scenario file; null: nothing"
    )
    start: tuple[FiniteFloat, ...] | None = Field(
        default=None,
        max_length=100,
        description="where the simulated arm stands at first, one number a joint [rad or m]; null: at zero",
    )


def chosen_backend(settings: Settings, request: BackendRequest, robot: Robot) -> BackendChoice:
    """The backend of a request.

    Raises
    ------
    ScenarioError
        if the scenario is no plain data
    RobotFileError
        if a drive block names a file that the driver would open: no path of the server is opened for a client
    """
    if request.scenario is not None and to_json_text(request.scenario) is None:
        raise ScenarioError("scenario: holds NaN, infinity or text that is not Unicode; write plain numbers and text")
    name = request.name or settings.backend
    if name == "canopen":
        _refuse_data_sheets(robot)
    return BackendChoice(
        name=name,
        time=request.time or settings.sim_time,
        scenario=request.scenario,
        start=request.start,
    )


def _refuse_data_sheets(robot: Robot) -> None:
    """Refuse drives' EDS or DCF files: nothing in a request would bring them."""
    for joint in robot.joints:
        if (joint.drive or {}).get("eds") is not None:
            hint = "leave it out, or run this arm with tauscope run"
            raise RobotFileError(one_line(f"{joint.name}: drive.eds names a file, which cannot be sent; {hint}"))
