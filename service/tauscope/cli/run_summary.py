"""How a run went, as tables on a terminal."""

from rich.console import Console

from tauscope.cli.terminal import plain, table
from tauscope.number_text import ABSENT, counted, significant
from tauscope.report.table import Table
from tauscope.robot import JointType, Robot
from tauscope.runtime.drivers import find_driver
from tauscope.runtime.record import RunRecord

HELD = (
    "! The arm is under power where it stopped, and its watchdog is off. Support it, then let go of it with: tauscope "
    "release."
)


def show_run(console: Console, record: RunRecord, robot: Robot) -> None:
    """Show how a run went, and how it kept its time."""
    reason = f": {record.problem.detail}" if record.problem is not None else ""
    console.print(plain(f"Robot {record.robot} on {record.backend}: {record.state}{reason}"), soft_wrap=True)
    for line in record.drives:
        console.print(plain(f"! {line}."), soft_wrap=True)
    for warning in robot.warnings:
        console.print(plain(f"! {warning.sentence}."), soft_wrap=True)
    if record.holds and not find_driver(record.backend).is_simulated:
        console.print(plain(HELD), soft_wrap=True)
    console.print(table("Run", _whole(record)))
    if record.worst_following:
        console.print(table("Joints", _joints(record, robot)))
    for remark in record.recording.remarks if record.recording is not None else ():
        console.print(plain(f"! {remark}"), soft_wrap=True)


def _whole(record: RunRecord) -> Table:
    """What belongs to no single joint."""
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
    """How each joint followed, and answered."""
    stale = (0,) * robot.joint_count if record.timing is None else record.timing.stale_samples
    rows = [
        (
            joint.name,
            f"{significant(following, 3)} {'rad' if joint.type is JointType.REVOLUTE else 'm'}",
            str(count),
        )
        for joint, following, count in zip(robot.joints, record.worst_following, stale, strict=True)
    ]
    return Table(("joint", "largest following error", "samples not answered"), rows)
