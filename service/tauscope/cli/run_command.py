"""``tauscope run``: its arguments."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.driver_choice import DEFAULT_BACKEND, check_backend, require_options

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


@dataclass(frozen=True, kw_only=True)
class RunArguments:
    """How a run is made: fields of `RunOptions`.

    `rate_hz`: cycles a second [Hz].
    """

    mode: Annotated[Literal["position", "torque"], typer.Option(help="Who closes the loop: drives or host.")] = (
        "position"
    )
    rate_hz: Annotated[
        float | None,
        typer.Option(
            "--rate", "--rate-hz", metavar="HZ", min=1.0, max=10_000.0, help="Cycles a second; 500 where possible."
        ),
    ] = None
    stop_policy: Annotated[
        Literal["hold", "damp", "torque_off", "release"] | None,
        typer.Option(
            help="How the arm is stopped; as the robot file says by default, else hold. "
            "release: hold, then let go once it stands still, where the robot file states that."
        ),
    ] = None
    watchdog_s: Annotated[
        float, typer.Option(metavar="S", help="Time without a cycle after which the device stops itself.")
    ] = 0.1
    heartbeat_s: Annotated[
        float, typer.Option(metavar="S", help="Silence of its owner after which a run is interrupted.")
    ] = 1.0
    following_error: Annotated[
        float | None, typer.Option(help="Allowed distance of arm and target; 0.2 rad or 0.05 m by default.")
    ] = None
    missed: Annotated[int, typer.Option(help="Readings in a row that a joint may not fail to answer.")] = 3
    lost_s: Annotated[
        float, typer.Option(metavar="S", help="Time after which a joint that does not answer counts as lost.")
    ] = 0.05
    stale_ms: Annotated[
        float, typer.Option(metavar="MS", help="How much later than usual an answer may come and be a sample.")
    ] = 1.0
    least_kept: Annotated[
        float, typer.Option(help="Share of the motion's samples below which the run ends as degraded.")
    ] = 0.98
    temperature_c: Annotated[float, typer.Option(metavar="C", help="Hottest motor that is allowed [°C].")] = 80.0
    feed_forward: Annotated[
        bool, typer.Option("--feed-forward/--no-feed-forward", help="Give the drives the torque of the robot's model.")
    ] = True
    bandwidth_rad_s: Annotated[float, typer.Option(help="Of the host's loop in torque mode [rad/s].")] = 25.0
    settle_s: Annotated[float, typer.Option(metavar="S", help="Pause between the ramp and the motion.")] = 0.25
    acknowledge_faults: Annotated[
        bool, typer.Option("--acknowledge-faults", help="Clear the faults that the drives have latched.")
    ] = False


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
    arguments: RunArguments,
    seed: Annotated[int, typer.Option(min=0, help="Of the default excitation.")] = 0,
    keep_settings: Annotated[
        bool, typer.Option("--keep-settings", help="Leave in servos' EEPROM what the run changed; else it is put back.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the frames that would be sent to the bus, and send none.")
    ] = False,
) -> None:
    """Move an arm and record it.

    Ctrl-C stops the arm by its stop policy; what was recorded until then is kept, and the exit status is 1.
    """
    posture = parse_posture(start)
    given = {"scenario": scenario, "start": start, "time": None if time == "virtual" else time}
    given["keep_settings"] = keep_settings or None
    require_options(backend, [name for name, value in given.items() if value is not None])
    from tauscope.cli.task_run import make_request
    from tauscope.runtime.options import RunOptions

    options = make_request(RunOptions, **asdict(arguments))
    if dry_run:
        from tauscope.cli.device_run import show_frames

        show_frames(robot, backend, trajectory, options)
        return
    from tauscope.cli.run_session import run_arm
    from tauscope.tasks import run as task

    request = task.Request(
        robot=str(robot),
        backend=make_request(task.BackendChoice, name=backend, time=time, start=posture, keep_settings=keep_settings),
        scenario=None if scenario is None else str(scenario),
        trajectory=None if trajectory is None else str(trajectory),
        seed=seed,
        options=options,
    )
    run_arm(request, out)


def parse_posture(text: str | None) -> tuple[float, ...] | None:
    """Read the value of ``--start``. Raises typer.BadParameter for anything else."""
    if text is None:
        return None
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = (math.nan,)
    if not all(math.isfinite(value) for value in values):
        raise typer.BadParameter(f"{text!r} is no list of numbers like 0,0.5,-1", param_hint="'--start'")
    return values
