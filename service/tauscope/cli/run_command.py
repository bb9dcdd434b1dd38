"""``tauscope run``: perform the task beside the file to make, keep the recording, show what came."""

import shutil
import tempfile
from collections.abc import Collection
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from typer import Option

from tauscope.cli.arguments import RobotFile, name_input
from tauscope.cli.device_command import show_frames
from tauscope.cli.task_run import keep_file, parse_suffix, require_new
from tauscope.cli.terminal import output, say, show_progress, table
from tauscope.cli.verbs import OptionsOf, make_request, parse_numbers
from tauscope.errors import AcquisitionError, explain_os_errors, one_line
from tauscope.number_text import ABSENT, counted, significant
from tauscope.recording.convert import FORMATS
from tauscope.report.tables import Table
from tauscope.robot import Robot
from tauscope.runtime.drivers import DEFAULT_BACKEND, BackendName, driver_names, find_driver
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord
from tauscope.runtime.states import RunState
from tauscope.tasks import run as task
from tauscope.tasks.task import Files

Trajectory = Annotated[
    Path | None,
    name_input("Motion to play: a trajectory (JSON, CSV). A default one is designed where none is given.", "FILE"),
]
Out = Annotated[
    Path | None,
    Option(
        metavar="RECORDING",
        dir_okay=False,
        help="File to make: .csv, .parquet, or .mcap (with the ramp). Never replaces a file; run-TIME.csv by default.",
    ),
]
Scenario = Annotated[Path | None, name_input("What the simulated arm conceals (YAML).", "FILE")]
HELD = (
    "! The arm is under power where it stopped, and its watchdog is off. Support it, then let go of it with: tauscope "
    "release."
)


def run(
    robot: RobotFile,
    *,
    backend: Annotated[BackendName, Option(help="What moves the arm.")] = DEFAULT_BACKEND,
    trajectory: Trajectory = None,
    out: Out = None,
    scenario: Scenario = None,
    time: Annotated[
        Literal["virtual", "real"], Option(help="Of the simulated arm: as fast as it computes, or by the clock.")
    ] = "virtual",
    start: Annotated[
        str | None, Option(metavar="Q1,Q2,...", help="First posture of the simulated arm [rad or m].")
    ] = None,
    options: Annotated[dict[str, Any], OptionsOf(RunOptions)],
    seed: Annotated[int, Option(min=0, help="Of the default excitation.")] = 0,
    keep_settings: Annotated[
        bool, Option("--keep-settings", help="Leave in servos' EEPROM what the run changed; else it is put back.")
    ] = False,
    dry_run: Annotated[bool, Option("--dry-run", help="Show the bus frames of the run, and send none.")] = False,
) -> None:
    """Move an arm and record it.

    Ctrl-C stops the arm by its stop policy; what was recorded until then is kept, and the exit status is 1.
    """
    posture = None if start is None else parse_numbers(start, "--start")
    given = {"scenario": scenario, "start": start, "time": None if time == "virtual" else time}
    given["keep_settings"] = keep_settings or None
    require_options(backend, [name for name, value in given.items() if value is not None])
    made = make_request(RunOptions, **options)
    if dry_run:
        return show_frames(robot, backend, trajectory, made)
    request = task.Request(
        robot=str(robot),
        backend=make_request(task.BackendChoice, name=backend, time=time, start=posture, keep_settings=keep_settings),
        scenario=None if scenario is None else str(scenario),
        trajectory=None if trajectory is None else str(trajectory),
        seed=seed,
        options=made,
    )
    _run_arm(request, out)


def require_options(backend: str, options: Collection[str]) -> None:
    """Refuse options that a driver does not have. Raises typer.BadParameter naming the drivers that have the option."""
    for option in options:
        owners = [name for name in driver_names() if option in find_driver(name).option_names]
        if backend not in owners:
            raise typer.BadParameter(f"--{option.replace('_', '-')} belongs to --backend {' or '.join(owners)}")


def _run_arm(request: task.Request, asked: Path | None) -> None:
    """Raises typer.BadParameter, or TauscopeError where the run cannot start or ended before its time."""
    out = _output(asked)
    with explain_os_errors(AcquisitionError, f"{out}: cannot be written there", "; choose another place"):
        # Beside the recording, on the same disk: what is in it outlives a crash.
        folder = Path(tempfile.mkdtemp(prefix=".tauscope-run-", dir=out.resolve().parent))
    is_settled = False
    try:
        with show_progress() as told:
            result = task.perform(request, Files({"run": folder / "run"}), told)
        made = keep_recording(result, out)
        journal = None if made else _unsaved_journal(result)
        is_settled = journal is None
    finally:
        # Whatever happened, a journal that nobody has saved stays.
        if is_settled or not task.recording_file(folder / "run", "mcap").exists():
            shutil.rmtree(folder, ignore_errors=True)
    show_run(output(), result.record, result.robot)
    if made:
        say(f"wrote {out}")
    if result.record.state is not RunState.FINISHED:
        raise AcquisitionError(explain_unfinished(result.record, out if made else None, journal))


def keep_recording(result: task.Result, out: Path) -> bool:
    """Name the recording; False where nothing was recorded. Raises ExportError if it cannot be kept."""
    recording = result.recording(out.suffix.lower().removeprefix("."))
    if recording is not None:
        keep_file(recording, out)
    return recording is not None


def _unsaved_journal(result: task.Result) -> Path | None:
    """The journal of a run whose recording could not be saved; None where it holds nothing."""
    journal, recording = task.recording_file(result.folder, "mcap"), result.record.recording
    is_empty = recording is not None and not recording.samples and not recording.remarks
    return None if is_empty or not journal.exists() else journal


def explain_unfinished(record: RunRecord, recording: Path | None, journal: Path | None = None) -> str:
    reason = record.stop if record.problem is None else record.problem.detail
    until = "" if record.state is RunState.DEGRADED else " until then"
    kept = "nothing was recorded" if recording is None else f"what was recorded{until} is in {recording}"
    if journal is not None:
        kept = f"its journal is {journal}; free disk space, then tauscope recording convert"
    return one_line(f"the run {record.state}: {reason or 'no reason is known'}; {_describe_arm(record)}{kept}")


def _describe_arm(record: RunRecord) -> str:
    """What the arm does now; empty where it never had power, or did all that was asked for."""
    if record.state is RunState.DEGRADED or not record.played:
        return ""
    if record.holds is None:
        return "nobody has confirmed its stop, so its drives stop by themselves: look at the arm; "
    return f"the arm was stopped and {'holds' if record.holds else 'is without power'}; "


def _output(asked: Path | None) -> Path:
    """The recording to make, refused before any work where it cannot be made."""
    out = asked or Path(f"run-{datetime.now(UTC):%Y%m%dT%H%M%SZ}.csv")
    if parse_suffix(out, FORMATS, "--out") == ".parquet" and find_spec("pyarrow") is None:
        raise AcquisitionError(f"{out}: Parquet needs pyarrow, which is not installed; name a .csv file")
    require_new(out)
    return out


def show_run(console: Console, record: RunRecord, robot: Robot) -> None:
    reason = f": {record.problem.detail}" if record.problem is not None else ""
    say(f"Robot {record.robot} on {record.backend}: {record.state}{reason}", console)
    for line in record.drives:
        say(f"! {line}.", console)
    for warning in robot.warnings:
        say(f"! {warning.sentence}.", console)
    if record.holds and not find_driver(record.backend).is_simulated:
        say(HELD, console)
    console.print(table("Run", _whole(record)))
    if record.worst_following:
        console.print(table("Joints", _joints(record, robot)))
    for remark in record.recording.remarks if record.recording is not None else ():
        say(f"! {remark}", console)


def _whole(record: RunRecord) -> Table:
    timing, recording = record.timing, record.recording
    rows = [
        ("played", f"{significant(100.0 * record.played, 4)} %"),
        ("ramp", ABSENT if record.ramp_s is None else f"{significant(record.ramp_s)} s"),
        ("motion", ABSENT if record.motion_s is None else f"{significant(record.motion_s, 4)} s"),
        ("stop policy", record.stop_policy or ABSENT),
        ("samples", ABSENT if recording is None else str(recording.samples)),
        ("samples kept", ABSENT if record.kept is None else f"{significant(100.0 * record.kept, 4)} %"),
    ]
    if timing is not None:
        lateness = ", ".join(f"{name} {significant(value, 3)}" for name, value in timing.lateness_us.items())
        rows += [
            ("rate", f"{significant(timing.achieved_rate_hz or 0.0, 5)} of {significant(timing.rate_hz, 5)} Hz"),
            ("lateness", f"{lateness} µs"),
            ("missed periods", counted(timing.missed_periods, "period")),
            ("scheduler", ABSENT if record.real_time is None else record.real_time.scheduler),
        ]
    return Table(("figure", "value"), rows, words=2)


def _joints(record: RunRecord, robot: Robot) -> Table:
    stale = (0,) * robot.joint_count if record.timing is None else record.timing.stale_samples
    rows = [
        (joint.name, f"{significant(following, 3)} {joint.type.unit}", str(count))
        for joint, following, count in zip(robot.joints, record.worst_following, stale, strict=True)
    ]
    return Table(("joint", "largest following error", "samples not answered"), rows)
