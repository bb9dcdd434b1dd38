"""The identified model in every format that controllers and simulators take, or why it cannot be had in one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

import numpy as np

from tauscope.errors import ExportError
from tauscope.export import JointModel, joint_models, patch_urdf, to_mjcf
from tauscope.export.compensation import (
    CompensationModel,
    JointCompensation,
    JointFriction,
    RecordingSource,
    drive_units,
    to_c_header,
    to_json,
    to_python,
    to_yaml,
)
from tauscope.identification import Identification
from tauscope.recording import EffortKind
from tauscope.version import tauscope_version


class ExportFormat(StrEnum):
    """What a model can be written as: friction compensation (the first four), or a simulator's model."""

    JSON = "json"
    YAML = "yaml"
    C = "c"
    PYTHON = "python"
    URDF = "urdf"
    MJCF = "mjcf"


@dataclass(frozen=True)
class ExportFile:
    """How an export is kept and sent."""

    name: str
    media_type: str

    @property
    def output(self) -> str:
        """Name among the outputs of a task."""
        return f"exports/{self.name}"


EXPORT_FILES: Mapping[ExportFormat, ExportFile] = {
    ExportFormat.JSON: ExportFile("friction.json", "application/json"),
    ExportFormat.YAML: ExportFile("friction.yaml", "application/yaml"),
    ExportFormat.C: ExportFile("friction.h", "text/x-c"),
    ExportFormat.PYTHON: ExportFile("friction.py", "text/x-python"),
    ExportFormat.URDF: ExportFile("model.urdf", "application/xml"),
    ExportFormat.MJCF: ExportFile("model.xml", "application/xml"),
}
"""Exports of an identified model."""

CODE_FILES: Mapping[ExportFormat, ExportFile] = {
    ExportFormat.C: ExportFile("compensation.h", "text/x-c"),
    ExportFormat.PYTHON: ExportFile("compensation.py", "text/x-python"),
}
"""Exports of a model with the findings of a diagnosis."""

SUFFIXES = {
    ".json": ExportFormat.JSON,
    ".yaml": ExportFormat.YAML,
    ".yml": ExportFormat.YAML,
    ".h": ExportFormat.C,
    ".py": ExportFormat.PYTHON,
    ".urdf": ExportFormat.URDF,
    ".xml": ExportFormat.MJCF,
    ".mjcf": ExportFormat.MJCF,
}
"""Formats by the suffix of a file."""


@dataclass(frozen=True, eq=False)
class ExportInput:
    """What exports are made from."""

    identification: Identification
    sources: Sequence[RecordingSource]
    effort_kind: EffortKind
    urdf: bytes | None
    created: datetime


def make_export(export_format: ExportFormat, given: ExportInput) -> bytes:
    """The content of an export.

    Controllers get the delivered friction; simulators the physically consistent links with the friction that fits them.

    Raises
    ------
    ExportError
        if the format cannot hold this model
    """
    match export_format:
        case ExportFormat.JSON:
            return to_json(compensation_model(given)).encode()
        case ExportFormat.YAML:
            return to_yaml(compensation_model(given)).encode()
        case ExportFormat.C:
            return to_c_header(compensation_model(given)).encode()
        case ExportFormat.PYTHON:
            return to_python(compensation_model(given)).encode()
        case ExportFormat.URDF:
            if given.urdf is None:
                name = given.identification.robot.name
                raise ExportError(f"robot {name}: its chain does not come from a URDF; take the export mjcf instead")
            return patch_urdf(given.urdf, simulator_models(given.identification)).data
        case ExportFormat.MJCF:
            return to_mjcf(given.identification.robot, simulator_models(given.identification)).text.encode()


def compensation_model(given: ExportInput) -> CompensationModel:
    """Friction compensation of an identified robot.

    Raises
    ------
    ExportError
        if a coefficient is not usable, or the drive's units contradict each other
    """
    identification = given.identification
    frictions = joint_frictions(identification, identification.parameters)
    joints = tuple(
        JointCompensation(joint.name, joint.type, friction, drive_units(joint, given.effort_kind))
        for joint, friction in zip(identification.robot.joints, frictions, strict=True)
    )
    name = identification.robot.name
    return CompensationModel(name, joints, given.created, tuple(given.sources), tauscope_version())


def simulator_models(identification: Identification) -> dict[str, JointModel]:
    """Physically consistent links, friction and rotors by joint name."""
    parameters = identification.consistent_parameters
    robot = identification.robot
    rotors = [_coefficient(identification, parameters, joint, "rotor_inertia") for joint in range(robot.joint_count)]
    frictions = joint_frictions(identification, parameters)
    return joint_models(robot, identification.consistent.links, frictions, rotors)


def joint_frictions(identification: Identification, parameters: np.ndarray) -> list[JointFriction]:
    """Friction of each joint; terms that the model lacks are zero.

    Parameters
    ----------
    parameters : (p,) float64
        of the model's columns
    """
    frictions = []
    for joint, shape in enumerate(identification.shapes):
        names = ("stiction", "stribeck", "viscous", "offset")
        values = {name: _coefficient(identification, parameters, joint, name) or 0.0 for name in names}
        frictions.append(JointFriction(**values, k_v=shape.k_v, delta=shape.delta))
    return frictions


def _coefficient(identification: Identification, parameters: np.ndarray, joint: int, name: str) -> float | None:
    """One coefficient of a joint; None where the model lacks it."""
    column = identification.structure.coefficient(joint, name)
    return None if column is None else float(parameters[column])
