"""``tauscope export``: a model for a controller or a simulator."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Option

from tauscope.cli.arguments import name_input
from tauscope.cli.task_run import parse_export_format, require_free, write_file
from tauscope.cli.terminal import say
from tauscope.export.actuators import ActuatorChoice, ActuatorKind, to_isaac_lab
from tauscope.export.formats import EXPORT_FILES, ExportFormat, make_export
from tauscope.export.mjcf_patch import patch_mjcf
from tauscope.export.model_file import read_export_model

ModelFile = Annotated[Path, name_input("Model that identify or diagnose wrote.", "MODEL.json", Argument)]
Output = Annotated[
    Path,
    Argument(
        metavar="OUT",
        dir_okay=False,
        help="File to write, by suffix: .urdf, .xml (MJCF), .yaml .json .h .py (compensation for controllers).",
        show_default=False,
    ),
]
Gains = Annotated[
    str | None, Option(metavar="N,...", help="Of position and dcmotor actuators: one for all joints, or one each.")
]


def export(
    model: ModelFile,
    out: Output,
    *,
    actuator: Annotated[Literal["motor", "position", "dcmotor"], Option(help="Actuators of an MJCF.")] = "motor",
    kp: Gains = None,
    kv: Gains = None,
    onto: Annotated[
        Path | None,
        name_input("Your own MJCF: its inertials and joints take the model's values, the rest stays.", "ARM.xml"),
    ] = None,
    isaac_lab: Annotated[bool, Option("--isaac-lab", help="Write actuators for Isaac Lab (.py).")] = False,
) -> None:
    """Write a model for a controller or a simulator.

    Findings of a diagnosis are included as far as the format can hold them; the file's comment lists the others.
    """
    kind = parse_export_format(out, EXPORT_FILES, "OUT")
    if isaac_lab and kind is not ExportFormat.PYTHON:
        raise typer.BadParameter(f"{str(out)!r}: Isaac Lab reads Python (.py)", param_hint="'--isaac-lab'")
    if not isaac_lab and kind is not ExportFormat.MJCF and (actuator != "motor" or kp or kv):
        raise typer.BadParameter(f"{str(out)!r}: only an MJCF (.xml) has actuators", param_hint="'--actuator'")
    if onto is not None and (kind is not ExportFormat.MJCF or actuator != "motor" or kp or kv):
        text = f"{str(out)!r}: only an MJCF (.xml) is written onto another, which keeps its actuators"
        raise typer.BadParameter(text, param_hint="'--onto'")
    choice = ActuatorChoice(ActuatorKind(actuator), _numbers(kp, "--kp"), _numbers(kv, "--kv"))
    require_free([out], [model] if onto is None else [model, onto])
    read = read_export_model(model)
    if onto is not None:
        write_file(out, patch_mjcf(onto, read))
    else:
        write_file(out, to_isaac_lab(read, choice).encode() if isaac_lab else make_export(kind, read, choice))
    if str(out) != "-":
        say(f"wrote {out}")


def _numbers(text: str | None, option: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in text.split(",")) if text else ()
    except ValueError:
        values = (-1.0,)
    if any(not 0.0 <= value < 1e12 for value in values):
        raise typer.BadParameter(f"{text!r} must be numbers of zero or more: 400, or 400,200", param_hint=option)
    return values
