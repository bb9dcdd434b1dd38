"""``tauscope robot`` and ``tauscope recording``: what inputs hold, and how another tool's columns are mapped."""

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from tauscope import robot as robots
from tauscope.cli.arguments import LayoutFields, ReadingFields, RecordingFile, RobotFile, complete_reading, name_input
from tauscope.cli.device_command import check_drives, require_sound, show_finding
from tauscope.cli.task_run import parse_suffix, write_file
from tauscope.cli.terminal import output, say, show_progress, table
from tauscope.cli.verbs import make_group, make_request
from tauscope.number_text import ABSENT, counted, given, significant
from tauscope.recording import EffortKind, Reading, RecordingReport, check_recording, convert_recording
from tauscope.recording.convert import FORMATS
from tauscope.recording.layout.guess import guess_parts, layout_text
from tauscope.recording.mapping import map_columns
from tauscope.recording.reading import read_header
from tauscope.report.tables import Table
from tauscope.robot import JointSummary, RecordingLayout, layout_from_dict, read_robot
from tauscope.robot.messages import listed
from tauscope.robot.recording_layout import Source
from tauscope.robot.yaml_text import read_yaml
from tauscope.tasks.task import ReadingOptions

RobotOption = Annotated[Path | None, name_input("Robot file: its names, limits, masses and layout.", "ROBOT")]
EFFORT_WORDS = {
    EffortKind.TORQUE: "torque",
    EffortKind.CURRENT: "drive units",
    EffortKind.COMMAND: "none; commands of position",
}

QUESTIONS = {
    "t": "time",
    "q": "position of every joint",
    "tau": "torque of every joint",
    "i": "current of every joint",
    "qd": "velocity of every joint",
}
NONE = "-"


def check_recording_file(
    file: RecordingFile,
    *,
    joints: Annotated[int | None, Option(min=1, metavar="N", help="Number of joints that it must have.")] = None,
    robot: RobotOption = None,
    reading: ReadingFields,
) -> None:
    """Show what a recording holds, and what to look at before trusting it."""
    options = make_request(ReadingOptions, **complete_reading(reading)).reading
    with show_progress() as progress:
        progress(f"read {file}")
        arm = None if robot is None else read_robot(robot)
        report = check_recording(file, joints, arm, options)
    console = output()
    say(f"{report.name}: {counted(len(report.joints), 'joint')}, {counted(report.samples, 'sample')}", console)
    console.print(table("Recording", _clock(report)))
    console.print(table("Joints", _joints(report)))
    for finding in report.findings:
        say(f"{finding.severity}: {finding.where}: {finding.text}", console)
    report.require_usable()
    say(f"{file}: valid", console)


def convert_file(
    source: RecordingFile,
    target: Annotated[Path, Argument(metavar="TARGET", dir_okay=False, help="File: .csv, .parquet or .mcap.")],
    *,
    recover: Annotated[bool, Option(help="Keep what comes before the damage of a truncated MCAP file.")] = False,
    overwrite: Annotated[bool, Option(help="Replace TARGET where it exists.")] = False,
    robot: RobotOption = None,
    reading: LayoutFields,
) -> None:
    """Write a recording in another format, in SI; the source stays as it is."""
    options = make_request(ReadingOptions, **complete_reading(reading)).reading
    parse_suffix(target, FORMATS, "TARGET")
    with show_progress() as progress:
        progress(f"convert {source}")
        arm = None if robot is None else read_robot(robot)
        done = convert_recording(source, target, recover=recover, overwrite=overwrite, robot=arm, reading=options)
    console = output()
    say(f"wrote {done.target}: {counted(done.samples, 'sample')}", console)
    if done.dropped_columns:
        say(f"left out: {', '.join(done.dropped_columns)}", console)
    if done.damage is not None:
        say(f"damage passed over: {done.damage}", console)


def map_file(
    file: RecordingFile,
    robot: RobotOption = None,
    out: Annotated[Path | None, Option(metavar="OUT.yaml", dir_okay=False, help="File for --columns.")] = None,
    ask: Annotated[bool | None, Option("--ask/--no-ask", help="Ask for each column; default: on a terminal.")] = None,
) -> None:
    """Write the mapping of another tool's columns: a guess, which questions correct."""
    arm = None if robot is None else read_robot(robot)
    reading = Reading().for_robot(arm)
    header = read_header(file)
    layout = RecordingLayout(columns=guess_parts(header, reading))
    if sys.stdin.isatty() if ask is None else ask:
        typer.echo(f"columns: {listed(header)}", err=True)
        layout = _ask(layout)
    found = map_columns(header, replace(reading, columns=layout.columns or None, units=layout.units), str(file))
    text = layout_text(layout) + "\n"
    if out is not None:
        write_file(out, text.encode())
        say(f"wrote {out}: {found.joint_count} joints")
    else:
        typer.echo(text, nl=False)


def _ask(layout: RecordingLayout) -> RecordingLayout:
    typer.echo(f"{{0}} or {{1}} stands for a joint's number from 0 or 1, {{name}} its name; {NONE}: none", err=True)
    guessed: Mapping[str, Source] = layout.columns if isinstance(layout.columns, Mapping) else {}
    columns = dict(guessed)
    for group, words in QUESTIONS.items():
        default = columns.pop(group, NONE)
        shown = ", ".join(map(str, default if isinstance(default, list) else [default]))
        answer = typer.prompt(f"{group}, {words}", default=shown, err=True).strip()
        if answer != NONE:
            columns[group] = answer if "," not in answer else read_yaml(f"[{answer}]", group).data
    return layout_from_dict({"columns": columns, "units": dict(layout.units)})


def _clock(report: RecordingReport) -> Table:
    periods, marked = report.periods, ABSENT
    if periods is not None:
        marked = f"{periods.count} of {periods.shortest} … {periods.longest} samples"
    rows = [
        ("duration", f"{significant(report.duration_s, 6)} s"),
        ("rate", f"{significant(report.rate_hz, 5)} Hz"),
        ("steps", f"{significant(1e3 * report.steps.minimum)} … {significant(1e3 * report.steps.maximum)} ms"),
        ("gaps", str(report.gaps.count)),
        ("periods", marked),
        ("missed values (NaN)", str(sum(report.missed.values()))),
        ("effort", EFFORT_WORDS[report.effort_kind]),
        ("columns", " ".join(report.columns)),
    ]
    return Table(("figure", "value"), rows, words=2)


def _joints(report: RecordingReport) -> Table:
    rows = []
    for number, joint in enumerate(report.joints, start=1):
        ranges = (" … ".join(significant(value) for value in pair) for pair in (joint.position, joint.effort))
        rows.append([str(number), *ranges, significant(joint.position_step, 3)])
    return Table(("joint", "position [rad, m]", "effort", "position step"), rows)


def check_robot_file(file: RobotFile) -> None:
    """Show what a robot file says, and everything doubtful in it."""
    report = robots.check_robot(file)
    console, gravity = output(), ", ".join(given(value) for value in report.gravity)
    mass = "" if report.total_mass is None else f", model of {given(report.total_mass)} kg"
    say(f"Robot {report.name}: {counted(len(report.joints), 'joint')}, gravity [{gravity}] m/s²{mass}", console)
    columns = ("joint", "name", "type", "position", "velocity", "acceleration", "torque")
    columns += ("gear", "per unit", "mass [kg]")
    console.print(table("Joints", Table(columns, [_row(joint) for joint in report.joints], words=3)))
    for finding in report.findings:
        say(f"{finding.severity}: {finding.where}: {finding.text}", console)
    findings = check_drives(file)
    for finding in findings:
        show_finding(console, finding)
    require_sound(findings)
    say(f"{file}: valid", console)


def _row(joint: JointSummary) -> list[str]:
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


robot = make_group(check=check_robot_file)
recording = make_group(map=map_file, check=check_recording_file, convert=convert_file)
