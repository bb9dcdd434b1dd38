"""``tauscope run``: its arguments."""

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.driver_choice import DEFAULT_BACKEND, check_backend

Trajectory = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        exists=True,
        dir_okay=False,
        help="Motion to play: a trajectory (JSON, CSV). The default excitation is designed where none is given.",
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        metavar="RECORDING",
        dir_okay=False,
        help="File to make: .csv, .parquet, or .mcap (with the ramp). Never replaces a file; run-TIME.csv by default.",
    ),
]
Scenario = Annotated[
    Path | None,
    typer.Option(metavar="FILE", exists=True, dir_okay=False, help="What the simulated arm conceals (YAML)."),
]
Start = Annotated[
    str | None, typer.Option(metavar="Q1,Q2,...", help="Where the simulated arm stands at first [rad or m].")
]


def run(
    robot: RobotFile,
    *,
    backend: Annotated[
        str, typer.Option(parser=check_backend, metavar="[{backends}]", help="What moves the arm.")
    ] = DEFAULT_BACKEND,
    trajectory: Trajectory = None,
    out: Out = None,
    scenario: Scenario = None,
    time: Annotated[
        Literal["virtual", "real"], typer.Option(help="Of the simulated arm: as fast as it computes, or by the clock.")
    ] = "virtual",
    start: Start = None,
    mode: Annotated[
        Literal["position", "torque"], typer.Option(help="Who closes the loop: drives or host.")
    ] = "position",
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", min=1.0, max=10_000.0, help="Cycles a second; 500 where possible."),
    ] = None,
    stop_policy: Annotated[
        Literal["hold", "damp", "torque_off"] | None,
        typer.Option(help="How the arm is stopped; as the robot file says by default, else hold."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the default excitation.")] = 0,
    acknowledge_faults: Annotated[
        bool, typer.Option("--acknowledge-faults", help="Clear the faults that the drives have latched.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the frames that would be sent to the bus, and send none.")
    ] = False,
) -> None:
    """Move an arm and record it.

    Ctrl-C stops the arm by its stop policy; what was recorded until then is kept, and the exit status is 1.

    Parameters
    ----------
    start : str or None
        where the simulated arm stands at first [rad or m]
    rate : float or None
        cycles a second [Hz]
    """
    posture = parse_posture(start)
    from tauscope.cli.run_session import Request, run_arm
    from tauscope.runtime import RunOptions

    options = RunOptions.model_validate(
        {"mode": mode, "rate_hz": rate, "stop_policy": stop_policy, "acknowledge_faults": acknowledge_faults}
    )
    if dry_run:
        from tauscope.cli.bus_summary import show_frames

        show_frames(robot, backend, trajectory, options)
        return
    run_arm(
        Request(
            robot=robot,
            backend=backend,
            trajectory=trajectory,
            out=out,
            scenario=scenario,
            time=time,
            start=posture,
            options=options,
            seed=seed,
        )
    )


def parse_posture(text: str | None) -> tuple[float, ...] | None:
    """Read the value of ``--start``.

    Raises
    ------
    typer.BadParameter
        for anything else
    """
    if text is None:
        return None
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = (math.nan,)
    if not all(math.isfinite(value) for value in values):
        raise typer.BadParameter(f"{text!r} is no list of numbers like 0,0.5,-1", param_hint="'--start'")
    return values
