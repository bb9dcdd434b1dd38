"""Robot files with one value wrong: the direction of gravity, or a length of a link."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from ruamel.yaml import YAML

from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground

Array = NDArray[np.float64]

STANDARD_GRAVITY = (0.0, 0.0, -9.81)
"""Of a robot file that states none [m/s²]."""

TILT_RAD = (np.deg2rad(2.0), np.deg2rad(90.0))
LENGTH_M = (0.002, 0.15)
"""Errors of a length: of a rounded data sheet, and of a flange that was forgotten."""


def gravity(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """Gravity 2° to 90° off in the robot file, about a drawn horizontal axis.

    Of arms of one joint nothing tells it: another place of the link's mass has the same torque.
    """
    down = ground.robot.gravity
    if ground.robot.joint_count == 1:
        return None
    axis = np.cross(down, rng.standard_normal(3))
    axis /= np.linalg.norm(axis)
    constants = {f"axis_{name}": float(each) for name, each in zip("xyz", axis, strict=True)}
    return Concealment(
        "gravity",
        joint,
        ("base_tilt",),
        lambda size: {"tilt": size},
        TILT_RAD,
        rewrite=lambda size, source, target: tilt_gravity(source, target, axis, size),
        constants=constants,
    )


def tilt_gravity(source: Path, target: Path, axis: Array, angle: float) -> None:
    """Copy a robot's files with its gravity turned about an axis at right angles to it [rad]."""
    copy_robot(source, target)
    told = _read(target)
    stated = np.array(told.get("gravity", STANDARD_GRAVITY), float)
    turned = np.cos(angle) * stated + np.sin(angle) * np.cross(axis, stated)
    told["gravity"] = [_digits(each) for each in turned]
    _write(target, told)


def link_length(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A length before the joint wrong: a or d of a row, or the origin of a URDF's joint along its longest axis."""
    side = float(rng.choice([-1.0, 1.0]))
    place = _length_before(ground, joint, rng)
    if place is None:
        return None
    return Concealment(
        "link_length",
        joint,
        ("kinematic_error",),
        lambda size: {"d": side * size},
        LENGTH_M,
        rewrite=lambda size, source, target: lengthen_link(source, target, place, side * size),
        constants={"row": float(place[1]), "is_d": float(place[2] == "d"), "side": side},
    )


def _length_before(ground: Ground, joint: int, rng: np.random.Generator) -> tuple[str, int, str] | None:
    """A length that is not zero in the robot file, between the first joint and this one."""
    told = _read(ground.folder)["kinematics"]
    for form in ("dh", "mdh"):
        if form in told:  # of standard rows the one before the joint lies between; of modified ones its own
            last = joint - 1 if form == "dh" else joint
            first = 0 if form == "dh" else 1
            found = [
                (form, row, name) for row in range(first, last + 1) for name in ("a", "d") if told[form][row][name]
            ]
            return found[rng.integers(len(found))] if found else None
    return ("urdf", joint, "xyz") if joint > 0 else None


def lengthen_link(source: Path, target: Path, place: tuple[str, int, str], size: float) -> None:
    """Copy a robot's files with one length wrong by a size [m]."""
    copy_robot(source, target)
    told, (form, row, name) = _read(target), place
    if form == "urdf":
        _lengthen_urdf(target / told["kinematics"]["urdf"]["file"], told["joints"][row]["name"], size)
        return
    told["kinematics"][form][row][name] = _digits(float(told["kinematics"][form][row][name]) + size)
    _write(target, told)


def _lengthen_urdf(path: Path, joint: str, size: float) -> None:
    tree = etree.parse(path)
    (origin,) = tree.xpath(f"//joint[@name='{joint}']/origin")
    lengths = [float(each) for each in origin.get("xyz").split()]
    lengths[int(np.argmax(np.abs(lengths)))] += size
    origin.set("xyz", " ".join(f"{_digits(each)}" for each in lengths))
    tree.write(path)


def copy_robot(source: Path, target: Path) -> None:
    """Copy a robot file and what it refers to."""
    target.mkdir(parents=True, exist_ok=True)
    for path in [*source.glob("*.yaml"), *source.glob("*.urdf")]:
        shutil.copy(path, target / path.name)


def _digits(value: float) -> float:
    """Nine digits: more than a length or a component of gravity has."""
    return float(f"{value:.9g}")


def _read(folder: Path) -> dict[str, Any]:
    return YAML(typ="safe").load(folder / "robot.yaml")


def _write(folder: Path, told: dict[str, Any]) -> None:
    with (folder / "robot.yaml").open("w", encoding="utf-8") as file:
        YAML(typ="safe").dump(told, file)
