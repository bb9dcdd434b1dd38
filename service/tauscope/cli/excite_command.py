"""``tauscope excite``: its arguments."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.arguments import RobotFile, name_output, parse_numbers

Boxes = Annotated[
    list[str] | None,
    typer.Option(
        "--box",
        "--boxes",
        metavar="X0,Y0,Z0,X1,Y1,Z1",
        help="Forbidden box in the base frame [m], lower corner first; joint origins and tool stay outside."
        " May be repeated.",
    ),
]
NoiseStd = Annotated[
    str | None,
    typer.Option(
        metavar="S1,S2,...", help="Expected torque noise of each joint [Nm or N], which weights its equations."
    ),
]


def excite(
    robot: RobotFile,
    *,
    duration: Annotated[
        float,
        typer.Option(
            "--duration",
            "--duration-s",
            metavar="S",
            min=0.1,
            max=600.0,
            help="Length of one period [s]; the period is repeated.",
        ),
    ] = 10.0,
    harmonics: Annotated[int, typer.Option(metavar="M", min=2, max=30, help="Harmonics of the Fourier series.")] = 5,
    periods: Annotated[int, typer.Option(metavar="P", min=1, max=100, help="How often the period is repeated.")] = 5,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of the optimiser's random starts.")] = 0,
    starts: Annotated[int, typer.Option(metavar="N", min=1, max=64, help="Random series that are improved.")] = 3,
    criterion: Annotated[
        Literal["cond-f", "log-det", "cond-2"],
        typer.Option(help="What is minimised: Cond_F or -ln det of the normal matrix, or the condition number."),
    ] = "cond-f",
    scaling: Annotated[
        Literal["none", "typical"],
        typer.Option(help="Units in which parameters are counted: SI, or the rms of their columns."),
    ] = "none",
    floor: Annotated[
        float | None,
        typer.Option(
            "--floor",
            "--floor-m",
            metavar="Z",
            help="Height in the base frame [m] below which no joint origin and no tool may come.",
        ),
    ] = None,
    box: Boxes = None,
    tool: Annotated[
        str, typer.Option("--tool", "--tool-m", metavar="X,Y,Z", help="Tool point in the last link's frame [m].")
    ] = "0,0,0",
    torque_margin: Annotated[
        float, typer.Option(min=0.0, max=0.99, help="Part of each torque limit kept free for what the model lacks.")
    ] = 0.2,
    limit_fraction: Annotated[
        float, typer.Option(min=0.01, max=1.0, help="Part of the other limits that is used.")
    ] = 0.95,
    noise_std: NoiseStd = None,
    slow_postures: Annotated[int, typer.Option(min=0, max=60, help="Postures at which all joints reverse slowly.")] = 3,
    slow_reversals: Annotated[
        bool, typer.Option("--slow-reversals/--no-slow-reversals", help="None with --no-slow-reversals.")
    ] = True,
    closing_period: Annotated[
        bool, typer.Option("--closing-period/--no-closing-period", help="Repeat the first period at the end.")
    ] = True,
    json: Annotated[
        Path | None, name_output("Write the design, trajectory included, as JSON; - is standard output.")
    ] = None,
    csv: Annotated[Path | None, name_output("Write the trajectory's samples as CSV for other controllers.")] = None,
    rate: Annotated[
        float,
        typer.Option("--rate", "--rate-hz", metavar="HZ", min=1.0, max=10_000.0, help="Samples a second of the CSV."),
    ] = 500.0,
) -> None:
    """Design the motion that tells most about an arm.

    A finite Fourier series for every joint within the limits of position, velocity, acceleration, torque (predicted
    with the robot file's model) and space; repeated, then slow reversals, and the first period again.
    """
    corners = [parse_numbers(text, "--box", 6) for text in box or ()]
    tool_m = parse_numbers(tool, "--tool", 3)
    noise = None if noise_std is None else parse_numbers(noise_std, "--noise-std")
    from tauscope.cli.result_summary import show_design
    from tauscope.cli.task_run import make_request, run_task
    from tauscope.cli.terminal import output
    from tauscope.tasks import design_excitation as task

    options = make_request(
        task.ExcitationDesignOptions,
        duration_s=duration,
        harmonics=harmonics,
        periods=periods,
        seed=seed,
        starts=starts,
        criterion=criterion,
        scaling=scaling,
        limit_fraction=limit_fraction,
        torque_margin=torque_margin,
        slow_postures=slow_postures if slow_reversals else 0,
        closing_period=closing_period,
        floor_m=floor,
        boxes=tuple(make_request(task.ForbiddenBox, low=c[:3], high=c[3:]) for c in corners),
        tool_m=tool_m,
        noise_std=noise,
    )
    run_task(
        task,
        make_request(task.Request, robot=str(robot), options=options, rate_hz=rate),
        [(json, "result.json"), (csv, "trajectory.csv")],
        show=None if Path("-") in (json, csv) else lambda result: show_design(output(), result.design, result.robot),
    )
