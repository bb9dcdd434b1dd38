"""Which arm is moved: what the request leaves open, the operator of the service has decided."""

from collections.abc import Sequence
from typing import Any, Literal

from pydantic import Field, FiniteFloat

from tauscope.errors import RobotFileError, ScenarioError
from tauscope.robot import Robot
from tauscope.robot.messages import one_line
from tauscope.runtime.drivers import BackendName, find_driver
from tauscope.server.http.documents import to_json_text
from tauscope.server.http.settings import Settings
from tauscope.strict_model import StrictModel
from tauscope.tasks.run import BackendChoice


class BackendRequest(StrictModel):
    """Which arm is moved; what is left out, the operator of the service has decided."""

    name: BackendName | None = Field(default=None, description="backend; null: the service's own")
    time: Literal["virtual", "real"] | None = Field(
        default=None,
        description="of the simulated arm: as fast as it computes, or by the clock; null: the service's own",
    )
    scenario: dict[str, Any] | None = Field(
        default=None, description="what the simulated arm conceals: content of a scenario file; null: nothing"
    )
    keep_settings: bool = Field(
        default=False, description="whether servos keep in EEPROM what a run changed; false: it is put back"
    )
    start: tuple[FiniteFloat, ...] | None = Field(
        default=None,
        max_length=100,
        description="where the simulated arm stands at first, one number a joint [rad or m]; null: at zero",
    )


def chosen_backend(settings: Settings, request: BackendRequest, robot: Robot) -> BackendChoice:
    """The backend of a request.

    Raises ScenarioError if the scenario is no plain data. Raises RobotFileError if a drive block names a file that the
    driver would open: no path of the server is opened for a client; or if an arm without a model is to be simulated.
    """
    if request.scenario is not None and to_json_text(request.scenario) is None:
        raise ScenarioError("scenario: holds NaN, infinity or text that is not Unicode; write plain numbers and text")
    name = request.name or settings.backend
    driver = find_driver(name)
    _refuse_files(robot, driver.file_keys)
    if driver.is_simulated and len(robot.model.links or ()) != robot.link_count:
        raise RobotFileError(
            f"{robot.name}: the {name} backend needs a model: mass, first_moment and inertia of all {robot.link_count}"
            " links; state model.links, give a URDF with inertials, or take the improved robot of a diagnosis"
        )
    return BackendChoice(
        name=name,
        time=request.time or settings.sim_time,
        scenario=request.scenario,
        start=request.start,
        keep_settings=request.keep_settings,
    )


def _refuse_files(robot: Robot, keys: Sequence[str]) -> None:
    """Refuse drives' own files: nothing in a request would bring them."""
    for joint in robot.joints:
        for key in keys:
            if (joint.drive or {}).get(key) is not None:
                hint = "leave it out, or run this arm with tauscope run"
                raise RobotFileError(one_line(f"{joint.name}: drive.{key} names a file, which cannot be sent; {hint}"))
