"""A designed excitation as tables and sentences on a terminal."""

from rich.console import Console

from tauscope.cli.terminal import plain, table
from tauscope.excitation import ExcitationDesign
from tauscope.number_text import ABSENT, counted, percent, significant
from tauscope.report.table import Table
from tauscope.robot import Robot

CRITERIA = {"cond-f": "Cond_F(LᵀL)", "log-det": "-ln det(LᵀL)/p", "cond-2": "condition number of L"}


def show_design(console: Console, design: ExcitationDesign, robot: Robot) -> None:
    """Show what a design is good for, what it leaves of the limits, and what limits it."""
    trajectory = design.trajectory
    console.print(
        plain(
            f"Excitation of {robot.name}: {counted(robot.joint_count, 'joint')}, {counted(design.periods, 'period')} "
            f"of {design.series.period_s:.4g} s, {trajectory.duration_s:.4g} s in all"
        )
    )
    rows = [
        ("condition number", significant(design.condition_number, 4)),
        (CRITERIA[design.criterion.value], significant(design.value, 4)),
        ("  of the best random motion", significant(design.random_value, 4)),
        ("motions tried", str(design.evaluations)),
        ("seconds", significant(design.seconds, 3)),
    ]
    if design.margins.workspace_m is not None:
        rows.append(("clearance [m]", significant(design.margins.workspace_m, 3)))
    console.print(table("Design", Table(("figure", "value"), rows)))
    margins = design.margins.as_table()
    cells = [
        (joint.name, *(ABSENT if values[j] is None else percent(values[j]) for values in margins.values()))
        for j, joint in enumerate(robot.joints)
    ]
    console.print(table("Margins: part of each limit that is left", Table(("joint", *margins), cells)))
    if design.active:
        console.print(plain(f"Limited by {', '.join(design.active)}"), soft_wrap=True)
    for note in design.notes:
        console.print(plain(f"! {note}"), soft_wrap=True)
