"""Models to export, without an identification."""

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from tauscope.export.actuators import ActuatorChoice
from tauscope.export.compensation.model import JointFriction
from tauscope.export.mjcf import MjcfModel, to_mjcf
from tauscope.export.model import ExportModel, FoundEffect, Origin
from tauscope.recording import EffortKind
from tauscope.robot import LinkInertia, Robot

ORIGIN = Origin((), EffortKind.TORQUE, datetime(2026, 1, 1, tzinfo=UTC))


def friction(rng: np.random.Generator) -> JointFriction:
    """A joint with everything that a simulator's format cannot hold."""
    return JointFriction(float(rng.uniform(1, 2)), -0.3, float(rng.uniform(0.1, 1)), 0.05, 500.0, 10.0)


def model_of(
    robot: Robot,
    links: Sequence[LinkInertia],
    frictions: Sequence[JointFriction],
    rotors: Sequence[float | None] | None = None,
    effects: Sequence[FoundEffect] = (),
    origin: Origin = ORIGIN,
) -> ExportModel:
    """A model to export."""
    same = tuple(frictions)
    return ExportModel(
        robot, tuple(links), same, same, tuple(rotors or (None,) * robot.joint_count), tuple(effects), origin
    )


def mjcf_of(
    robot: Robot,
    links: Sequence[LinkInertia],
    frictions: Sequence[JointFriction],
    rotors: Sequence[float | None] | None = None,
    effects: Sequence[FoundEffect] = (),
    choice: ActuatorChoice | None = None,
) -> MjcfModel:
    """A model as MJCF."""
    return to_mjcf(model_of(robot, links, frictions, rotors, effects), choice or ActuatorChoice())
