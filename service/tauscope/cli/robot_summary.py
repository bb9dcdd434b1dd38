"""``tauscope robot check``: a robot file at a glance."""

from pathlib import Path

from tauscope.cli.device_run import check_drives, require_sound, show_finding
from tauscope.cli.terminal import output, plain, table
from tauscope.number_text import ABSENT, counted, given
from tauscope.report.table import Table
from tauscope.robot import JointSummary, RobotReport, check_robot


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
