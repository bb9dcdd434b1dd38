"""The order of a run as one JSON file: robot, trajectory, backend, and options, which all have defaults."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AliasChoices, Field, FiniteFloat, ValidationError

from tauscope.errors import AcquisitionError
from tauscope.files import write_atomically
from tauscope.robot import Joint
from tauscope.runtime.drivers import DEFAULT_BACKEND
from tauscope.strict_model import StrictModel
from tauscope_drivers import Capabilities, ControlMode, StopPolicy

DEFAULT_RATE_HZ = 500.0  # cycles a second where nothing is stated and the bus allows as many
RELEASE = "release"  # stop policy: hold, and let go once the arm stands still
Positive = Annotated[FiniteFloat, Field(gt=0.0)]


class RunOptions(StrictModel, strict=False):
    """How a run is to be made."""

    mode: ControlMode = Field(default=ControlMode.POSITION, description="who closes the loop: the drives, or the host")
    rate_hz: Positive | None = Field(
        default=None, le=10_000, description="cycles a second; null for 500, or what the bus allows where that is less"
    )
    stop_policy: StopPolicy | Literal["release"] | None = Field(
        default=None,
        description="hold, damp, torque_off, or release (hold, then let go once the arm stands still); "
        "null for what the robot file's drives say, else hold",
    )
    watchdog_s: Positive = Field(default=0.1, le=10, description="time without a cycle until the device stops itself")
    heartbeat_s: Positive = Field(default=1.0, le=60, description="silence of the owner until a real-time run ends")
    following_error: Positive | None = Field(default=None, description="of arm and target; null: 0.2 rad or 0.05 m")
    # The second names are those of earlier versions, which stored runs have.
    missed: int = Field(
        default=3,
        ge=1,
        le=1000,
        validation_alias=AliasChoices("missed", "stale_misses"),
        description="readings in a row that a joint may not fail to answer",
    )
    lost_s: Positive = Field(
        default=0.05,
        validation_alias=AliasChoices("lost_s", "stale_s"),
        description="time after which a joint that does not answer counts as lost",
    )
    stale_ms: Positive = Field(default=1.0, le=1000, description="how late an answer may come and still be a sample")
    least_kept: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = Field(
        default=0.98, description="share of the motion's samples that has to be kept, else the run ends as degraded"
    )
    temperature_c: Positive = Field(default=80.0, description="hottest motor that is allowed")
    feed_forward: bool = Field(default=True, description="whether the drives get the model's predicted torque")
    bandwidth_rad_s: Positive = Field(default=25.0, description="of the host's loop in torque mode")
    settle_s: Annotated[FiniteFloat, Field(ge=0.0, le=60)] = Field(default=0.25, description="pause after the ramp")
    acknowledge_faults: bool = Field(default=False, description="whether latched drive faults are cleared first")


def choose_rate_hz(options: RunOptions, capabilities: Capabilities) -> float:
    """Cycles a second of a run. Raises AcquisitionError where more is asked for than the bus allows."""
    largest = capabilities.largest_rate_hz
    if options.rate_hz is None:
        return min(DEFAULT_RATE_HZ, largest)
    if options.rate_hz > largest:
        limit = f" ({capabilities.rate_limited_by})" if capabilities.rate_limited_by else ""
        raise AcquisitionError(
            f"{options.rate_hz:g} cycles a second are more than this arm's bus allows{limit}; ask for at most "
            f"{largest:.4g}"
        )
    return options.rate_hz


def choose_stop_policy(
    options: RunOptions, joints: Sequence[Joint], capabilities: Capabilities | None = None
) -> StopPolicy:
    """As the run says, else the drives, else hold. Raises AcquisitionError where there are several, or none can."""
    wanted = options.stop_policy or _read_policy(joints)
    policy = StopPolicy.HOLD if wanted == RELEASE else StopPolicy(wanted)
    if capabilities is not None and policy not in (able := capabilities.policies_in(options.mode)):
        raise AcquisitionError(
            f"stop policy {policy}: this arm's drives cannot do that by themselves in mode {options.mode}; "
            f"choose {', '.join(sorted(able))}"
        )
    return policy


def is_released(options: RunOptions, joints: Sequence[Joint]) -> bool:
    """Whether the arm is let go at the end. Raises AcquisitionError where it is not said to be safe without torque."""
    if options.stop_policy not in (None, RELEASE):
        return False
    is_stated = _read_policy(joints) == RELEASE
    if options.stop_policy == RELEASE and not is_stated:
        raise AcquisitionError(
            "stop policy release: the robot file does not state that the arm is safe without torque; state "
            "drive.stop_policy: release for its joints, or choose hold or torque_off"
        )
    return is_stated


def _read_policy(joints: Sequence[Joint]) -> str:
    stated: dict[str, str] = {}
    for joint in joints:
        value: Any = (joint.drive or {}).get("stop_policy")
        if value is None:
            continue
        if value not in (known_policies := [*StopPolicy, RELEASE]):
            known = ", ".join(known_policies)
            raise AcquisitionError(f"{joint.name}: drive.stop_policy is {str(value)[:60]!r}; choose one of {known}")
        stated.setdefault(str(value), joint.name)
    if len(stated) > 1:
        words = " and ".join(f"{policy} ({name})" for policy, name in stated.items())
        raise AcquisitionError(f"the robot file's drives ask for different stop policies, {words}; let them agree")
    return next(iter(stated), StopPolicy.HOLD)


ORDER_FILE = "order.json"


class BackendOrder(StrictModel):
    name: str = Field(default=DEFAULT_BACKEND, description="name of a driver")
    settings: dict[str, Any] = Field(default_factory=dict, description="the driver's own options")


class RunOrder(StrictModel):
    form: Literal["tauscope.order/1"] = Field(default="tauscope.order/1", description="name and version of this form")
    robot: str = Field(description="path of the robot file")
    trajectory: str = Field(description="path of the trajectory file")
    backend: BackendOrder = Field(default_factory=BackendOrder, description="what moves the arm")
    options: RunOptions = Field(default_factory=RunOptions, description="how the run is to be made")


def write_order(folder: Path, order: RunOrder) -> None:
    """Write ``order.json``. Raises OSError where the disk does not take it."""
    write_atomically(folder / ORDER_FILE, order.model_dump_json(indent=1).encode())


def read_order(folder: Path) -> RunOrder:
    """Read ``order.json``. Raises AcquisitionError where there is none, or it is not valid."""
    path = folder / ORDER_FILE
    try:
        return RunOrder.model_validate_json(path.read_bytes())
    except OSError as error:
        raise AcquisitionError(f"{path}: cannot be read ({error.strerror or error})") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "document"
        raise AcquisitionError(f"{path}: {place}: {first['msg']}; correct the order") from None
