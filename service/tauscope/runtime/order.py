"""The order that a control process carries out: everything that it needs to know, as one JSON file."""

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from tauscope.errors import AcquisitionError
from tauscope.files import write_atomically
from tauscope.robot.messages import one_line
from tauscope.runtime.drivers import DEFAULT_BACKEND
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import ORDER_FILE
from tauscope.runtime.stored import StoredModel


class BackendOrder(StoredModel):
    """Which backend, and its own settings."""

    name: str = Field(default=DEFAULT_BACKEND, description="name of a driver")
    settings: dict[str, Any] = Field(default_factory=dict, description="the driver's own options")


class RunOrder(StoredModel):
    """One run."""

    form: Literal["tauscope.order/1"] = Field(default="tauscope.order/1", description="name and version of this form")
    robot: str = Field(description="path of the robot file")
    trajectory: str = Field(description="path of the trajectory file")
    backend: BackendOrder = Field(default_factory=BackendOrder, description="what moves the arm")
    options: RunOptions = Field(default_factory=RunOptions, description="how the run is to be made")


def write_order(folder: Path, order: RunOrder) -> None:
    """Write ``order.json``.

    Raises
    ------
    OSError
        the disk does not take it
    """
    write_atomically(folder / ORDER_FILE, order.model_dump_json(indent=1).encode())


def read_order(folder: Path) -> RunOrder:
    """Read ``order.json``.

    Raises
    ------
    AcquisitionError
        there is none, or it is not valid
    """
    path = folder / ORDER_FILE
    try:
        return RunOrder.model_validate_json(path.read_bytes())
    except OSError as error:
        raise AcquisitionError(f"{path}: cannot be read ({error.strerror or error})") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "document"
        raise AcquisitionError(one_line(f"{path}: {place}: {first['msg']}; correct the order")) from None
