"""What the arm is: an open chain of joints, and what the user's simulation believes about its links."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field

from tauscope.result_warning import ResultWarning
from tauscope.robot.actuator import Actuator
from tauscope.robot.messages import Finding
from tauscope.robot.recording_layout import RecordingLayout

Array = NDArray[np.float64]

# Names of a link's ten standard parameters, in the order of the seed paper's equation (3).
STANDARD_PARAMETERS = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "m", "msx", "msy", "msz")


class JointType(StrEnum):
    """How a joint moves along or about its axis."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"

    @property
    def unit(self) -> str:
        """Unit of its position."""
        return "m" if self is JointType.PRISMATIC else "rad"

    @property
    def torque_unit(self) -> str:
        """Unit of what drives it."""
        return "N" if self is JointType.PRISMATIC else "Nm"


@dataclass(frozen=True)
class JointLimits:
    """What a joint may do; None where nothing is stated."""

    __pydantic_config__ = ConfigDict(extra="forbid", json_schema_serialization_defaults_required=True)  # in answers
    position: Annotated[tuple[float, float] | None, Field(description="lowest and highest position [rad or m]")] = None
    velocity: Annotated[float | None, Field(description="largest speed [rad/s or m/s]")] = None
    acceleration: Annotated[float | None, Field(description="largest acceleration [rad/s² or m/s²]")] = None
    torque: Annotated[float | None, Field(description="largest torque [Nm] or force [N]")] = None


@dataclass(frozen=True)
class FrictionShape:
    """Shape constants of the friction curve (7), (8); None where the data shall tell."""

    k_v: float | None = None  # steepness K_v of the sign's smooth stand-in, equation (8) [s/rad or s/m]
    delta: float | None = None  # steepness δ of the Stribeck part, equation (7) [s/rad or s/m]


@dataclass(frozen=True)
class Joint:
    """One joint: its name, its limits and what turns a recorded drive signal into joint torque."""

    name: str
    type: JointType = JointType.REVOLUTE
    limits: JointLimits = JointLimits()
    gear_ratio: float | None = None  # motor turns per joint turn; None where not stated
    torque_constant: float = 1.0
    sign: int = 1
    friction_shape: FrictionShape = FrictionShape()
    drive: Mapping[str, Any] | None = None
    has_torque_constant: bool = False  # whether the robot file states the constant; 1 stands where it does not
    actuator: Actuator | None = None  # of the robot file, else of the user's MJCF


@dataclass(frozen=True, eq=False)
class Placement:
    """A fixed rigid displacement x ↦ R x + p."""

    rotation: Array = field(default_factory=lambda: np.eye(3))  # (3, 3), R, orthonormal, right-handed
    translation: Array = field(default_factory=lambda: np.zeros(3))  # (3,), p [m]


@dataclass(frozen=True)
class Coupling:
    """A segment that follows a joint: its own position is multiplier · q_joint + offset."""

    joint: int  # index of the joint, from 0
    multiplier: float = 1.0  # turn or slide of the segment per turn or slide of the joint
    offset: float = 0.0  # position of the segment at q_joint = 0 [rad or m]


@dataclass(frozen=True, eq=False)
class Segment:
    """One motion of the chain: link frame j seen from link frame j-1 is ``before · motion_z(q_j) · after``.

    The joint turns about, or slides along, the z axis between the two placements. Standard DH puts a and α into
    `after`, modified DH into `before`; a URDF puts the axis' orientation into both, so that the link frame stays the
    URDF's own.
    """

    type: JointType
    before: Placement
    after: Placement
    coupling: Coupling | None = None  # None where the segment is the next joint's own


def segment_couplings(segments: Iterable[Segment]) -> tuple[Coupling, ...]:
    """The joint that moves each segment: its own, which is the next one, or the one that it follows."""
    found: list[Coupling] = []
    for segment in segments:
        following = max((each.joint for each in found), default=-1) + 1
        found.append(segment.coupling or Coupling(following))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class LinkInertia:
    """Inertial parameters of one link, in its link frame."""

    mass: float  # m [kg]
    first_moment: Array  # (3,), m s [kg m]
    inertia: Array  # (3, 3), about the link frame's origin, the paper's equation (5) [kg m²]

    def to_vector(self) -> Array:
        """The ten standard parameters in the order of `STANDARD_PARAMETERS`, shape (10,)."""
        i = self.inertia
        return np.array([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2], self.mass, *self.first_moment])

    @staticmethod
    def from_vector(vector: Array) -> "LinkInertia":
        """The link of ten standard parameters. `vector`: (10,), in the order of `STANDARD_PARAMETERS`."""
        xx, yy, zz, xy, xz, yz, mass, *first_moment = (float(value) for value in vector)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return LinkInertia(mass, np.array(first_moment), inertia)


@dataclass(frozen=True, eq=False)
class Repair:
    """Stated parameters that no body has, of a link from 0; `before`, `after` the nearest body, in its frame."""

    link: int
    place: str
    text: str
    remedy: str
    before: LinkInertia
    after: LinkInertia


@dataclass(frozen=True)
class FrictionCoefficients:
    """Friction of one joint, the seed paper's equation (7)."""

    stiction: float = 0.0  # τ_s [Nm or N]
    stribeck: float = 0.0  # τ_sc, the Coulomb level less the stiction [Nm or N]
    viscous: float = 0.0  # τ_v [Nm s/rad or N s/m]


@dataclass(frozen=True)
class Model:
    """What the user's simulation believes; None where the robot file says nothing."""

    links: tuple[LinkInertia, ...] | None = None  # one a segment
    friction: tuple[FrictionCoefficients, ...] | None = None  # one a joint
    rotor_inertia: tuple[float, ...] | None = None  # reflected to the joint, one a joint [kg m² or kg]


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot arm as its robot file describes it."""

    name: str
    joints: tuple[Joint, ...]  # base first
    segments: tuple[Segment, ...]  # base first; one a joint, and one for each joint that follows another
    # (3,), acceleration in the base frame [m/s²]
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    model: Model = Model()
    source: Path | None = None
    urdf: Path | None = None
    mjcf: Path | None = None
    segment_names: tuple[str, ...] = ()  # of the URDF's or MJCF's joint that each segment is; empty without such a file
    link_names: tuple[tuple[str, ...], ...] = ()  # links of that file that make up each link
    branches: tuple[LinkInertia, ...] = ()  # the part of each link that an export leaves where the file has it
    findings: tuple[Finding, ...] = ()
    notes: tuple[ResultWarning, ...] = ()
    repairs: tuple[Repair, ...] = ()
    recording: RecordingLayout = field(default_factory=RecordingLayout)

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.joints)

    @property
    def actuators(self) -> tuple[Actuator | None, ...]:
        """The drives, base first; None where nothing is stated."""
        return tuple(joint.actuator for joint in self.joints)

    def with_actuators(self, actuators: Iterable[Actuator | None]) -> "Robot":
        """The arm with other drives, one a joint."""
        pairs = zip(self.joints, actuators, strict=True)
        return replace(self, joints=tuple(replace(joint, actuator=each) for joint, each in pairs))

    @property
    def files(self) -> tuple[tuple[str, Path], ...]:
        """Role and path of the files that describe the robot, each once."""
        roles = (("robot", self.source), ("urdf", self.urdf), ("mjcf", self.mjcf))
        paths = {path: role for role, path in reversed(roles) if path is not None}
        return tuple((role, path) for path, role in reversed(paths.items()))

    @property
    def link_count(self) -> int:
        """Number of moving links, one a segment."""
        return len(self.segments)

    @property
    def couplings(self) -> tuple[Coupling, ...]:
        """The joint that moves each segment, and how."""
        return segment_couplings(self.segments)

    @property
    def own_links(self) -> tuple[int, ...]:
        """Index of the link that moves as each joint does, or of the first one that follows it."""
        links = {coupling.joint: link for link, coupling in reversed([*enumerate(self.couplings)])}
        for link, coupling in reversed([*enumerate(self.couplings)]):
            if (coupling.multiplier, coupling.offset) == (1.0, 0.0):
                links[coupling.joint] = link
        return tuple(links[joint] for joint in range(self.joint_count))

    @property
    def ratios(self) -> Array:
        """Motion of each segment per unit of each joint, (links, joints)."""
        matrix = np.zeros((self.link_count, self.joint_count))
        for link, coupling in enumerate(self.couplings):
            matrix[link, coupling.joint] = coupling.multiplier
        return matrix

    @property
    def segment_labels(self) -> tuple[str, ...]:
        """A name for each segment: its joint, or the joint of the file that follows."""
        if self.segment_names:
            return self.segment_names
        own = self.own_links
        names = (self.joint_of_link(link).name for link in range(self.link_count))
        return tuple(name if link in own else f"{name} at link {link + 1}" for link, name in enumerate(names))

    def joint_of_link(self, link: int) -> Joint:
        """The joint that moves a link. `link`: index of the link, from 0."""
        return self.joints[self.couplings[link].joint]

    @property
    def first_links(self) -> tuple[int, ...]:
        """Index of the first link that each joint moves."""
        moved = [each.joint for each in self.couplings]
        return tuple(moved.index(joint) for joint in range(self.joint_count))

    @property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """Notes on the description, and one for each inertial that no body has, with the numbers before and after."""
        repaired = (
            ResultWarning(
                code="repaired-inertial",
                joint=self.joint_of_link(repair.link).name,
                text=f"{repair.place}: {repair.text}",
                remedy=repair.remedy,
            )
            for repair in self.repairs
        )
        return (*self.notes, *repaired)
