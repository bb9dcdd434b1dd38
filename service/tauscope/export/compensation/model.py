"""What friction compensation is made of: coefficients, drive units, and where they came from; as JSON and YAML."""

import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.representer import SafeRepresenter

from tauscope.errors import ExportError
from tauscope.recording import EffortKind
from tauscope.robot import Joint, JointType
from tauscope.robot.messages import shown

_RATED_TORQUE = "rated_torque_nm"


@dataclass(frozen=True)
class DriveUnits:
    """Joint torque [Nm or N] of one mA, and of one ‰ of rated torque, signs included; None where not known."""

    torque_per_milliampere: float | None = None
    torque_per_permille: float | None = None
    remarks: tuple[str, ...] = ()


UNKNOWN_UNITS = DriveUnits()  # nothing is known of the drive


def drive_units(joint: Joint, effort_kind: EffortKind) -> DriveUnits:
    """Drive units of a joint from its robot file entry and from what the recording holds.

    Current is known where the recording holds current (ampere): `torque_constant` is then Nm per A. Per mille of rated
    torque is known where the joint's drive block states ``rated_torque_nm``, the rated torque at the motor shaft as in
    CiA 402 object 0x6076: joint torque = ‰ / 1000 · rated torque · |gear ratio|. Directions are the joint's `sign`.
    Raises ExportError if the torque constant is zero, or the rated torque or the gear ratio is not a usable number.
    """
    milliampere, current_remark = _milliampere(joint, effort_kind)
    permille, torque_remark = _permille(joint)
    return DriveUnits(milliampere, permille, (current_remark, torque_remark))


def _milliampere(joint: Joint, effort_kind: EffortKind) -> tuple[float | None, str]:
    if effort_kind is not EffortKind.CURRENT:
        return None, "mA not known: the recording holds torque, so no torque constant in Nm per A was used"
    constant = joint.torque_constant
    if not math.isfinite(constant) or constant == 0.0:
        text = f"joint {shown(joint.name)}: torque_constant = {constant:g} must be finite and not zero"
        raise ExportError(f"{text}; correct the robot file")
    force = joint.type.torque_unit
    remark = f"mA: torque_constant {constant!r} {force}/A, sign {joint.sign:+d}"
    if constant == 1.0:
        remark += f"; if the robot file gives no torque_constant, all torques here are in A, not in {force}"
    return joint.sign * constant / 1000.0, remark


def _permille(joint: Joint) -> tuple[float | None, str]:
    rated = (joint.drive or {}).get(_RATED_TORQUE)
    if rated is None:
        return None, f"per mille of rated torque not known: the robot file states no drive.{_RATED_TORQUE}"
    if joint.type is JointType.PRISMATIC:
        return None, "per mille of rated torque not known: the travel per motor turn of a prismatic joint is not stated"
    rated = _positive(joint, f"drive.{_RATED_TORQUE}", rated)
    if joint.gear_ratio is None:
        remark = f"per mille of rated torque: {rated!r} Nm, taken at the joint because no gear_ratio is stated"
        return joint.sign * rated / 1000.0, f"{remark}, sign {joint.sign:+d}"
    ratio = _positive(joint, "gear_ratio", abs(joint.gear_ratio))
    remark = f"per mille of rated torque: {rated!r} Nm at the motor, gear_ratio {ratio!r}, sign {joint.sign:+d}"
    return joint.sign * rated * ratio / 1000.0, remark


def _positive(joint: Joint, name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0.0:
        text = f"joint {shown(joint.name)}: {name} = {shown(value)} must be a positive number; correct the robot file"
        raise ExportError(text)
    return float(value)


# Equations (7) and (8) of the seed paper, with the constant offset that real drives have.
EQUATION = "tau = stiction*(2/pi)*atan(k_v*v) + stribeck*(2/pi)*atan(delta*v) + viscous*v + offset"


@dataclass(frozen=True)
class JointFriction:
    """Friction (7), (8) of one joint and its constant; τ_s + τ_sc is the Coulomb level at speed [Nm or N]."""

    stiction: float
    stribeck: float
    viscous: float  # τ_v [Nm s/rad or N s/m]
    offset: float  # constant torque [Nm or N]
    k_v: float  # K_v, slope of the smooth sign [s/rad or s/m]
    delta: float | None = None  # δ, shape of the Stribeck effect [s/rad or s/m]; None where the joint has none


@dataclass(frozen=True)
class JointCompensation:
    """One joint of a compensation model."""

    name: str
    type: JointType  # revolute (rad, Nm) or prismatic (m, N)
    friction: JointFriction
    units: DriveUnits = UNKNOWN_UNITS


@dataclass(frozen=True)
class RecordingSource:
    """A recording that the coefficients were estimated from: its name, and the sha256 of its bytes in hexadecimal."""

    name: str
    sha256: str


@dataclass(frozen=True)
class CompensationModel:
    """Friction compensation of a robot, with its provenance."""

    robot: str
    joints: tuple[JointCompensation, ...]
    created: date
    recordings: tuple[RecordingSource, ...]
    version: str

    def __post_init__(self) -> None:
        """Refuse what no file could hold or no controller use."""
        if not self.joints:
            raise ExportError("the compensation model has no joints; identify the robot first")
        for joint in self.joints:
            check_friction(joint.name, joint.friction)


def check_friction(joint: str, friction: JointFriction) -> None:
    """Raise ExportError, which names joint and coefficient, for one that is not finite or has no meaning."""
    for name in ("stiction", "stribeck", "viscous", "offset", "k_v"):
        if not math.isfinite(getattr(friction, name)):
            raise ExportError(f"joint {shown(joint)}: {name} is not finite; identify it from other data")
    if friction.k_v <= 0.0:
        raise ExportError(f"joint {shown(joint)}: k_v = {friction.k_v:g} is not positive; give a positive k_v")
    if friction.delta is None:
        if friction.stribeck != 0.0:
            raise ExportError(f"joint {shown(joint)}: has a Stribeck term but no delta; give its delta")
    elif not (math.isfinite(friction.delta) and friction.delta > 0.0):
        text = f"joint {shown(joint)}: delta = {friction.delta:g} is not positive and finite; give a positive delta"
        raise ExportError(text)


SCHEMA = "tauscope.compensation/1"


def to_document(model: CompensationModel, effects: Sequence[Mapping[str, Any]] = ()) -> dict[str, Any]:
    """The model as plain data for JSON and YAML: coefficients as torque, in mA, in ‰ of rated torque, or None."""
    return {
        "schema": SCHEMA,
        "robot": model.robot,
        "created": model.created.isoformat(),
        "tauscope": model.version,
        "recordings": [{"name": source.name, "sha256": source.sha256} for source in model.recordings],
        "equation": EQUATION,
        "joints": [_joint(number, joint) for number, joint in enumerate(model.joints, start=1)],
        **({"effects": [dict(each) for each in effects]} if effects else {}),
    }


def to_json(model: CompensationModel, effects: Sequence[Mapping[str, Any]] = ()) -> str:
    """The model as JSON text; every number reads back as the same float64."""
    return json.dumps(to_document(model, effects), indent=2, allow_nan=False) + "\n"


def to_yaml(model: CompensationModel, effects: Sequence[Mapping[str, Any]] = ()) -> str:
    """The model as YAML text; YAML 1.1 and 1.2 readers see the same strings and float64 numbers."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = _PlainRepresenter
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False  # pyright: ignore[reportAttributeAccessIssue]
    yaml.width = 4096
    stream = io.StringIO()
    yaml.dump(_quote_text(to_document(model, effects)), stream)
    return stream.getvalue()


class _Quoted(str):
    """Text that is written in quotes: a joint named `no` or `1e3` stays a name."""


class _PlainRepresenter(SafeRepresenter):
    """Writes numbers and texts so that YAML 1.1 readers agree with YAML 1.2 readers."""


def _represent_float(representer: SafeRepresenter, value: float) -> ScalarNode:
    """A float with a point, without which YAML 1.1 takes 1e-05 for text."""
    text = repr(value)
    if "e" in text and "." not in text:
        text = text.replace("e", ".0e")
    return representer.represent_scalar("tag:yaml.org,2002:float", text)


def _represent_quoted(representer: SafeRepresenter, value: _Quoted) -> ScalarNode:
    """Text between double quotes, its special characters escaped."""
    return representer.represent_scalar("tag:yaml.org,2002:str", str(value), style='"')


_PlainRepresenter.add_representer(float, _represent_float)
_PlainRepresenter.add_representer(_Quoted, _represent_quoted)


def _quote_text(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _quote_text(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_quote_text(item) for item in value]
    return _Quoted(value) if isinstance(value, str) else value


def _joint(number: int, joint: JointCompensation) -> dict[str, Any]:
    units = joint.units
    return {
        "number": number,
        "name": joint.name,
        "type": joint.type.value,
        "k_v": joint.friction.k_v,
        "delta": joint.friction.delta,
        "velocity_unit": f"{joint.type.unit}/s",
        "torque": _coefficients(joint, 1.0, joint.type.torque_unit),
        "current": _coefficients(joint, units.torque_per_milliampere, "mA"),
        "rated_torque": _coefficients(joint, units.torque_per_permille, "per mille of rated torque"),
        "remarks": list(units.remarks),
    }


def _coefficients(joint: JointCompensation, torque_per_unit: float | None, unit: str) -> Mapping[str, Any] | None:
    """Coefficients divided by what one unit means at the joint; None where that is not known."""
    if torque_per_unit is None:
        return None
    names = ("stiction", "stribeck", "viscous", "offset")
    return {"unit": unit} | {name: getattr(joint.friction, name) / torque_per_unit for name in names}
