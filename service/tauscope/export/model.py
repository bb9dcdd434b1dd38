"""The input of every export: an identified model, and the findings of a diagnosis if there was one."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis import Diagnosis
from tauscope.diagnosis.extended_model import consistent_links
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.effects import Effect
from tauscope.export.compensation.model import (
    CompensationModel,
    JointCompensation,
    JointFriction,
    RecordingSource,
    drive_units,
)
from tauscope.export.joint_model import JointModel, joint_models
from tauscope.identification import Identification
from tauscope.identification.friction_shape import EstimatedShape
from tauscope.identification.structure import JointTerms, ModelStructure
from tauscope.recording import EffortKind
from tauscope.robot import LinkInertia, Robot
from tauscope.version import tauscope_version


@dataclass(frozen=True, eq=False)
class FoundEffect:
    """An effect with its values, in the arm's own torque."""

    effect: Effect
    coefficients: NDArray[np.float64]  # (c,), linear coefficients
    shape: NDArray[np.float64]  # (k,), shape parameters

    @property
    def values(self) -> dict[str, float]:
        """Coefficients and shape parameters by name."""
        named = (*self.effect.coefficients, *self.effect.shapes)
        pairs = zip(named, (*self.coefficients, *self.shape), strict=True)
        return {each.name: float(value) for each, value in pairs}


@dataclass(frozen=True)
class Origin:
    """Where a model came from."""

    sources: tuple[RecordingSource, ...]
    effort_kind: EffortKind
    created: datetime
    urdf: bytes | None = None
    is_mjcf: bool = False  # whether the links' frames are bodies of an MJCF
    version: str = field(default_factory=tauscope_version)


@dataclass(frozen=True, eq=False)
class ExportModel:
    """Bodies that can exist, one a segment, friction beside them and as delivered, one a joint, and findings."""

    robot: Robot
    links: tuple[LinkInertia, ...]
    friction: tuple[JointFriction, ...]
    delivered_friction: tuple[JointFriction, ...]
    rotor_inertia: tuple[float | None, ...]  # one a joint [kg m² or kg]
    effects: tuple[FoundEffect, ...]
    origin: Origin

    @property
    def joint_models(self) -> dict[str, JointModel]:
        """Links, friction and rotors by the labels of the segments, for simulators."""
        return joint_models(self.robot, self.links, self.friction, self.rotor_inertia)

    @property
    def compensation(self) -> CompensationModel:
        """Friction as delivered, for controllers. Raises ExportError for coefficients or units without meaning."""
        joints = tuple(
            JointCompensation(joint.name, joint.type, friction, drive_units(joint, self.origin.effort_kind))
            for joint, friction in zip(self.robot.joints, self.delivered_friction, strict=True)
        )
        origin = self.origin
        return CompensationModel(self.robot.name, joints, origin.created, origin.sources, origin.version)


def of_identification(identification: Identification, origin: Origin) -> ExportModel:
    """The model that an identification delivers; simulators get the friction that fits its bodies."""
    robot, structure, parameters = identification.robot, identification.structure, identification.consistent_parameters
    rotors: list[float | None] = [None] * robot.joint_count
    for joint, column in structure.coefficients("rotor_inertia").items():
        rotors[joint] = float(parameters[column])
    delivered = _frictions(structure, identification.parameters, identification.shapes)
    friction, links = _frictions(structure, parameters, identification.shapes), tuple(identification.consistent.links)
    return ExportModel(robot, links, friction, delivered, tuple(rotors), (), origin)


def of_diagnosis(diagnosis: Diagnosis, origin: Origin) -> ExportModel:
    """The final model of a diagnosis, findings included."""
    return of_extended_model(diagnosis.selection.fit.model, consistent_links(diagnosis), origin)


def of_extended_model(model: ExtendedModel, links: Sequence[LinkInertia], origin: Origin) -> ExportModel:
    """An extended model beside bodies that can exist."""
    robot, structure = model.structure.robot, model.structure
    friction = _frictions(structure, model.parameters, structure.terms)
    found = tuple(FoundEffect(t.effect, on_the_arm(model, t).coefficients, t.shape) for t in model.terms)
    rotors: list[float | None] = [None] * robot.joint_count
    for each in found:
        if each.effect.id == "rotor_inertia" and each.effect.joint is not None:
            rotors[each.effect.joint] = max(0.0, float(each.coefficients[0]))
    return ExportModel(robot, tuple(links), friction, friction, tuple(rotors), found, origin)


def _frictions(
    structure: ModelStructure, parameters: NDArray[np.float64], shapes: Sequence[EstimatedShape | JointTerms]
) -> tuple[JointFriction, ...]:
    frictions = []
    for joint, shape in enumerate(shapes):
        places = {name: structure.coefficient(joint, name) for name in ("stiction", "stribeck", "viscous", "offset")}
        values = {name: 0.0 if at is None else float(parameters[at]) for name, at in places.items()}
        delta = None if shape.delta is None else float(shape.delta)
        frictions.append(JointFriction(**values, k_v=float(shape.k_v), delta=delta))
    return tuple(frictions)
