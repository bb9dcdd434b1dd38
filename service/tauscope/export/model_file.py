"""A model with everything that exports need, as a file: schema tauscope.model/1 with the block ``arm``."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from tauscope.diagnosis.extended_model import (
    LARGEST_FILE,
    EffectEntry,
    ModelDocument,
    NamedValue,
    list_friction,
    restore_model,
)
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.errors import ExportError, IdentificationError, RobotFileError
from tauscope.export.compensation.model import RecordingSource
from tauscope.export.model import ExportModel, Origin, of_extended_model
from tauscope.identification import Identification
from tauscope.recording import EffortKind
from tauscope.robot import LinkInertia, Robot, robot_from_dict, robot_to_dict
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.strict_model import ResultModel


class ArmEntry(ResultModel):
    """The arm that a model is of, without files beside it."""

    robot: dict[str, Any] = Field(description="as robot_to_dict writes it")
    segments: list[str] = Field(description="joints of the URDF or MJCF, one a segment")
    branches: list[list[float]] = Field(description="bodies on joints beside the chain: ten standard parameters a link")
    urdf: str | None = Field(description="the URDF, one character a byte; null where there is none")
    is_mjcf: bool = Field(description="whether the links' frames are bodies of an MJCF")
    effort: str = Field(description="torque or current")
    recordings: list[list[str]] = Field(description="name and sha256 of the recordings that the model is made from")
    created: str = Field(description="when, ISO 8601")
    version: str = Field(description="of Tauscope")


class ModelFile(ModelDocument):
    """An extended model and its arm."""

    arm: ArmEntry | None = Field(default=None, description="null in files of older versions")
    plain: ModelDocument | None = Field(
        default=None, description="the model that the same recordings give without findings; null where it is this one"
    )


def model_file(document: ModelDocument, robot: Robot, origin: Origin, plain: ModelDocument | None = None) -> ModelFile:
    """A model's document with its arm, and beside it the model without findings where that is another."""
    arm = ArmEntry(
        robot=robot_to_dict(robot),
        segments=list(robot.segment_names),
        branches=[link.to_vector().tolist() for link in robot.branches],
        urdf=None if origin.urdf is None else origin.urdf.decode("latin-1"),
        is_mjcf=origin.is_mjcf,
        effort=origin.effort_kind.value,
        recordings=[[source.name, source.sha256] for source in origin.sources],
        created=origin.created.isoformat(),
        version=origin.version,
    )
    return ModelFile.model_construct(
        **{name: getattr(document, name) for name in ModelDocument.model_fields}, arm=arm, plain=plain
    )


def identified_document(result: Identification) -> ModelDocument:
    """The delivered model of an identification, without findings."""
    structure, names = result.structure, [joint.name for joint in result.robot.joints]
    values = dict(zip(structure.names, map(float, result.consistent_parameters), strict=True))
    nominal = [place for place, name in enumerate(structure.names) if not name.startswith("rotor_inertia ")]
    return ModelDocument(
        robot=result.robot.name,
        joints=names,
        base_parameters=[NamedValue(name=name, value=values[name]) for name in structure.base.expressions],
        links=[link.to_vector().tolist() for link in result.consistent.links],
        friction=list_friction(structure, values),
        effects=[
            EffectEntry(
                effect=RotorInertia.id,
                form=RotorInertia.__name__,
                joint=name,
                equation=RotorInertia.equation,
                settings={},
                shapes=[],
                bounds=[],
                coefficients=[NamedValue(name="I_a", value=values[f"rotor_inertia {name}"])],
            )
            for name in names
            if f"rotor_inertia {name}" in values
        ],
        covariance=np.asarray(result.covariance)[np.ix_(nominal, nominal)].tolist(),
    )


def read_model_file(path: Path) -> ModelFile:
    """The document of a file. Raises IdentificationError naming the file and the key."""
    text = decode_utf8(read_bounded(path, LARGEST_FILE), str(path))
    try:
        return ModelFile.model_validate_json(text)
    except ValidationError as error:
        fault = error.errors(include_url=False, include_context=False)[0]
        key = ".".join(str(part) for part in fault["loc"]) or "the document"
        hint = "give a file that identify or diagnose wrote with --model"
        raise IdentificationError(f"{path}: {key}: {fault['msg']}; {hint}") from None


def read_extended_model(path: Path, robot: Robot) -> ExtendedModel:
    """A file's extended model of the arm at hand. Raises IdentificationError, which names file and key."""
    try:
        return restore_model(read_model_file(path), robot)
    except IdentificationError as error:
        text = str(error)
        raise IdentificationError(text if text.startswith(str(path)) else f"{path}: {text}") from None


def read_export_model(path: Path) -> ExportModel:
    """A file's model with its findings. Raises ExportError without an arm, IdentificationError with its key."""
    return read_export_models(path)[-1]


def read_export_models(path: Path) -> tuple[ExportModel, ...]:
    """A file's model without findings, where it has that, and with them; raises as `read_export_model`."""
    document = read_model_file(path)
    arm = document.arm
    if arm is None:
        text = "the file has no block arm: it was written by an older version; write it again with --model"
        raise ExportError(f"{path}: {text}")
    urdf = None if arm.urdf is None else arm.urdf.encode("latin-1", errors="replace")
    models = []
    try:
        robot = _robot(arm)
        created = datetime.fromisoformat(arm.created)
        sources = tuple(RecordingSource(name, digest) for name, digest in arm.recordings)
        origin = Origin(sources, EffortKind(arm.effort), created, urdf, arm.is_mjcf, arm.version)
        for each in (document.plain, document):
            if each is not None:
                links = [LinkInertia.from_vector(np.array(link)) for link in each.links]
                models.append(of_extended_model(restore_model(each, robot), links, origin))
    except (IdentificationError, RobotFileError, ValueError, TypeError) as error:
        raise IdentificationError(f"{path}: {error}") from None
    return tuple(models)


def _robot(arm: ArmEntry) -> Robot:
    robot = robot_from_dict(arm.robot, "arm.robot")
    branches = tuple(LinkInertia.from_vector(np.array(link)) for link in arm.branches)
    return replace(robot, segment_names=tuple(arm.segments), branches=branches)
