"""Which arm is moved: what the request leaves open, the operator of the service has decided."""

from typing import Any, Literal

from pydantic import Field, FiniteFloat

from service.api.documents import to_json_text
from service.api.models import StrictModel
from service.api.settings import Settings
from service.errors import ScenarioError
from service.jobs import BackendChoice


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


def chosen_backend(settings: Settings, request: BackendRequest) -> BackendChoice:
    """The backend of a request.

    Parameters
    ----------
    settings : Settings
        of the operator
    request : BackendRequest
        what was asked for

    Raises
    ------
    ScenarioError
        if the scenario is no plain data
    """
    if request.scenario is not None and to_json_text(request.scenario) is None:
        raise ScenarioError("scenario: holds NaN, infinity or text that is not Unicode; write plain numbers and text")
    return BackendChoice(
        name=request.name or settings.backend,
        time=request.time or settings.sim_time,
        scenario=request.scenario,
        start=request.start,
    )
