"""The robot file as CONTRACT.md defines it, one class a mapping, and where each entry came from, for its errors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Self, TypeVar, get_args

from pydantic import BeforeValidator, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from tauscope.errors import RobotFileError
from tauscope.robot.actuator import SERVOS, ActuatorKind, GainUnit
from tauscope.robot.document_fields import (
    Angle,
    Document,
    Motion,
    Name,
    Nonzero,
    NotNegative,
    Number,
    PlainMapping,
    Positive,
    Range,
    Rotation,
    Share,
    Sign,
    Text,
    Vector,
    check_source,
    choice,
    refusal,
)
from tauscope.robot.messages import shown
from tauscope.robot.recording_layout import RecordingLayout, Source, find_column_fault, find_fault, find_separator_fault
from tauscope.robot.robot import JointType
from tauscope.robot.yaml_text import Place

DocumentType = TypeVar("DocumentType", bound=Document)

# Our words for pydantic's kinds of error.
WORDING: Mapping[str, Callable[[ErrorDetails], str]] = {
    "refused": lambda e: e.get("ctx", {})["text"],
    "missing": lambda e: f"the key {shown(e['loc'][-1])} is missing; add it",
    "model_type": lambda e: f"must be a mapping, but is {shown(e['input'])}",
    "list_type": lambda e: f"must be a list, but is {shown(e['input'])}",
    "too_short": lambda e: "must not be an empty list; leave the key out instead",
    "too_long": lambda e: f"holds more than {e.get('ctx', {})['max_length']} entries",
}


def first_fault(error: ValidationError) -> tuple[Place, str]:
    """Where the first of a document's errors is, and what it is in our words."""
    details = error.errors(include_url=False)
    place: Place = tuple(details[0]["loc"])
    key = details[0].get("ctx", {}).get("key")
    word = WORDING.get(details[0]["type"], lambda e: e["msg"])
    more = f" (the first of {len(details)} errors)" if len(details) > 1 else ""
    return place if key is None else (*place, key), word(details[0]) + more


@dataclass(frozen=True)
class DocumentOrigin:
    """The label of a document (its path), its data as read, and the line of every entry where it has lines."""

    label: str
    data: Any
    lines: Mapping[Place, int] = field(default_factory=dict)

    def where(self, place: Place) -> str:
        """Where an entry stands, as ``arm.yaml:12: joints[2].limits.position (joint 3, 'wrist')``."""
        # Of an entry that is missing, the line of the nearest mapping that should hold it.
        known = (place[:length] for length in range(len(place), -1, -1))
        line = next((self.lines[above] for above in known if above in self.lines), None)
        path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).lstrip(".")
        parts = [self.label if line is None else f"{self.label}:{line}"]
        if path:
            parts.append(path + self._joint(place))
        return ": ".join(parts)

    def error(self, place: Place, text: str) -> RobotFileError:
        """The error of an entry."""
        return RobotFileError(f"{self.where(place)}: {text}")

    def validate(self, kind: type[DocumentType]) -> DocumentType:
        """The data as a validated document. Raises RobotFileError naming the first entry that is not valid."""
        if not isinstance(self.data, Mapping):
            raise self.error((), f"must be a mapping with name and kinematics, but is {shown(self.data)}")
        try:
            return kind.model_validate(self.data)
        except ValidationError as error:
            place, text = first_fault(error)
        raise self.error(place, text)

    def _joint(self, place: Place) -> str:
        """The joint or link that an entry is about, numbered from 1, with its name where the document gives one."""
        for index, step in enumerate(place):
            if isinstance(step, int) and place[index - 1] in ("joints", "dh", "mdh", "friction", "segments", "links"):
                number, noun = step + 1, "link" if place[index - 1] == "links" else "joint"
                name = self._joint_name(step)
                return f" ({noun} {number})" if name is None else f" ({noun} {number}, {shown(name)})"
        return ""

    def _joint_name(self, index: int) -> str | None:
        joints = self.data.get("joints") if isinstance(self.data, Mapping) else None
        if not isinstance(joints, list) or index >= len(joints) or not isinstance(joints[index], Mapping):
            return None
        name = joints[index].get("name")
        return name if isinstance(name, str) else None


MOST_JOINTS = 100

Columns = Annotated[Source, BeforeValidator(check_source)]


class DenavitHartenbergRowDocument(Document):
    """One row of ``dh`` or ``mdh``."""

    theta: Angle  # θ [rad]
    d: Number  # along z [m]
    a: Number  # along x [m]
    alpha: Angle  # α [rad]
    type: Motion = JointType.REVOLUTE


class CouplingDocument(Document):
    """The joint that a segment follows."""

    joint: Annotated[int, Field(ge=0, lt=MOST_JOINTS, strict=True)]  # index of the joint, from 0
    multiplier: Number
    offset: Number  # position of the segment where the joint is at zero [rad or m]


class ChainDocument(Document):
    """Where the URDF or MJCF is, and between which of its links or bodies the chain runs."""

    file: Name
    base: Name | None = None
    tip: Name | None = None


Rows = list[DenavitHartenbergRowDocument]


class KinematicsDocument(Document):
    """The chain, described in exactly one way."""

    dh: Rows | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)
    mdh: Rows | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)
    urdf: ChainDocument | None = None
    mjcf: ChainDocument | None = None

    @model_validator(mode="after")
    def _check_one(self) -> Self:
        known = type(self).model_fields
        given = [name for name in known if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise refusal(f"must hold exactly one of {', '.join(known)}, but holds {found}")
        return self


class LimitsDocument(Document):
    """What a joint may do."""

    position: Range | None = None  # lowest and highest position [rad or m]
    velocity: Positive | None = None  # largest speed [rad/s or m/s]
    acceleration: Positive | None = None  # largest acceleration [rad/s² or m/s²]
    torque: Positive | None = None  # largest torque [Nm] or force [N]


class FrictionShapeDocument(Document):
    """Shape constants of the friction curve."""

    k_v: Positive | None = None  # K_v of equation (8) [s/rad or s/m]
    delta: Positive | None = None  # δ of equation (7) [s/rad or s/m]


class ActuatorDocument(Document):
    """The drive of a joint, as `Actuator` has it."""

    kind: Annotated[ActuatorKind, choice("kind", get_args(ActuatorKind))]
    kp: Positive | None = None  # of the loop, in `unit`
    kd: NotNegative = 0.0  # torque per velocity [Nm s/rad or N s/m], or a register value
    unit: Annotated[GainUnit | None, choice("unit", get_args(GainUnit))] = None
    servo: Annotated[str | None, choice("servo", SERVOS)] = None
    supply_voltage: Positive | None = None  # [V]
    torque_per_volt: Positive | None = None  # [Nm/V or N/V]
    max_duty: Share | None = None  # share of the supply, 0 to 1
    back_emf: NotNegative = 0.0  # [V s/rad or V s/m]
    dead_band: NotNegative | None = None  # [rad or m]
    delay: NotNegative | None = None  # [s]; None: estimated
    rate_hz: Positive | None = None  # [Hz]
    temperature_slope: NotNegative = 0.0  # relative loss of torque per volt [1/K]
    scale_std: NotNegative | None = None  # relative standard error of the torque's scale

    @model_validator(mode="after")
    def _check_loop(self) -> Self:
        if self.kind != "torque" and self.kp is None:
            raise refusal(f"a {self.kind} loop needs kp, in the unit of `unit`: register or Nm_per_rad")
        if self.servo is not None and self.unit == "Nm_per_rad":
            raise refusal("servo converts registers; write unit: register, or leave servo out", "servo")
        return self


class JointDocument(Document):
    """One joint."""

    name: Name
    limits: LimitsDocument | None = None
    gear_ratio: Nonzero | None = None
    torque_constant: Nonzero | None = None
    sign: Sign | None = None
    friction_shape: FrictionShapeDocument | None = None
    drive: PlainMapping | None = None
    actuator: ActuatorDocument | None = None


class InertiaDocument(Document):
    """The six entries of an inertia matrix about the link frame's origin [kg m²]."""

    xx: Number
    yy: Number
    zz: Number
    xy: Number
    xz: Number
    yz: Number


class LinkDocument(Document):
    """Inertial parameters of one link."""

    mass: Number  # m [kg]
    first_moment: Vector  # m s [kg m]
    inertia: InertiaDocument  # about the link frame's origin [kg m²]


class FrictionDocument(Document):
    """Friction coefficients of one joint."""

    stiction: Number  # τ_s [Nm or N]
    stribeck: Number  # τ_sc [Nm or N]
    viscous: Number  # τ_v [Nm s/rad or N s/m]


class ModelDocument(Document):
    """What the user's simulation believes; `rotor_inertia` is reflected to the joint [kg m² or kg]."""

    links: list[LinkDocument] | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)
    friction: list[FrictionDocument] | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)
    rotor_inertia: list[NotNegative] | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)


class RecordingDocument(Document):
    """How the arm's recordings are written."""

    columns: dict[Name, Columns] | Name | None = None
    units: dict[Name, Name] = Field(default_factory=dict)
    rate_hz: Positive | None = None  # samples a second where t counts samples [Hz]
    decimal: Text | None = None
    delimiter: Text | None = None
    topic: Name | None = None

    @model_validator(mode="after")
    def _check_layout(self) -> Self:
        columns = find_column_fault(self.columns)
        if columns is not None:
            raise refusal(columns, "columns")
        fault = find_fault(self.units, self.rate_hz)
        if fault is not None:
            raise refusal(fault[1], None if fault[0] == "rate_hz" else "units")
        separator = find_separator_fault(self.decimal, self.delimiter)
        if separator is not None:
            raise refusal(separator[1], separator[0])
        return self

    @property
    def layout(self) -> RecordingLayout:
        """The same for those who read."""
        return RecordingLayout(self.units, self.rate_hz, self.columns, self.decimal, self.delimiter, self.topic)


class RobotDocument(Document):
    """The whole robot file."""

    name: Name
    kinematics: KinematicsDocument
    gravity: Vector | None = None  # in the base frame [m/s²]; None: the gravity of the MJCF, else [0, 0, -9.81]
    locked: dict[Name, Number] = Field(default_factory=dict)  # position of joints that do not move [rad or m]
    joints: list[JointDocument] | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)
    model: ModelDocument | None = None
    recording: RecordingDocument | None = None

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names = [joint.name for joint in self.joints or ()]
        for index, name in enumerate(names):
            if name in names[:index]:
                first, second = names.index(name) + 1, index + 1
                raise refusal(f"joints {first} and {second} are both named {shown(name)}; rename one", "joints")
        return self

    @model_validator(mode="after")
    def _check_locked(self) -> Self:
        if self.locked and self.kinematics.urdf is None and self.kinematics.mjcf is None:
            raise refusal("needs kinematics from a URDF or MJCF; put the fixed joint into the rows instead", "locked")
        return self


class PlacementDocument(Document):
    """A fixed rigid displacement x ↦ R x + p."""

    rotation: Rotation
    translation: Vector  # p [m]


class SegmentDocument(Document):
    """One joint of the chain."""

    type: Motion
    before: PlacementDocument
    after: PlacementDocument
    coupling: CouplingDocument | None = None


class PlainKinematicsDocument(KinematicsDocument):
    """The chain of a robot made from plain data: also as placements, which need no file beside it."""

    segments: list[SegmentDocument] | None = Field(default=None, min_length=1, max_length=MOST_JOINTS)


class PlainRobotDocument(RobotDocument):
    """A robot made from plain data."""

    kinematics: PlainKinematicsDocument
