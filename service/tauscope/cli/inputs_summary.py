"""``tauscope robot check`` and ``tauscope recording check|convert``: what inputs hold."""

from pathlib import Path

import typer

from tauscope.cli.device_run import check_drives, require_sound, show_finding
from tauscope.cli.terminal import output, plain, shown_progress, table
from tauscope.number_text import ABSENT, counted, given, significant
from tauscope.recording import EffortKind, Reading, RecordingReport, check_recording, convert_recording
from tauscope.recording.convert import FORMATS
from tauscope.report.tables import Table
from tauscope.robot import JointSummary, RobotReport, check_robot, read_robot


def show_recording(path: Path, joint_count: int | None, robot_file: Path | None, reading: Reading) -> None:
    """Show what a recording holds, and what to look at before trusting it.

    Raises RecordingError if the recording cannot be read, breaks a rule, or no other verb accepts it.
    """
    with shown_progress() as progress:
        progress(f"read {path}")
        robot = None if robot_file is None else read_robot(robot_file)
        report = check_recording(path, joint_count, robot, reading)
    console = output()
    console.print(
        plain(f"{report.name}: {counted(len(report.joints), 'joint')}, {counted(report.samples, 'sample')}"),
        soft_wrap=True,
    )
    console.print(table("Recording", _clock(report)))
    console.print(table("Joints", _joints(report)))
    for finding in report.findings:
        console.print(plain(f"{finding.severity}: {finding.where}: {finding.text}"), soft_wrap=True)
    report.require_usable()
    console.print(plain(f"{path}: valid"), soft_wrap=True)


def convert_file(
    source: Path, target: Path, robot_file: Path | None, reading: Reading, *, recover: bool, overwrite: bool
) -> None:
    """Write a recording in another format and say what was left out.

    Raises typer.BadParameter if the target's suffix names no format. Raises RecordingError if the source cannot be read
    or the target cannot be written.
    """
    if target.suffix.lower() not in FORMATS:
        raise typer.BadParameter(
            f"{str(target)!r}: the suffix names no format; use {', '.join(FORMATS)}", param_hint="'TARGET'"
        )
    with shown_progress() as progress:
        progress(f"convert {source}")
        robot = None if robot_file is None else read_robot(robot_file)
        done = convert_recording(source, target, recover=recover, overwrite=overwrite, robot=robot, reading=reading)
    console = output()
    console.print(plain(f"wrote {done.target}: {counted(done.samples, 'sample')}"), soft_wrap=True)
    if done.dropped_columns:
        console.print(plain(f"left out: {', '.join(done.dropped_columns)}"), soft_wrap=True)
    if done.damage is not None:
        console.print(plain(f"damage passed over: {done.damage}"), soft_wrap=True)


EFFORT_WORDS = {
    EffortKind.TORQUE: "torque",
    EffortKind.CURRENT: "drive units",
    EffortKind.COMMAND: "none; commands of position",
}


def _clock(report: RecordingReport) -> Table:
    """Duration, rate, gaps, periods, columns."""
    periods = report.periods
    rows = [
        ("duration", f"{significant(report.duration_s, 6)} s"),
        ("rate", f"{significant(report.rate_hz, 5)} Hz"),
        ("steps", f"{significant(1e3 * report.steps.minimum)} … {significant(1e3 * report.steps.maximum)} ms"),
        ("gaps", str(report.gaps.count)),
        (
            "periods",
            ABSENT if periods is None else f"{periods.count} of {periods.shortest} … {periods.longest} samples",
        ),
        ("missed values (NaN)", str(sum(report.missed.values()))),
        ("effort", EFFORT_WORDS[report.effort_kind]),
        ("columns", " ".join(report.columns)),
    ]
    return Table(("figure", "value"), rows, words=2)


def _joints(report: RecordingReport) -> Table:
    """Range of every joint's channels."""
    rows = []
    for number, joint in enumerate(report.joints, start=1):
        ranges = (" … ".join(significant(value) for value in pair) for pair in (joint.position, joint.effort))
        rows.append([str(number), *ranges, significant(joint.position_step, 3)])
    return Table(("joint", "position [rad, m]", "effort", "position step"), rows)


def show_robot(path: Path) -> None:
    """Show what a robot file says, and everything doubtful in it.

    Raises RobotFileError if the file is not valid. Raises AcquisitionError if a drive block or the EDS or DCF file that
    it names is not usable.
    """
    report = check_robot(path)
    console = output()
    gravity = ", ".join(given(value) for value in report.gravity)
    console.print(
        plain(f"Robot {report.name}: {counted(len(report.joints), 'joint')}, gravity [{gravity}] m/s²{_mass(report)}")
    )
    columns = (
        "joint",
        "name",
        "type",
        "position",
        "velocity",
        "acceleration",
        "torque",
        "gear",
        "per unit",
        "mass [kg]",
    )
    console.print(table("Joints", Table(columns, [_row(joint) for joint in report.joints], words=3)))
    for finding in report.findings:
        console.print(plain(f"{finding.severity}: {finding.where}: {finding.text}"), soft_wrap=True)
    findings = check_drives(path)
    for finding in findings:
        show_finding(console, finding)
    require_sound(findings)
    console.print(plain(f"{path}: valid"), soft_wrap=True)


def _mass(report: RobotReport) -> str:
    """What the model weighs, where there is one."""
    return "" if report.total_mass is None else f", model of {given(report.total_mass)} kg"


def _row(joint: JointSummary) -> list[str]:
    """One joint."""
    limits = joint.limits
    reach = ABSENT if limits.position is None else " … ".join(given(value) for value in limits.position)
    return [
        str(joint.number),
        joint.name,
        joint.type.value,
        reach,
        *(given(value) for value in (limits.velocity, limits.acceleration, limits.torque, joint.gear_ratio)),
        given(joint.sign * joint.torque_constant),
        given(joint.mass),
    ]
