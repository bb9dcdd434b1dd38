"""Run: move an arm and record it, in a control process of its own."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, FiniteFloat

from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import DEFAULT_BACKEND, find_driver
from tauscope.runtime.loop import Report
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.record import JOURNAL_FILE, RECORDING_STEM, RunRecord
from tauscope.runtime.run_process import RunProcess
from tauscope.strict_model import StrictModel
from tauscope.tasks import design_excitation
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.task import Files, Progress

TRAJECTORY = "trajectory.json"


class BackendChoice(StrictModel):
    """Which arm is moved."""

    name: str = Field(default=DEFAULT_BACKEND, description="backend: name of a driver, installed or not")
    time: Literal["virtual", "real"] = Field(
        default="virtual", description="of the simulated arm: as fast as it computes, or by the clock"
    )
    scenario: dict[str, Any] | None = Field(
        default=None, description="what the simulated arm conceals: content of a scenario file; null: nothing"
    )
    keep_settings: bool = Field(
        default=False, description="whether servos keep in EEPROM what a run changed; false: it is put back"
    )
    start: tuple[FiniteFloat, ...] | None = Field(
        default=None, max_length=100, description="where the simulated arm stands at first, one number a joint"
    )

    def device(self, robot_name: str) -> str:
        """What names the arm: one run at a time has it."""
        return f"{robot_name} on {self.name}"


class Request(StrictModel):
    """Which run is wanted, by the names of its files.

    A scenario is either a file here, or content of `backend`, which whoever resolves the files has written to one.
    """

    robot: str = Field(description="robot file")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")
    scenario: str | None = Field(default=None, description="scenario file of the simulated arm")
    trajectory: str | None = Field(
        default=None, description="motion to play; null: the default excitation is designed first"
    )
    seed: int = Field(default=0, ge=0, lt=2**63, description="of the default excitation")
    options: RunOptions = Field(default=RunOptions(), description="how it is run")


@dataclass(frozen=True, eq=False)
class Result:
    """What came of it."""

    robot: Robot
    record: RunRecord
    folder: Path

    def recording(self, format_: str) -> Path | None:
        """The recording as `csv`, `parquet` or `mcap`; None where nothing was recorded in that format."""
        path = recording_file(self.folder, format_)
        samples = 0 if self.record.recording is None else self.record.recording.samples
        return path if path.is_file() and (samples or format_ == "mcap") else None


def perform(request: Request, files: Files, progress: Progress) -> Result:
    """Design where no motion is given, run to the end; Ctrl-C stops the arm and is waited for.

    The run's folder is the target `run` of the files. Raises TauscopeError where the run cannot start.
    """
    folder = files.target("run")
    assert folder is not None  # noqa: S101 - a run has a folder
    robot, trajectory = read_robot(files.find("robot", request.robot)), folder.parent / TRAJECTORY
    if request.trajectory is None:
        options = ExcitationDesignOptions(seed=request.seed, following_error=request.options.following_error)
        wanted = design_excitation.Request(robot=request.robot, options=options)
        designed = design_excitation.perform(wanted, files, progress)
        trajectory.write_bytes(designed.outputs[TRAJECTORY])
    else:
        trajectory = files.find("trajectory", request.trajectory)
    process = start(request, files, trajectory, folder, lambda event: _tell(event, progress))
    while True:
        try:
            return Result(robot, process.wait(), folder)
        except KeyboardInterrupt:
            progress("stopping the arm")
            process.stop()


def start(
    request: Request,
    files: Files,
    trajectory: Path,
    folder: Path,
    report: Report,
    *,
    sim_socket: Path | None = None,
    beats_by_itself: bool = True,
) -> RunProcess:
    """Start the control process. Raises RobotFileError for the robot file, AcquisitionError for the process."""
    robot_file, backend = files.find("robot", request.robot), request.backend
    settings: dict[str, Any] = {
        "time": backend.time,
        "scenario": request.scenario and str(files.find("scenario", request.scenario).resolve()),
        "start": backend.start and list(backend.start),
        "keep_settings": backend.keep_settings or None,
        "socket": str(sim_socket) if sim_socket is not None and backend.time == "real" else None,
    }
    options = find_driver(backend.name).option_names
    settings = {name: value for name, value in settings.items() if name in options and value is not None}
    order = RunOrder(
        robot=str(robot_file.resolve()),
        trajectory=str(trajectory.resolve()),
        backend=BackendOrder(name=backend.name, settings=settings),
        options=request.options,
    )
    return RunProcess(folder, order, read_robot(robot_file), report=report, beats_by_itself=beats_by_itself)


def recording_file(folder: Path, format_: str) -> Path:
    """Where the recording of a format lies in a run's folder; the journal is the MCAP, ramp included."""
    return folder / (JOURNAL_FILE if format_ == "mcap" else f"{RECORDING_STEM}.{format_}")


def _tell(event: Any, progress: Callable[..., None]) -> None:
    if event["event"] == "progress":
        step = f"{event['state']}, {event['time_s']:.1f} of {event['duration_s']:.1f} s"
        progress(step, float(event["percent"]), event)
    elif event["event"] == "state":
        progress(event["state"])
