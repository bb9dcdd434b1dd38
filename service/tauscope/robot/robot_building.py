"""A validated document to a Robot."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tauscope.robot.denavit_hartenberg import DenavitHartenbergRow, modified_segments, standard_segments
from tauscope.robot.document import (
    JointDocument,
    KinematicsDocument,
    LinkDocument,
    ModelDocument,
    PlacementDocument,
    PlainKinematicsDocument,
    RobotDocument,
    Rows,
    UrdfDocument,
)
from tauscope.robot.document_origin import DocumentOrigin
from tauscope.robot.finding import Finding, Severity
from tauscope.robot.messages import shown
from tauscope.robot.physical import nearest_body, repair_text
from tauscope.robot.recording_layout import RecordingLayout
from tauscope.robot.robot import (
    FrictionCoefficients,
    FrictionShape,
    Joint,
    JointLimits,
    LinkInertia,
    Model,
    Placement,
    Repair,
    Robot,
    Segment,
)
from tauscope.robot.urdf import UrdfChain, read_urdf_chain

REPAIR_REMEDY = "correct the link (inertia is about the link frame's origin, not about the centre of mass)"

UrdfSource = Callable[[str], tuple[bytes, str, Path | None]]
"""Looks up the URDF that a document names: its content, its label for messages, and its path where it has one."""


@dataclass(frozen=True)
class _Chain:
    """Segments, what a URDF says beside them, and the place in the document that they come from."""

    segments: tuple[Segment, ...]
    key: str
    urdf: UrdfChain | None = None
    urdf_path: Path | None = None


def build_robot(document: RobotDocument, origin: DocumentOrigin, urdf_source: UrdfSource) -> Robot:
    """The robot of a document; a link of its model that no body can be is replaced by the nearest body.

    Raises
    ------
    RobotFileError
        if parts of the document do not fit each other, or the URDF is not valid
    """
    chain = _chain(document.kinematics, origin, urdf_source)
    findings: list[Finding] = [*(chain.urdf.findings if chain.urdf else ())]
    joints = _joints(document.joints, chain, origin)
    model, repairs = _model(document.model, chain, origin, findings)
    layout = document.recording
    return Robot(
        name=document.name,
        joints=joints,
        segments=chain.segments,
        gravity=np.array(document.gravity),
        model=model,
        urdf=chain.urdf_path,
        urdf_links=chain.urdf.link_names if chain.urdf else (),
        findings=tuple(findings),
        repairs=repairs,
        recording=RecordingLayout() if layout is None else layout.layout,
    )


def _chain(kinematics: KinematicsDocument, origin: DocumentOrigin, urdf_source: UrdfSource) -> _Chain:
    """Segments of whichever description the document holds."""
    if kinematics.dh is not None:
        return _Chain(standard_segments(_rows(kinematics.dh)), "dh")
    if kinematics.mdh is not None:
        return _Chain(modified_segments(_rows(kinematics.mdh)), "mdh")
    if kinematics.urdf is not None:
        return _urdf_chain(kinematics.urdf, urdf_source)
    if isinstance(kinematics, PlainKinematicsDocument) and kinematics.segments is not None:
        segments = tuple(Segment(s.type, _placement(s.before), _placement(s.after)) for s in kinematics.segments)
        return _Chain(segments, "segments")
    raise origin.error(("kinematics",), "holds no description of the chain")


def _urdf_chain(urdf: UrdfDocument, urdf_source: UrdfSource) -> _Chain:
    """The chain of a URDF."""
    data, label, path = urdf_source(urdf.file)
    chain = read_urdf_chain(data, label, urdf.base, urdf.tip)
    return _Chain(chain.segments, "urdf", chain, path)


def _rows(rows: Rows) -> list[DenavitHartenbergRow]:
    """Rows of the document as rows of the convention."""
    return [DenavitHartenbergRow(r.theta, r.d, r.a, r.alpha, r.type) for r in rows]


def _placement(document: PlacementDocument) -> Placement:
    """A placement as arrays."""
    return Placement(np.array(document.rotation), np.array(document.translation))


def _joints(documents: list[JointDocument] | None, chain: _Chain, origin: DocumentOrigin) -> tuple[Joint, ...]:
    """Joints in chain order, what the document leaves open filled from the URDF."""
    count = len(chain.segments)
    names = chain.urdf.joint_names if chain.urdf else None
    if documents is None:
        default = names or tuple(f"joint{number}" for number in range(1, count + 1))
        documents = [JointDocument(name=name) for name in default]
    _check_count(origin, ("joints",), len(documents), count, chain.key)
    for index, (document, name) in enumerate(zip(documents, names or (), strict=False)):
        if document.name != name:
            text = f"{shown(document.name)} is joint {shown(name)} in the URDF's chain order; use the URDF's name"
            raise origin.error(("joints", index, "name"), text)
    urdf_limits = chain.urdf.limits if chain.urdf else (JointLimits(),) * count
    return tuple(
        _joint(document, segment, limits)
        for document, segment, limits in zip(documents, chain.segments, urdf_limits, strict=True)
    )


def _joint(document: JointDocument, segment: Segment, urdf_limits: JointLimits) -> Joint:
    """One joint; a limit of the robot file goes before the URDF's."""
    limits, shape = document.limits, document.friction_shape
    position = tuple(limits.position) if limits and limits.position else urdf_limits.position
    return Joint(
        name=document.name,
        type=segment.type,
        limits=JointLimits(
            position=None if position is None else (position[0], position[1]),
            velocity=(limits and limits.velocity) or urdf_limits.velocity,
            acceleration=(limits and limits.acceleration) or urdf_limits.acceleration,
            torque=(limits and limits.torque) or urdf_limits.torque,
        ),
        gear_ratio=document.gear_ratio,
        torque_constant=1.0 if document.torque_constant is None else document.torque_constant,
        has_torque_constant=document.torque_constant is not None,
        sign=1 if document.sign is None else document.sign,
        friction_shape=FrictionShape() if shape is None else FrictionShape(shape.k_v, shape.delta),
        drive=document.drive,
    )


def _model(
    document: ModelDocument | None, chain: _Chain, origin: DocumentOrigin, findings: list[Finding]
) -> tuple[Model, tuple[Repair, ...]]:
    """The model block, or where it is absent what the URDF says; and which of its links were repaired."""
    if document is None:
        return (Model(chain.urdf.links, chain.urdf.friction), chain.urdf.repairs) if chain.urdf else (Model(), ())
    links, repairs, friction = None, (), None
    if document.links is not None:
        _check_count(origin, ("model", "links"), len(document.links), len(chain.segments), chain.key)
        links, repairs = _links(document.links, origin, findings)
    if document.friction is not None:
        _check_count(origin, ("model", "friction"), len(document.friction), len(chain.segments), chain.key)
        friction = tuple(FrictionCoefficients(f.stiction, f.stribeck, f.viscous) for f in document.friction)
    return Model(links, friction), repairs


def _links(
    documents: list[LinkDocument], origin: DocumentOrigin, findings: list[Finding]
) -> tuple[tuple[LinkInertia, ...], tuple[Repair, ...]]:
    """Links of the model block as bodies, and which of them were none."""
    links, repairs = [], []
    for index, document in enumerate(documents):
        stated, place = _link(document), origin.where(("model", "links", index))
        links.append(nearest_body(stated))
        if text := repair_text(stated, links[index]):
            repairs.append(Repair(index, place, text, REPAIR_REMEDY, stated, links[index]))
        elif stated.mass == 0.0 and np.any(stated.inertia):
            findings.append(Finding(Severity.WARNING, place, "has inertia but no mass, as no body has; add the mass"))
    return tuple(links), tuple(repairs)


def _link(document: LinkDocument) -> LinkInertia:
    """A link of the model block."""
    i = document.inertia
    inertia = np.array([[i.xx, i.xy, i.xz], [i.xy, i.yy, i.yz], [i.xz, i.yz, i.zz]])
    return LinkInertia(document.mass, np.array(document.first_moment), inertia)


def _check_count(origin: DocumentOrigin, place: tuple[str, ...], found: int, count: int, key: str) -> None:
    """One entry a joint."""
    if found != count:
        text = f"number of entries is {found}, of joints in kinematics.{key} {count}; write one entry a joint"
        raise origin.error(place, text)
