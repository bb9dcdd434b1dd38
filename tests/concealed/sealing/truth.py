"""What a trial conceals, as a file says it that is opened after the diagnosis."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from concealed.generator.arms import arm_named
from concealed.generator.case import Case
from concealed.generator.effects import Drawn
from concealed.generator.forward import Entry
from concealed.generator.trial import Trial

Parameters = dict[str, float]


def _renamed(**names: str) -> Callable[[Entry], Parameters]:
    return lambda entry: {ours: float(entry[theirs]) for ours, theirs in names.items()}


PARAMETERS: dict[str, Callable[[Entry], Parameters]] = {
    "asymmetric_coulomb": lambda entry: {"a": 0.5 * entry["amplitude"]},  # forwards only: half of it goes both ways
    "asymmetric_viscous": lambda entry: {"b": 0.5 * entry["amplitude"]},
    "nonlinear_viscous": _renamed(c="amplitude", p="exponent"),
    "stribeck_friction": _renamed(s="amplitude", v_s="velocity", alpha="exponent"),
    "load_dependent_friction": _renamed(mu="mu"),
    "position_dependent_friction": lambda entry: {
        "a": entry["amplitude"] * np.sin(entry["phase"]),
        "b": entry["amplitude"] * np.cos(entry["phase"]),
        "k": entry["order"],
    },
    "presliding_hysteresis": _renamed(x_s="distance"),
    "friction_coupling": _renamed(f="coulomb", w="viscous"),
    "cogging": _renamed(order="order", amplitude="amplitude"),
    "torque_ripple": _renamed(order="order", amplitude="amplitude"),
    "joint_elasticity": lambda entry: {"c": 1.0 / entry["stiffness"]},
    "backlash": _renamed(b="gap"),
    "rotor_inertia": _renamed(I_a="inertia"),
    "torque_gain_error": lambda entry: {"g": entry["gain"] - 1.0},
    "torque_saturation": _renamed(c="level"),
    "time_delay": _renamed(d="delay"),
    "joint_spring": _renamed(k="stiffness"),
    "kinematic_error": lambda entry: {
        "d": float(np.sum(entry["translation"])),
        "link": entry["link"],
        "axis": 1 + int(np.argmax(np.abs(entry["translation"]))),
    },
    "payload_change": _renamed(m="mass"),
    "external_contact": _renamed(c="torque"),
    "cable_force": _renamed(k="stiffness", q_t="angle", p="exponent"),
}
"""Values that a finding's parameters should have, by the names that the finding gives them."""


@dataclass(frozen=True)
class Hidden:
    """One concealed effect.

    labels : list of str
        ``effect@joint``, or ``effect`` for the whole arm: each is a right answer
    also : list of str
        labels that come with it and are no error
    joints : list of str or None
        where it is
    parameters : dict
        values that the finding should tell
    """

    labels: list[str]
    also: list[str]
    joints: list[str | None]
    parameters: Parameters


@dataclass(frozen=True)
class Truth:
    """All of a trial's truth.

    case : dict
        what was drawn
    hidden : list of Hidden
        none on a sound arm
    strength : float
        s that was reached
    torque_std : list of float
        noise of the torque [Nm or N]
    own : list of str
        labels of the arm's own friction that its robot file does not state: no error
    """

    case: dict[str, Any]
    hidden: list[Hidden]
    strength: float
    torque_std: list[float]
    own: list[str] = field(default_factory=list)

    def seal(self, path: Path) -> str:
        """Write it, and give the SHA-256 of what was written."""
        told = json.dumps(asdict(self), indent=1, sort_keys=True).encode()
        path.write_bytes(told)
        return hashlib.sha256(told).hexdigest()


def opened(path: Path, seal: str) -> Truth:
    """Read the truth, after it is known that nobody has changed it since."""
    told = path.read_bytes()
    if hashlib.sha256(told).hexdigest() != seal:
        raise ValueError(f"{path} is not what was sealed")
    read = json.loads(told)
    return Truth(**{**read, "hidden": [Hidden(**each) for each in read["hidden"]]})


def truth_of(trial: Trial, case: Case | None = None) -> Truth:
    """What a trial conceals."""
    names = [joint.name for joint in trial.robot.joints]
    entries = trial.concealed.entries or ({},) * len(trial.truth)
    # Signs of all joints are several entries and one truth.
    hidden = [_hidden(drawn, entry, names) for drawn, entry in zip(trial.truth, entries, strict=False)]
    told = {} if case is None else case.as_dict()
    noise = [float(each) for each in trial.noise.torque_std]
    return Truth(told, hidden, float(trial.strength), noise, _list_unstated(trial))


def _list_unstated(trial: Trial) -> list[str]:
    """Joints whose friction falls with speed, by a constant that no robot file states: τ_sc atan(δ q̇) with τ_sc < 0."""
    friction = arm_named(trial.arm).model.friction
    assert friction is not None
    pairs = zip(trial.robot.joints, friction, strict=True)
    return [
        label("stribeck_friction", joint.name)
        for joint, own in pairs
        if joint.friction_shape.delta is None and own.stribeck < 0.0
    ]


def _hidden(drawn: Drawn, entry: Entry, names: list[str]) -> Hidden:
    def labels(effects: tuple[str, ...], places: tuple[int | None, ...]) -> list[str]:
        return [label(name, None if place is None else names[place]) for name in effects for place in places]

    known = PARAMETERS.get(entry.get("effect", ""))
    values = {} if known is None else {name: float(value) for name, value in known(entry).items()}
    joints = [None if place is None else names[place] for place in drawn.places]
    also = labels(drawn.also, drawn.also_places or drawn.places)
    return Hidden(labels(drawn.names, drawn.places), also, joints, values)


def label(effect: str, joint: str | None) -> str:
    """How `equivalent` writes an effect at its place."""
    return effect if joint is None else f"{effect}@{joint}"
