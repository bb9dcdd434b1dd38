"""The arms on which effects are concealed, with links, friction and limits of their own: `robots/`, and the paper's."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML

from tauscope.robot import FrictionShape, Model, Robot, read_robot
from tauscope_sim.examples import example_robot

ROBOTS = Path(__file__).parent / "robots"

NOISE_STD: dict[str, tuple[float, ...]] = {
    "paper": (0.5, 0.3, 0.7),
    "six": (1.2, 1.5, 1.0, 0.4, 0.3, 0.2),
    "seven": (0.8, 1.2, 0.8, 0.8, 0.3, 0.25, 0.2),
    "linear": (6.0, 1.0, 0.6, 0.2),
    "servo": (0.006, 0.008, 0.006, 0.004),
}
"""Standard deviation of the torque's noise at 200 Hz [Nm or N]."""

DRY = "-dry"
"""Ends the name of an arm whose friction holds it at standstill."""

BREAKAWAY_SLOPE = 1e5
"""K_v of dry friction [s/rad]: at standstill it takes any value within the breakaway torque, and 90 % of that moves the
joint by less than one count of a 12-bit encoder in 20 s."""


@cache
def arm_named(name: str) -> Robot:
    """One of the arms, the truth in its model block."""
    robot = read_robot(_file(_machine(name)))
    if not is_dry(name):
        return robot
    shapes = [replace(joint.friction_shape, k_v=BREAKAWAY_SLOPE) for joint in robot.joints]
    joints = [replace(joint, friction_shape=shape) for joint, shape in zip(robot.joints, shapes, strict=True)]
    return replace(robot, joints=tuple(joints))


def noise_std(name: str) -> tuple[float, ...]:
    """Standard deviation of the torque's noise of one of the arms at 200 Hz [Nm or N]."""
    return NOISE_STD[_machine(name)]


def is_dry(name: str) -> bool:
    """Whether friction holds an arm at standstill; its robot file states no constants of the friction's curve."""
    return name.endswith(DRY)


def without_truth(robot: Robot, *, states_friction: bool) -> Robot:
    """The robot that the diagnosis gets: no model, and perhaps not even the constants of the friction's curve."""
    joints = robot.joints
    if not states_friction:
        joints = tuple(replace(joint, friction_shape=FrictionShape(None, None)) for joint in joints)
    return replace(robot, joints=joints, model=Model(None, None))


def file_without_truth(
    name: str,
    target: Path,
    *,
    states_friction: bool,
    torque_constants: NDArray[np.float64] | None = None,
) -> None:
    """The same as a robot file, with torque constants where currents are logged; what comments tell is left out too."""
    told: dict[str, Any] = YAML(typ="safe").load(_file(_machine(name)))
    del told["model"]
    if is_dry(name) or not states_friction:
        for joint in told["joints"]:
            del joint["friction_shape"]
    if torque_constants is not None:
        for joint, constant in zip(told["joints"], torque_constants, strict=True):
            joint["torque_constant"] = float(constant)
    with target.open("w", encoding="utf-8") as file:
        YAML(typ="safe").dump(told, file)


def _machine(name: str) -> str:
    return name.removesuffix(DRY)


def _file(name: str) -> Path:
    return example_robot("paper_arm") if name == "paper" else ROBOTS / f"{name}.yaml"
