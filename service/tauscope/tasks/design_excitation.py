"""Design an excitation: the motion that tells most about an arm."""

import math
from dataclasses import dataclass, fields
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from tauscope import excitation
from tauscope.robot import Robot, read_robot
from tauscope.strict_model import StrictModel
from tauscope.tasks.task import Files, Outputs, Progress, json_text
from tauscope.trajectory import trajectory_json
from tauscope.trajectory.csv_format import trajectory_csv

Point = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class ForbiddenBox(StrictModel):
    """A box along the axes of the base frame, which the arm keeps clear of."""

    low: Point = Field(description="least x, y, z [m]")
    high: Point = Field(description="greatest x, y, z [m]")


class ExcitationDesignOptions(StrictModel):
    """How a motion is designed."""

    duration_s: Annotated[FiniteFloat, Field(gt=0.0, le=600.0)] = Field(
        default=10.0, description="length of one period [s]"
    )
    harmonics: int = Field(default=5, ge=2, le=30, description="harmonics of the Fourier series")
    periods: int = Field(default=5, ge=1, le=100, description="how often the period is repeated")
    seed: int = Field(default=0, ge=0, lt=2**63, description="of the optimiser's starts")
    starts: int = Field(default=3, ge=1, le=64, description="random series that are improved")
    criterion: Literal["cond-f", "log-det", "cond-2"] = Field(
        default="cond-f",
        description="what is minimised: Cond_F or -log det of the normal matrix, or the condition number",
    )
    scaling: Literal["none", "typical"] = Field(
        default="none", description="units in which parameters are counted: SI, or the rms of their columns"
    )
    limit_fraction: Annotated[FiniteFloat, Field(gt=0.0, le=1.0)] = Field(
        default=0.95, description="part of the limits of position, velocity and acceleration that is used"
    )
    torque_margin: Annotated[FiniteFloat, Field(ge=0.0, lt=1.0)] = Field(
        default=0.2, description="part of each torque limit that is kept free for what the prior model does not know"
    )
    following_error: Annotated[FiniteFloat, Field(gt=0.0)] | None = Field(
        default=None, description="of position servos and their commands; null: as the run allows, 0.2 rad or 0.05 m"
    )
    slow_postures: int = Field(
        default=3, ge=0, le=60, description="postures at which all joints reverse slowly, after the repeated part"
    )
    closing_period: bool = Field(default=True, description="whether the first period is played again at the end")
    floor_m: FiniteFloat | None = Field(
        default=None, description="height below which no joint and no tool may come, in the base frame [m]"
    )
    boxes: tuple[ForbiddenBox, ...] = Field(
        default=(), max_length=100, description="boxes into which no joint and no tool may come"
    )
    tool_m: Point = Field(default=(0.0, 0.0, 0.0), description="tool point in the last link's frame [m]")
    noise_std: tuple[FiniteFloat, ...] | None = Field(
        default=None,
        description="expected torque noise of each joint [Nm or N], which weights its equations; null: equal weights",
    )

    def to_options(self) -> excitation.ExcitationOptions:
        """The options as the design takes them. Raises ExcitationError if a box is none."""
        boxes = tuple(excitation.Box(np.array(box.low), np.array(box.high)) for box in self.boxes)
        same = {each.name for each in fields(excitation.ExcitationOptions)} & set(type(self).model_fields)
        values = {name: getattr(self, name) for name in same} | {
            "period_s": self.duration_s,
            "criterion": excitation.Criterion(self.criterion),
            "scaling": excitation.ColumnScaling(self.scaling),
            "workspace": excitation.Workspace(self.floor_m, boxes, np.array(self.tool_m)),
            "noise_std": None if self.noise_std is None else np.array(self.noise_std),
        }
        return excitation.ExcitationOptions(**values)


class Request(StrictModel):
    """Which motion is wanted, and for which robot file."""

    robot: str = Field(description="robot file")
    options: ExcitationDesignOptions = Field(
        default=ExcitationDesignOptions(), description="how the motion is designed"
    )
    rate_hz: float = Field(default=500.0, gt=0.0, le=10_000.0, description="samples a second of the CSV [Hz]")


@dataclass(frozen=True, eq=False)
class Result:
    """What came of it."""

    request: Request
    robot: Robot
    design: excitation.ExcitationDesign

    @property
    def outputs(self) -> Outputs:
        """``result.json``, ``trajectory.json`` and ``trajectory.csv``."""
        return Outputs(
            {
                "trajectory.json": lambda: trajectory_json(self.design.trajectory),
                "trajectory.csv": lambda: trajectory_csv(self.design.trajectory, self.request.rate_hz),
                "result.json": lambda: json_text(excitation.excitation_document(self.design)),
            }
        )


def perform(request: Request, files: Files, progress: Progress) -> Result:
    """Read the robot and design its motion. Raises TauscopeError where no motion keeps the limits."""
    progress("read robot")
    robot = read_robot(files.find("robot", request.robot))
    progress("design the motion")

    def tell(now: excitation.OptimiserProgress) -> None:
        figures = {"step": now.step, "cost": _finite(now.cost), "best_cost": _finite(now.best)}
        progress(f"{now.step}, best {now.best:.4g}", round(100.0 * now.fraction, 1), figures)

    return Result(request, robot, excitation.design_excitation(robot, request.options.to_options(), progress=tell))


def _finite(value: float) -> float | None:
    """JSON knows no infinity."""
    return value if math.isfinite(value) else None
