"""Actuators of an MJCF (torque motors, position servos with gains, or DC motors), and of Isaac Lab.

Isaac Sim 5 takes friction as torque: static, dynamic and viscous, which are τ_s, τ_s + τ_sc and τ_v of equation (7).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tauscope.dynamics import mass_matrix
from tauscope.errors import ExportError
from tauscope.export.compensation.source_code import comment_text, identifier
from tauscope.export.joint_model import dry_friction_and_damping, numbers
from tauscope.export.mjcf_findings import effects_in
from tauscope.export.model import ExportModel
from tauscope.robot import Joint, LinkInertia, Robot

# Bandwidth of gains that nothing states [rad/s]: 5 Hz, the reach of a small servo's position loop.
BANDWIDTH_RAD_S = 2.0 * np.pi * 5.0


class ActuatorKind(StrEnum):
    """Actuators of an exported arm."""

    MOTOR = "motor"
    POSITION = "position"
    DCMOTOR = "dcmotor"


@dataclass(frozen=True)
class ActuatorChoice:
    """Which actuators are written, and gains that go before those of the user's own MJCF."""

    kind: ActuatorKind = ActuatorKind.MOTOR
    kp: tuple[float, ...] = ()  # one for all joints or one a joint [Nm/rad or N/m]; empty where not given
    kv: tuple[float, ...] = ()  # likewise [Nm s/rad or N s/m]


def actuator_elements(
    robot: Robot, links: Sequence[LinkInertia], rotors: Sequence[float], names: Sequence[str], choice: ActuatorChoice
) -> tuple[list[str], list[str]]:
    """Elements, one a joint, and notes on gains chosen; `names`: quoted; `rotors` [kg m² or kg]. Raises ExportError."""
    if choice.kind is ActuatorKind.MOTOR:
        return [_motor(joint, name) for joint, name in zip(robot.joints, names, strict=True)], []
    gains, notes = joint_gains(robot, links, rotors, choice)
    write = _position if choice.kind is ActuatorKind.POSITION else _dc_motor
    elements = [write(joint, name, *pair) for joint, name, pair in zip(robot.joints, names, gains, strict=True)]
    if choice.kind is ActuatorKind.DCMOTOR:
        notes.append(
            "dcmotor: gear 1, all in joint units; inputs are position, velocity and torque. The torque constant is that"
            " of the robot file, else 1; the resistance, 1 Ohm, is not identified and has no effect without Vmax."
        )
    return elements, notes


def joint_gains(
    robot: Robot, links: Sequence[LinkInertia], rotors: Sequence[float], choice: ActuatorChoice
) -> tuple[list[tuple[float, float]], list[str]]:
    """Gains kp and kv as given, as in the user's MJCF, or for a bandwidth, and notes. Raises ExportError."""
    count, notes = robot.joint_count, []
    for option, values in (("kp", choice.kp), ("kv", choice.kv)):
        if len(values) not in (0, 1, count):
            raise ExportError(f"{option} has {len(values)} values; give one, or one for each of {count} joints")
    parameters = np.concatenate([link.to_vector() for link in links])
    inertia = np.diag(mass_matrix(robot, parameters, np.zeros((1, count)))[0]) + np.array(rotors)
    gains: list[tuple[float, float]] = []
    for joint, described in enumerate(robot.joints):
        stated = described.actuator
        kp = _choose_gain(choice.kp, joint)
        kv = _choose_gain(choice.kv, joint)
        if kp is None and stated is not None and stated.kind == "position" and stated.stiffness is not None:
            kp, kv = stated.stiffness, stated.damping if kv is None else kv
        if kp is None:
            kp = float(inertia[joint]) * BANDWIDTH_RAD_S**2
            notes.append(
                f"{described.name}: kp is not identified; it is chosen for 5 Hz at q = 0. Write the gain of your drive,"
                " or give it to tauscope export."
            )
        gains.append((kp, 2.0 * float(np.sqrt(kp * inertia[joint])) if kv is None else kv))
    return gains, notes


def _choose_gain(values: tuple[float, ...], joint: int) -> float | None:
    return None if not values else values[0] if len(values) == 1 else values[joint]


def _motor(joint: Joint, name: str) -> str:
    limit = joint.limits.torque
    both = "" if limit is None else f' ctrlrange="{numbers(-limit, limit)}" forcerange="{numbers(-limit, limit)}"'
    return f"<motor name={name} joint={name}{both}/>"


def _position(joint: Joint, name: str, kp: float, kv: float) -> str:
    """A position servo: kp (ctrl - q) - kv q̇."""
    reach, limit = joint.limits.position, joint.limits.torque
    control = "" if reach is None else f' ctrlrange="{numbers(*reach)}"'
    force = "" if limit is None else f' forcerange="{numbers(-limit, limit)}"'
    return f'<position name={name} joint={name} kp="{numbers(kp)}" kv="{numbers(kv)}"{control}{force}/>'


def _dc_motor(joint: Joint, name: str, kp: float, kv: float) -> str:
    """A DC motor with an on-board controller: kp (ctrl₁ - q) + kv (ctrl₂ - q̇) + ctrl₃."""
    constant = abs(joint.torque_constant) if joint.has_torque_constant else 1.0
    limit = joint.limits.torque
    saturation = "" if limit is None else f' saturation="{numbers(limit, 0.0, 0.0)}"'
    return (
        f'<dcmotor name={name} joint={name} motorconst="{numbers(constant, 0.0)}" resistance="1.0" '
        f'input="pos vel ff" controller="{numbers(kp, 0.0, kv, 0.0, 0.0, 0.0)}"{saturation}/>'
    )


def to_isaac_lab(model: ExportModel, choice: ActuatorChoice) -> str:
    """Python source with ``NAME_ACTUATORS``, for ``ArticulationCfg(actuators=…)``. Raises ExportError."""
    rotors = [value or 0.0 for value in model.rotor_inertia]
    gains, notes = joint_gains(model.robot, model.links, rotors, choice)
    names = [re.escape(joint.name) for joint in model.robot.joints]
    limits = {n: j.limits.torque for n, j in zip(names, model.robot.joints, strict=True) if j.limits.torque is not None}
    fields: dict[str, dict[str, float]] = {
        "stiffness": {name: kp for name, (kp, _) in zip(names, gains, strict=True)},
        "damping": {name: kv for name, (_, kv) in zip(names, gains, strict=True)},
        "armature": dict(zip(names, rotors, strict=True)),
        "friction": {},
        "dynamic_friction": {},
        "viscous_friction": {},
        **({"effort_limit": limits} if limits else {}),
    }
    for name, joint, friction in zip(names, model.robot.joints, model.friction, strict=True):
        dynamic, viscous = dry_friction_and_damping(joint.name, friction)
        fields["friction"][name] = max(friction.stiction, dynamic)
        fields["dynamic_friction"][name] = dynamic
        fields["viscous_friction"][name] = viscous
        if friction.offset:
            notes.append(f"{joint.name}: there is no constant torque; the identified offset is {friction.offset:.6g}.")
    notes += effects_in(model, (), "Isaac Lab has no such parameter")
    entries = "".join(_entry(field, values) for field, values in fields.items())
    comment = "".join(f"# {comment_text(note)}\n" for note in notes)
    return (
        f"# Actuators of {comment_text(model.robot.name)}, written by Tauscope {model.origin.version}.\n"
        "# Isaac Lab 2.3 or later, Isaac Sim 5 or later: friction is a torque there. Masses are in the exported URDF.\n"
        f"{comment}\nfrom isaaclab.actuators import ImplicitActuatorCfg\n\n"
        f"{identifier(model.robot.name).upper()}_ACTUATORS = {{\n"
        f'    "arm": ImplicitActuatorCfg(\n        joint_names_expr={names!r},\n{entries}    ),\n}}\n'
    )


def _entry(field: str, values: Mapping[str, float]) -> str:
    rows = "".join(f"            {name!r}: {value!r},\n" for name, value in values.items())
    return f"        {field}={{\n{rows}        }},\n"
