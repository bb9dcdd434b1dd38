"""A model that is rolled out: its MJCF, and the laws beside it."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np

from tauscope.closed_loop.laws import JointLaws, LoadFriction
from tauscope.export.compensation.model import JointFriction
from tauscope.export.mjcf import to_mjcf
from tauscope.export.mjcf_findings import IN_THE_MODEL, add_findings
from tauscope.export.model import ExportModel, Origin
from tauscope.recording import EffortKind
from tauscope.robot import FrictionCoefficients, LinkInertia, Robot

# Mass added to stated links, relative to the arm's: MuJoCo moves no body without mass, and no rod without width.
TRACE_SHARE = 1e-6
UNUSED_K_V = 1.0  # k_v of stated friction [s/rad or s/m]: a rollout takes friction as a step
TRACE_RADIUS_M = 0.01  # radius of that mass [m]


@dataclass(frozen=True, eq=False)
class RolloutModel:
    """One model of the arm. `name`: ``stated``, ``identified`` or ``findings``."""

    name: str
    mjcf: str
    joints: tuple[str, ...]  # names of the driven joints in the MJCF
    laws: JointLaws
    inertia: np.ndarray  # (n,), of each joint at q = 0 with all that it carries [kg m² or kg]
    left_out: tuple[str, ...]  # findings that the simulation lacks, each with the reason


def stated_model(robot: Robot) -> ExportModel | None:
    """What the robot file's model block believes; None where it states no links."""
    stated = robot.model
    if stated.links is None or not any(link.mass > 0.0 for link in stated.links):
        return None
    count = robot.joint_count
    mass = TRACE_SHARE * sum(link.mass for link in stated.links)
    trace = LinkInertia(mass, np.zeros(3), mass * TRACE_RADIUS_M**2 * np.eye(3))
    friction = stated.friction or (FrictionCoefficients(),) * count
    frictions = tuple(
        JointFriction(own.stiction, own.stribeck, own.viscous, 0.0, shape.k_v or UNUSED_K_V, shape.delta)
        for own, shape in zip(friction, (joint.friction_shape for joint in robot.joints), strict=True)
    )
    links = tuple(LinkInertia.from_vector(link.to_vector() + trace.to_vector()) for link in stated.links)
    rotors, origin = stated.rotor_inertia or (None,) * count, Origin((), EffortKind.TORQUE, datetime.now(UTC))
    return ExportModel(replace(robot, segment_names=()), links, frictions, frictions, rotors, (), origin)


def rollout_model(name: str, model: ExportModel, friction_by_load: LoadFriction | None = None) -> RolloutModel:
    """The model as a simulator and the laws beside it take it. Raises ExportError where a link cannot exist."""
    from tauscope.dynamics import mass_matrix

    added = add_findings(model)
    names = [joint.name for joint in model.robot.joints]
    beside = tuple(found for found in added.left if found.effect.code and found.effect.joint is not None)
    left_out = [
        f"{found.effect.name(names)}: {found.effect.no_code or 'no simulator has it'}"
        for found in added.left
        if found not in beside and found.effect.id not in IN_THE_MODEL
    ]
    held = np.array([extras.dry_friction for extras in added.joints])
    laws = JointLaws(model, beside, held, tuple(extras.has_offset for extras in added.joints), friction_by_load)
    parameters = np.concatenate([link.to_vector() for link in added.links])
    at_zero = np.zeros((1, model.robot.joint_count))
    rotors = np.array([value or 0.0 for value in model.rotor_inertia])
    return RolloutModel(
        name=name,
        mjcf=to_mjcf(model).text,
        joints=tuple(model.robot.segment_labels[link] for link in model.robot.own_links),
        laws=laws,
        inertia=np.diag(mass_matrix(model.robot, parameters, at_zero)[0]) + rotors,
        left_out=tuple(left_out),
    )
