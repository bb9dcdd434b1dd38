"""The identified model in every format that controllers and simulators take, or why it cannot be had in one."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from tauscope.errors import ExportError
from tauscope.export.actuators import ActuatorChoice
from tauscope.export.compensation.model import to_json, to_yaml
from tauscope.export.extended_compensation import source_code
from tauscope.export.mjcf import to_mjcf
from tauscope.export.mjcf_findings import effects_in
from tauscope.export.model import ExportModel
from tauscope.export.urdf import patch_urdf


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


# Exports of an identified model.
EXPORT_FILES: Mapping[ExportFormat, ExportFile] = {
    ExportFormat.JSON: ExportFile("friction.json", "application/json"),
    ExportFormat.YAML: ExportFile("friction.yaml", "application/yaml"),
    ExportFormat.C: ExportFile("friction.h", "text/x-c"),
    ExportFormat.PYTHON: ExportFile("friction.py", "text/x-python"),
    ExportFormat.URDF: ExportFile("model.urdf", "application/xml"),
    ExportFormat.MJCF: ExportFile("model.xml", "application/xml"),
}

# Exports of a model with the findings of a diagnosis.
CODE_FILES: Mapping[ExportFormat, ExportFile] = {
    ExportFormat.C: ExportFile("compensation.h", "text/x-c"),
    ExportFormat.PYTHON: ExportFile("compensation.py", "text/x-python"),
}

# Formats by the suffix of a file.
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


def make_export(export_format: ExportFormat, model: ExportModel, choice: ActuatorChoice | None = None) -> bytes:
    """An export's content: for controllers delivered friction, for simulators consistent links. Raises ExportError."""
    match export_format:
        case ExportFormat.JSON:
            return to_json(model.compensation, effect_entries(model)).encode()
        case ExportFormat.YAML:
            return to_yaml(model.compensation, effect_entries(model)).encode()
        case ExportFormat.C | ExportFormat.PYTHON:
            return source_code(model, ".h" if export_format is ExportFormat.C else ".py").encode()
        case ExportFormat.URDF:
            if model.origin.urdf is None:
                text = "its chain does not come from a URDF; export an MJCF (.xml) instead"
                raise ExportError(f"robot {model.robot.name}: {text}")
            notes = effects_in(model, (), "a URDF has no such element")
            return patch_urdf(model.origin.urdf, model.joint_models, notes).data
        case ExportFormat.MJCF:
            return to_mjcf(model, choice or ActuatorChoice()).text.encode()


def effect_entries(model: ExportModel) -> list[dict[str, Any]]:
    """Findings as plain data."""
    names = [joint.name for joint in model.robot.joints]
    return [
        {
            "effect": found.effect.id,
            "joint": None if found.effect.joint is None else names[found.effect.joint],
            "equation": found.effect.equation,
            "parameters": found.values,
        }
        for found in model.effects
    ]
