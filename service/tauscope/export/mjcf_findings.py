"""Findings of a diagnosis in the terms of MuJoCo, and the reason where it has none.

τ of a finding is torque of the drive; the joint in MuJoCo feels -τ. Cogging and bristles are passive
``dcmotor`` elements, which MuJoCo has from version 3.8 on; all else loads in any version.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import atan2, hypot

import numpy as np

from tauscope.effects.base_tilt import tilt_directions
from tauscope.effects.carried_body import unit_body
from tauscope.effects.friction_coupling import FrictionCoupling
from tauscope.effects.kinematic_error import displaced
from tauscope.export.compensation.model import JointFriction
from tauscope.export.joint_model import JointModel, dry_friction_and_damping, friction_notes, joint_models, numbers
from tauscope.export.model import ExportModel, FoundEffect
from tauscope.robot import Joint, LinkInertia, Robot

# Effects that the joints' own friction and armature hold.
IN_THE_MODEL = frozenset({"coulomb_friction", "viscous_friction", "torque_offset", "rotor_inertia"})
# Attributes with which frictionloss holds a joint at rest: MuJoCo's own let it creep, by 25 mrad/s under 2/3 of it.
REST = {"solreffriction": "0.002 1", "solimpfriction": "0.9999 0.9999 0.001 0.5 2"}
NEWER = "needs MuJoCo 3.8 or later"


@dataclass
class JointExtras:
    """Attributes that findings add to the elements of one joint."""

    attributes: dict[str, str] = field(default_factory=dict)
    damping: tuple[float, float] = (0.0, 0.0)
    dry_friction: float = 0.0  # taken off frictionloss, since bristles have it [Nm or N]
    passive: list[str] = field(default_factory=list)  # attributes of passive dcmotor elements
    has_offset: bool = False

    def friction_attributes(self, label: str, friction: JointFriction) -> dict[str, str]:
        """Attributes of the joint that hold its friction, beside these findings."""
        dry, damping = dry_friction_and_damping(label, friction)
        orders = (damping, *self.damping) if any(self.damping) else (damping,)
        return {"damping": numbers(*orders), "frictionloss": numbers(max(0.0, dry - self.dry_friction)), **REST}


@dataclass(frozen=True)
class MjcfSegment:
    """What a file says of a segment; one that follows another has no joint of the robot, and no findings."""

    label: str
    model: JointModel
    joint: Joint | None
    extras: JointExtras
    notes: list[str]  # what is lost of its friction


@dataclass
class Additions:
    """Changes that findings make to a file."""

    robot: Robot
    links: list[LinkInertia]
    friction: tuple[JointFriction, ...]
    joints: list[JointExtras]
    tendons: list[tuple[float, float, Mapping[int, float]]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left: list[FoundEffect] = field(default_factory=list)  # findings that MuJoCo cannot hold

    def segments(self, model: ExportModel) -> Iterator[MjcfSegment]:
        """The segments of the model that these are added to, base first."""
        own = {link: joint for joint, link in enumerate(self.robot.own_links)}
        made = joint_models(model.robot, self.links, model.friction, model.rotor_inertia)
        for link, (label, each) in enumerate(made.items()):
            joint = None if link not in own else self.robot.joints[own[link]]
            extras = JointExtras() if link not in own else self.joints[own[link]]
            friction = replace(each.friction, offset=0.0) if each.friction and extras.has_offset else each.friction
            notes = [] if friction is None else friction_notes(label, friction, "MJCF")
            yield MjcfSegment(label, each, joint, extras, notes)


def add_findings(model: ExportModel, *, without: Collection[str] = ()) -> Additions:
    """What MuJoCo can hold of a model's findings, but effects of ids `without`; and a note on each of the others."""
    extras = [JointExtras() for _ in model.robot.joints]
    added = Additions(model.robot, list(model.links), model.friction, extras)
    names = [joint.name for joint in model.robot.joints]
    for found in model.effects:
        if found.effect.id in IN_THE_MODEL:
            continue
        write = WRITERS.get(found.effect.id)
        if found.effect.id in without:
            reason = "it changes the frame of a body, which stays as it was"
        else:
            reason = "MJCF has no such element" if write is None else write(added, found)
        label = found.effect.name(names)
        if reason is None:
            added.notes.append(f"{label} ({found.effect.equation}) is included.")
        else:
            added.left.append(found)
            added.notes.append(f"{label} is not included: {reason}. {_values(found)}")
    return added


def _values(found: FoundEffect) -> str:
    values = ", ".join(f"{name} = {value:.6g}" for name, value in found.values.items())
    return f"{found.effect.equation}; {values}."


def _spring(added: Additions, found: FoundEffect) -> str | None:
    """Stiffness k, its rest where the fitted constant is zero, too."""
    stiffness, joint = float(found.coefficients[0]), found.effect.joint or 0
    if stiffness <= 0.0:
        return "MuJoCo refuses a negative stiffness"
    rest = -added.friction[joint].offset / stiffness
    added.joints[joint].attributes |= {"stiffness": numbers(stiffness), "springref": numbers(rest)}
    added.joints[joint].has_offset = True
    return None


def _add_power_of_speed(added: Additions, found: FoundEffect) -> str | None:
    """Damping of second or third order, the two that MuJoCo has."""
    amplitude, power, joint = float(found.coefficients[0]), float(found.shape[0]), found.effect.joint or 0
    square, cube = added.joints[joint].damping
    if abs(power - 2.0) < 0.05:
        added.joints[joint].damping = (square + amplitude, cube)
    elif abs(power - 3.0) < 0.05:
        added.joints[joint].damping = (square, cube + amplitude)
    else:
        return f"MuJoCo has damping of second and third order, not of order {power:.3g}"
    return None


def _cogging(added: Additions, found: FoundEffect) -> str | None:
    """-a sin(kq + φ) on the joint."""
    sine, cosine = (float(value) for value in found.coefficients)
    wave = numbers(-hypot(sine, cosine), float(found.shape[0]), atan2(cosine, sine))
    added.joints[found.effect.joint or 0].passive.append(f'cogging="{wave}"')
    return None


def _bristles(added: Additions, found: FoundEffect) -> str | None:
    """LuGre bristles without a Stribeck effect, which are Dahl's: σ₀ = F / x_s; frictionloss holds the rest."""
    force, length, joint = float(found.coefficients[0]), float(found.shape[0]), found.effect.joint or 0
    if force <= 0.0:
        return "friction that falls after a reversal is no bristle"
    added.joints[joint].passive.append(f'lugre="{numbers(force / length, 0.0, force, force, 1.0)}"')
    added.joints[joint].dry_friction += force
    return None


def _payload(added: Additions, found: FoundEffect) -> str | None:
    body = float(found.coefficients[0]) * unit_body(found.shape)
    added.links[-1] = LinkInertia.from_vector(added.links[-1].to_vector() + body)
    return None


def _tilt(added: Additions, found: FoundEffect) -> str | None:
    gravity = added.robot.gravity
    strength, across = float(np.linalg.norm(gravity)), tilt_directions(gravity)
    turned = gravity + strength * sum(float(a) * e for a, e in zip(found.coefficients, across, strict=True))
    added.robot = replace(added.robot, gravity=turned)
    return None


def _displacement(added: Additions, found: FoundEffect) -> str | None:
    link, axis = (int(each) - 1 for each in found.shape)
    added.robot = displaced(added.robot, link, float(found.coefficients[0]) * np.eye(3)[axis])
    return None


def _coupling(added: Additions, found: FoundEffect) -> str | None:
    effect = found.effect
    if not isinstance(effect, FrictionCoupling):
        return "its form is not known"
    dry, damping = (float(value) for value in found.coefficients)
    if dry < 0.0 or damping < 0.0:
        return "friction that drives is not written"
    added.tendons.append((dry, damping, {effect.joint or 0: 1.0, effect.partner: float(effect.sign)}))
    return None


# Functions that write an effect into a file, or return the reason against it.
WRITERS: Mapping[str, Callable[[Additions, FoundEffect], str | None]] = {
    "joint_spring": _spring,
    "nonlinear_viscous": _add_power_of_speed,
    "cogging": _cogging,
    "presliding_hysteresis": _bristles,
    "payload": _payload,
    "base_tilt": _tilt,
    "kinematic_error": _displacement,
    "friction_coupling": _coupling,
}


def effects_in(model: ExportModel, included: Sequence[str], why: str) -> list[str]:
    """Notes on the findings that a format does not hold. `included`: ids of the effects that it holds."""
    names = [joint.name for joint in model.robot.joints]
    left = [found for found in model.effects if found.effect.id not in (*included, *IN_THE_MODEL)]
    return [f"{found.effect.name(names)} is not included: {why}. {_values(found)}" for found in left]
