"""``tauscope excite``: the motion that tells most about an arm, and what it leaves of the limits."""

from pathlib import Path
from typing import Annotated, Any

from rich.console import Console
from typer import Option

from tauscope.cli.arguments import RobotFile, name_output
from tauscope.cli.task_run import run_task
from tauscope.cli.terminal import output, say, table
from tauscope.cli.verbs import OptionsOf, make_request, parse_numbers
from tauscope.excitation import ExcitationDesign
from tauscope.number_text import ABSENT, counted, percent, significant
from tauscope.report.tables import Table
from tauscope.robot import Robot
from tauscope.tasks import design_excitation as task

Boxes = Annotated[
    list[str] | None,
    Option(
        "--box",
        "--boxes",
        metavar="X0,Y0,Z0,X1,Y1,Z1",
        help="Forbidden box in the base frame [m], lower corner first; joint origins and tool stay outside."
        " May be repeated.",
    ),
]


def excite(
    robot: RobotFile,
    *,
    options: Annotated[dict[str, Any], OptionsOf(task.ExcitationDesignOptions, without=("boxes",))],
    box: Boxes = None,
    slow_reversals: Annotated[bool, Option("--slow-reversals/--no-slow-reversals", help="Add slow reversals.")] = True,
    json: Annotated[Path | None, name_output("Write the design as JSON, with its trajectory; - is stdout.")] = None,
    csv: Annotated[Path | None, name_output("Write the trajectory's samples as CSV for other controllers.")] = None,
    rate: Annotated[
        float, Option("--rate", "--rate-hz", metavar="HZ", min=1.0, max=10_000.0, help="Samples a second of the CSV.")
    ] = 500.0,
) -> None:
    """Design the motion that tells most about an arm.

    A finite Fourier series for every joint within the limits of position, velocity, acceleration, torque (predicted
    with the robot file's model) and space; repeated, then slow reversals, and the first period again.
    """
    corners = [parse_numbers(text, "--box", 6) for text in box or ()]
    options["boxes"] = tuple(make_request(task.ForbiddenBox, low=c[:3], high=c[3:]) for c in corners)
    if not slow_reversals:
        options["slow_postures"] = 0
    made = make_request(task.ExcitationDesignOptions, **options)
    run_task(
        task,
        make_request(task.Request, robot=str(robot), options=made, rate_hz=rate),
        [(json, "result.json"), (csv, "trajectory.csv")],
        show=None if Path("-") in (json, csv) else lambda result: show_design(output(), result.design, result.robot),
    )


CRITERIA = {"cond-f": "Cond_F(LᵀL)", "log-det": "-ln det(LᵀL)/p", "cond-2": "condition number of L"}


def show_design(console: Console, design: ExcitationDesign, robot: Robot) -> None:
    trajectory = design.trajectory
    say(
        f"Excitation of {robot.name}: {counted(robot.joint_count, 'joint')}, {counted(design.periods, 'period')} "
        f"of {design.series.period_s:.4g} s, {trajectory.duration_s:.4g} s in all",
        console,
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
        say(f"Limited by {', '.join(design.active)}", console)
    for note in design.notes:
        say(f"! {note}", console)
