"""The identified joints as an actuator configuration of Isaac Lab: gains, armature, friction and torque limits.

Isaac Sim 5 takes friction as torque: static, dynamic and viscous, which are τ_s, τ_s + τ_sc and τ_v of equation (7).
"""

import re
from collections.abc import Mapping

from tauscope.export.actuators import ActuatorChoice, joint_gains
from tauscope.export.compensation.source_code import comment_text, identifier
from tauscope.export.joint_model import dry_friction_and_damping
from tauscope.export.mjcf_findings import effects_in
from tauscope.export.model import ExportModel


def to_isaac_lab(model: ExportModel, choice: ActuatorChoice) -> str:
    """Python source with ``NAME_ACTUATORS``, for ``ArticulationCfg(actuators=…)``.

    Raises ExportError if a coefficient is not finite, or the number of gains is not one, nor that of the joints.
    """
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
    """A field with its values by joint."""
    rows = "".join(f"            {name!r}: {value!r},\n" for name, value in values.items())
    return f"        {field}={{\n{rows}        }},\n"
