"""A validated document to a Robot."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import cast

import numpy as np

from tauscope.errors import RobotFileError
from tauscope.extras import require_extra
from tauscope.robot.actuator import Actuator
from tauscope.robot.chain import Chain
from tauscope.robot.document import (
    ActuatorDocument,
    DocumentOrigin,
    JointDocument,
    LinkDocument,
    ModelDocument,
    PlacementDocument,
    PlainKinematicsDocument,
    RobotDocument,
    Rows,
    SegmentDocument,
)
from tauscope.robot.kinematics import DenavitHartenbergRow, modified_segments, standard_segments
from tauscope.robot.messages import Finding, Severity, shown
from tauscope.robot.physical import doubt_units, nearest_body, repair_text
from tauscope.robot.recording_layout import RecordingLayout
from tauscope.robot.robot import (
    Coupling,
    FrictionCoefficients,
    FrictionShape,
    Joint,
    JointLimits,
    JointType,
    LinkInertia,
    Model,
    Placement,
    Repair,
    Robot,
    Segment,
    segment_couplings,
)
from tauscope.robot.urdf import read_urdf_chain

ENTRY_POINT_GROUP = "tauscope.mjcf"


# Compiles an MJCF and reads the chain between two of its bodies, as `read_mjcf_chain` does.
MjcfReader = Callable[[bytes, str, Path | None, str | None, str | None, Mapping[str, float]], Chain]


def read_mjcf_chain(
    data: bytes,
    label: str,
    path: Path | None = None,
    base: str | None = None,
    tip: str | None = None,
    locked: Mapping[str, float] | None = None,
) -> Chain:
    """The chain from body `base` to `tip` of an MJCF, by default from root to deepest; `locked`: positions [rad or m].

    Raises RobotFileError without a chain of hinges and slides, MissingExtraError without MuJoCo.
    """
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        with require_extra(f"{label}: reading an MJCF"):
            reader = cast("MjcfReader", entry.load())
        return reader(data, label, path, base, tip, locked or {})
    raise RobotFileError(f"{label}: no reader of MJCF is registered; install tauscope again")


EARTH = np.array([0.0, 0.0, -9.81])  # gravity in the base frame where nothing is stated [m/s²]
REPAIR_REMEDY = "correct the link (inertia is about the link frame's origin, not about the centre of mass)"


@dataclass(frozen=True)
class SourceFile:
    """A file that a document names: its content, its label for messages, and its path where it has one."""

    data: bytes
    label: str
    path: Path | None = None


# Looks up a file by the kind of kinematics and the name that a document gives.
FileSource = Callable[[str, str], SourceFile]


@dataclass(frozen=True)
class _Kinematics:
    """Segments, what a file says beside them, and the place in the document that they come from."""

    segments: tuple[Segment, ...]
    key: str
    chain: Chain | None = None
    path: Path | None = None

    @property
    def joint_types(self) -> tuple[JointType, ...]:
        moved = [each.joint for each in segment_couplings(self.segments)]
        if self.chain is not None:
            return self.chain.joint_types
        return tuple(self.segments[moved.index(joint)].type for joint in range(max(moved) + 1))


def build_robot(document: RobotDocument, origin: DocumentOrigin, file_source: FileSource) -> Robot:
    """The robot of a document, impossible links replaced by the nearest body. Raises RobotFileError."""
    kinematics = _kinematics(document, origin, file_source)
    chain = kinematics.chain
    findings: list[Finding] = [*(chain.findings if chain else ())]
    joints = _joints(document.joints, kinematics, origin)
    model, repairs = _model(document.model, kinematics, origin, findings)
    layout, gravity = document.recording, EARTH if chain is None or chain.gravity is None else chain.gravity
    if document.gravity is not None:
        gravity = np.array(document.gravity)
    robot = Robot(
        name=document.name,
        joints=joints,
        segments=kinematics.segments,
        gravity=gravity,
        model=model,
        urdf=kinematics.path if kinematics.key == "urdf" else None,
        mjcf=kinematics.path if kinematics.key == "mjcf" else None,
        segment_names=chain.segment_names if chain else (),
        link_names=chain.link_names if chain else (),
        branches=chain.branches if chain else (),
        findings=tuple(findings),
        notes=chain.notes if chain else (),
        repairs=repairs,
        recording=RecordingLayout() if layout is None else layout.layout,
    )
    return replace(robot, notes=(*robot.notes, *doubt_units(robot, origin.label)))


def _kinematics(document: RobotDocument, origin: DocumentOrigin, file_source: FileSource) -> _Kinematics:
    kinematics = document.kinematics
    if kinematics.dh is not None:
        return _Kinematics(standard_segments(_rows(kinematics.dh)), "dh")
    if kinematics.mdh is not None:
        return _Kinematics(modified_segments(_rows(kinematics.mdh)), "mdh")
    if (named := kinematics.urdf) is not None:
        file = file_source("urdf", named.file)
        chain = read_urdf_chain(file.data, file.label, named.base, named.tip, document.locked)
        return _Kinematics(chain.segments, "urdf", chain, file.path)
    if (named := kinematics.mjcf) is not None:
        file = file_source("mjcf", named.file)
        chain = read_mjcf_chain(file.data, file.label, file.path, named.base, named.tip, document.locked)
        return _Kinematics(chain.segments, "mjcf", chain, file.path)
    if isinstance(kinematics, PlainKinematicsDocument) and kinematics.segments is not None:
        return _Kinematics(tuple(map(_segment, kinematics.segments)), "segments")
    raise origin.error(("kinematics",), "holds no description of the chain")


def _segment(document: SegmentDocument) -> Segment:
    follows = None if document.coupling is None else Coupling(**document.coupling.model_dump())
    return Segment(document.type, _placement(document.before), _placement(document.after), follows)


def _rows(rows: Rows) -> list[DenavitHartenbergRow]:
    return [DenavitHartenbergRow(**row.model_dump()) for row in rows]


def _placement(document: PlacementDocument) -> Placement:
    return Placement(np.array(document.rotation), np.array(document.translation))


def _joints(documents: list[JointDocument] | None, chain: _Kinematics, origin: DocumentOrigin) -> tuple[Joint, ...]:
    """Joints in chain order; the URDF or MJCF fills gaps of the document."""
    if chain.chain is None:
        types = chain.joint_types
        documents = documents or [JointDocument(name=f"joint{number}") for number in range(1, len(types) + 1)]
        _check_count(origin, ("joints",), len(documents), len(types), chain.key)
        return tuple(_joint(each, kind, JointLimits()) for each, kind in zip(documents, types, strict=True))
    names = chain.chain.joint_names
    for index, document in enumerate(documents or ()):
        if document.name not in names:
            known = ", ".join(map(shown, names))
            text = f"{shown(document.name)} is no moving joint of the chain; its joints are {known}: use one of these"
            raise origin.error(("joints", index, "name"), text)
    stated = {document.name: document for document in documents or ()}
    rows = zip(names, chain.chain.joint_types, chain.chain.limits, chain.chain.actuators, strict=True)
    return tuple(
        _joint(stated.get(name, JointDocument(name=name)), kind, limits, actuator)
        for name, kind, limits, actuator in rows
    )


def _joint(document: JointDocument, kind: JointType, own: JointLimits, actuator: Actuator | None = None) -> Joint:
    """One joint; a limit or actuator of the robot file goes before one of the URDF or MJCF."""
    limits, shape = document.limits, document.friction_shape
    stated = {} if limits is None else limits.model_dump(exclude_none=True)
    if "position" in stated:
        stated["position"] = tuple(stated["position"])
    return Joint(
        name=document.name,
        type=kind,
        limits=replace(own, **stated),
        gear_ratio=document.gear_ratio,
        torque_constant=1.0 if document.torque_constant is None else document.torque_constant,
        has_torque_constant=document.torque_constant is not None,
        sign=1 if document.sign is None else document.sign,
        friction_shape=FrictionShape() if shape is None else FrictionShape(**shape.model_dump()),
        drive=document.drive,
        actuator=actuator if document.actuator is None else _actuator(document.actuator),
    )


def _actuator(document: ActuatorDocument) -> Actuator:
    values = document.model_dump()
    values["kp"] = document.kp or 0.0
    values["unit"] = document.unit or ("Nm_per_rad" if document.servo is None else "register")
    return Actuator(**values)


def _model(
    document: ModelDocument | None, kinematics: _Kinematics, origin: DocumentOrigin, findings: list[Finding]
) -> tuple[Model, tuple[Repair, ...]]:
    """The model block, or if absent the model of the URDF or MJCF; and its repaired links."""
    chain, count = kinematics.chain, len(kinematics.joint_types)
    if document is None or document == ModelDocument():
        return (Model(chain.links, chain.friction, chain.rotor_inertia), chain.repairs) if chain else (Model(), ())
    links, repairs, friction, rotors = None, (), None, None
    if document.links is not None:
        segments = len(kinematics.segments)
        _check_count(origin, ("model", "links"), len(document.links), segments, kinematics.key)
        links, repairs = _links(document.links, origin, findings)
    if document.friction is not None:
        _check_count(origin, ("model", "friction"), len(document.friction), count, kinematics.key)
        friction = tuple(FrictionCoefficients(**each.model_dump()) for each in document.friction)
    if document.rotor_inertia is not None:
        _check_count(origin, ("model", "rotor_inertia"), len(document.rotor_inertia), count, kinematics.key)
        rotors = tuple(document.rotor_inertia)
    return Model(links, friction, rotors), repairs


def _links(
    documents: list[LinkDocument], origin: DocumentOrigin, findings: list[Finding]
) -> tuple[tuple[LinkInertia, ...], tuple[Repair, ...]]:
    links, repairs = [], []
    for index, document in enumerate(documents):
        i = document.inertia
        entries = [i.xx, i.yy, i.zz, i.xy, i.xz, i.yz, document.mass, *document.first_moment]
        stated, place = LinkInertia.from_vector(np.array(entries)), origin.where(("model", "links", index))
        links.append(nearest_body(stated))
        if text := repair_text(stated, links[index]):
            repairs.append(Repair(index, place, text, REPAIR_REMEDY, stated, links[index]))
        elif stated.mass == 0.0 and np.any(stated.inertia):
            findings.append(Finding(Severity.WARNING, place, "has inertia but no mass, as no body has; add the mass"))
    return tuple(links), tuple(repairs)


def _check_count(origin: DocumentOrigin, place: tuple[str, ...], found: int, count: int, key: str) -> None:
    if found != count:
        text = f"number of entries is {found}, of joints in kinematics.{key} {count}; write one entry a joint"
        raise origin.error(place, text)
