"""Arms that emulated drives move: what is true of them, what a campaign is told, and how far off it ends."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from arms import random_link
from tauscope.identification import IdentificationDocument
from tauscope.robot import Robot

MODEL = "PH54-200-S500"
TORQUE_PER_MILLIAMPERE = 0.005

_INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")
_UR5 = (
    (0.0, 0.089159, 0.0, np.pi / 2),
    (0.0, 0.0, -0.425, 0.0),
    (0.0, 0.0, -0.39225, 0.0),
    (0.0, 0.10915, 0.0, np.pi / 2),
    (0.0, 0.09465, 0.0, -np.pi / 2),
    (0.0, 0.0823, 0.0, 0.0),
)
_TORQUE = (100.0, 100.0, 80.0, 40.0, 40.0, 30.0)


def three_joints() -> dict[str, Any]:
    """The first three of the six: no posture leaves a joint without inertia, as the seed paper's upright arm does."""
    return _arm("three-servos", 3)


def six_joints() -> dict[str, Any]:
    """The UR5's geometry with links of a few kilograms, lighter towards the hand, and friction that falls likewise."""
    return _arm("six-servos", 6)


def _arm(name: str, count: int) -> dict[str, Any]:
    rng = np.random.default_rng(3)
    limits = {"position": [-2.9, 2.9], "velocity": 2.0, "acceleration": 5.0}
    return {
        "name": name,
        "kinematics": {"dh": [dict(zip(("theta", "d", "a", "alpha"), row, strict=True)) for row in _UR5[:count]]},
        "joints": [
            {
                "name": f"joint{number}",
                "limits": {**limits, "torque": torque},
                "friction_shape": {"k_v": 500, "delta": 10},
            }
            for number, torque in enumerate(_TORQUE[:count], 1)
        ],
        "model": {
            "links": [_link(scale * random_link(rng).to_vector()) for scale in (1.0, 1.0, 1.0, 0.3, 0.3, 0.3)[:count]],
            "friction": [
                {"stiction": 2.0 / (1.0 + 0.5 * j), "stribeck": -0.3, "viscous": 0.5 / (1.0 + j)} for j in range(count)
            ],
        },
    }


def _link(vector: np.ndarray) -> dict[str, Any]:
    values = [float(value) for value in vector]
    inertia = dict(zip(_INERTIA, values[:6], strict=True))
    return {"mass": values[6], "first_moment": values[7:], "inertia": inertia}


def write_robot(arm: dict[str, Any], path: Path, port: str, *, knows_model: bool = True) -> Path:
    """The arm with a PH54 at every joint, with or without the truth about its links and friction."""
    told = {key: value for key, value in arm.items() if knows_model or key != "model"}
    return write_servos(told, path, port, id_key="id", constant=TORQUE_PER_MILLIAMPERE, model=MODEL)


def write_servos(arm: dict[str, Any], path: Path, port: str, *, id_key: str, constant: float, **block: Any) -> Path:
    """The arm with a servo at every joint."""
    joints = [
        {**joint, "torque_constant": constant, "drive": {id_key: number, **block}}
        for number, joint in enumerate(arm["joints"], 1)
    ]
    joints[0]["drive"]["port"] = port
    path.write_text(json.dumps({**arm, "joints": joints}), encoding="utf-8")
    return path


def standard_parameters(robot: Robot) -> dict[str, float]:
    """True value of every standard parameter by its name, as results call them: ``Ixx1`` …"""
    assert robot.model is not None
    assert robot.model.links is not None
    names = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "m", "msx", "msy", "msz")
    return {
        f"{name}{number}": float(value)
        for number, link in enumerate(robot.model.links, 1)
        for name, value in zip(names, link.to_vector(), strict=True)
    }


def deviations(found: IdentificationDocument, truth: Robot) -> dict[str, float]:
    """Distance of every parameter from the truth, in its own standard errors."""
    true, result = standard_parameters(truth), {}
    for entry in found.base_parameters:
        assert entry.std is not None
        value = sum(factor * true[name] for name, factor in entry.terms.items())
        result[entry.name] = (entry.value - value) / entry.std
    assert truth.model is not None
    assert truth.model.friction is not None
    for friction, coefficients in zip(found.friction, truth.model.friction, strict=True):
        for name in ("stiction", "stribeck", "viscous"):
            std = friction.std[name]
            assert std is not None
            result[f"{name} of {friction.joint}"] = (getattr(friction, name) - getattr(coefficients, name)) / std
    return result


def assert_within(errors: float, far: dict[str, float]) -> None:
    """Every parameter is found within so many of its standard errors; else those that are not are named."""
    missed = {name: round(distance, 2) for name, distance in far.items() if not abs(distance) < errors}
    assert not missed, f"farther than {errors} standard errors: {missed}"
