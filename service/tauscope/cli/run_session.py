"""``tauscope run``: design where nothing is given, run in a process of its own, keep the recording, show what came."""

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typer

from tauscope.cli.output_files import keep_file, require_new
from tauscope.cli.run_summary import show_run
from tauscope.cli.terminal import Told, output, plain, shown_progress
from tauscope.errors import AcquisitionError
from tauscope.excitation import ExcitationOptions, OptimiserProgress, design_excitation
from tauscope.robot import Robot, read_robot
from tauscope.robot.messages import one_line
from tauscope.runtime import BackendOrder, RunOptions, RunOrder, RunProcess, RunRecord, RunState
from tauscope.runtime.record import JOURNAL_FILE, RECORDING_STEM
from tauscope.trajectory import write_trajectory

SUFFIXES = (".csv", ".parquet", ".mcap")
"""Formats of a recording, by suffix."""


@dataclass(frozen=True)
class Request:
    """What was asked for on the command line.

    start : tuple of float or None
        where the simulated arm stands at first [rad or m]
    """

    robot: Path
    backend: str = "sim"
    trajectory: Path | None = None
    out: Path | None = None
    scenario: Path | None = None
    time: str = "virtual"
    start: tuple[float, ...] | None = None
    options: RunOptions = RunOptions()  # noqa: RUF009 - frozen
    seed: int = 0

    @property
    def backend_order(self) -> BackendOrder:
        """The backend with its settings.

        Raises
        ------
        typer.BadParameter
            where the simulated arm's settings are given for another backend
        """
        if self.backend != "sim":
            given = [name for name in ("scenario", "start") if getattr(self, name) is not None]
            if given or self.time != "virtual":
                raise typer.BadParameter(f"--{(given or ['time'])[0]} belongs to --backend sim")
            return BackendOrder(name=self.backend)
        settings: dict[str, Any] = {"time": self.time}
        if self.scenario is not None:
            settings["scenario"] = str(self.scenario.resolve())
        if self.start is not None:
            settings["start"] = list(self.start)
        return BackendOrder(name=self.backend, settings=settings)


def run_arm(request: Request) -> None:
    """Do what the command line asks for.

    Raises
    ------
    typer.BadParameter
        where an option is out of place
    TauscopeError
        where the run cannot start, or ended before its time
    """
    backend, robot, out = request.backend_order, read_robot(request.robot), _output(request)
    folder, is_settled = _folder_beside(out), False
    try:
        with shown_progress() as told:
            trajectory = request.trajectory or _design(robot, request.seed, folder, told)
            order = RunOrder(
                robot=str(request.robot.resolve()),
                trajectory=str(trajectory.resolve()),
                backend=backend,
                options=request.options,
            )
            record = run_to_end(folder / "run", order, robot, told)
        made = keep_recording(folder / "run", record, out)
        is_settled = True
    finally:
        # Whatever happened, a journal that nobody has saved stays.
        if is_settled or not (folder / "run" / JOURNAL_FILE).exists():
            shutil.rmtree(folder, ignore_errors=True)
    show_run(output(), record, robot)
    if made:
        output().print(plain(f"wrote {out}"), soft_wrap=True)
    if record.state is not RunState.FINISHED:
        raise AcquisitionError(why_unfinished(record, out if made else None))


def run_to_end(folder: Path, order: RunOrder, robot: Robot, told: Told) -> RunRecord:
    """Run in a process of its own; Ctrl-C stops the arm and is waited for."""
    process = RunProcess(folder, order, robot, report=lambda event: _report(event, told))
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            told("stopping the arm", None)
            process.stop()


def keep_recording(folder: Path, record: RunRecord, out: Path) -> bool:
    """Give the recording of a run its place; no file is ever replaced.

    Returns
    -------
    bool
        False where nothing was recorded

    Raises
    ------
    ExportError
        if there is such a file by now, or it cannot be written
    """
    suffix = out.suffix.lower()
    name = JOURNAL_FILE if suffix == ".mcap" else f"{RECORDING_STEM}{suffix}"
    samples = 0 if record.recording is None else record.recording.samples
    if not (folder / name).is_file() or not (samples or suffix == ".mcap"):
        return False
    keep_file(folder / name, out)
    return True


def why_unfinished(record: RunRecord, recording: Path | None) -> str:
    """One line on a run that did not finish."""
    reason = record.stop if record.problem is None else record.problem.detail
    kept = "nothing was recorded" if recording is None else f"what was recorded until then is in {recording}"
    return one_line(f"the run {record.state}: {reason or 'no reason is known'}; {kept}")


def _output(request: Request) -> Path:
    """The recording to make, refused before any work where it cannot be made."""
    out = request.out or Path(f"run-{datetime.now(UTC):%Y%m%dT%H%M%SZ}.csv")
    if out.suffix.lower() not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise typer.BadParameter(f"{str(out)!r}: the suffix names no format; use {known}", param_hint="'--out'")
    if out.suffix.lower() == ".parquet" and find_spec("pyarrow") is None:
        raise AcquisitionError(f"{out}: Parquet needs pyarrow, which is not installed; name a .csv file")
    require_new(out)
    return out


def _folder_beside(out: Path) -> Path:
    """A hidden folder beside the recording, on the same disk; what is in it outlives a crash."""
    try:
        return Path(tempfile.mkdtemp(prefix=".tauscope-run-", dir=out.resolve().parent))
    except OSError as error:
        raise AcquisitionError(
            f"{out}: cannot be written there ({error.strerror or error}); choose another place"
        ) from error


def _design(robot: Robot, seed: int, folder: Path, told: Callable[[str, float | None], None]) -> Path:
    """The default excitation, as a file."""

    def tell(progress: OptimiserProgress) -> None:
        told("design the motion", 100.0 * progress.fraction)

    told("design the motion", 0.0)
    design = design_excitation(robot, ExcitationOptions(seed=seed), progress=tell)
    write_trajectory(design.trajectory, folder / "trajectory.json")
    return folder / "trajectory.json"


def _report(event: Any, told: Told) -> None:
    """Show what the control process says."""
    if event["event"] == "progress":
        told(f"{event['state']}, {event['time_s']:.1f} of {event['duration_s']:.1f} s", float(event["percent"]))
    elif event["event"] == "state":
        told(event["state"], None)
