"""The compensation model as plain data: JSON and YAML."""

import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.representer import SafeRepresenter

from tauscope.export.compensation.model import EQUATION, CompensationModel, JointCompensation
from tauscope.robot import JointType

SCHEMA = "tauscope.compensation/1"


def to_document(model: CompensationModel, effects: Sequence[Mapping[str, Any]] = ()) -> dict[str, Any]:
    """The model as mappings, lists, strings and numbers, the same for JSON and YAML.

    Coefficients stand three times: as joint torque, in mA and in ‰ of rated torque; the last two are None where the
    unit is not known, and the joint's remarks say why.
    """
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
    """The same data with every text, but no key, to be quoted."""
    if isinstance(value, dict):
        return {key: _quote_text(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_quote_text(item) for item in value]
    return _Quoted(value) if isinstance(value, str) else value


def _joint(number: int, joint: JointCompensation) -> dict[str, Any]:
    """One joint as plain data."""
    prismatic = joint.type is JointType.PRISMATIC
    units = joint.units
    return {
        "number": number,
        "name": joint.name,
        "type": joint.type.value,
        "k_v": joint.friction.k_v,
        "delta": joint.friction.delta,
        "velocity_unit": "m/s" if prismatic else "rad/s",
        "torque": _coefficients(joint, 1.0, "N" if prismatic else "Nm"),
        "current": _coefficients(joint, units.torque_per_milliampere, "mA"),
        "rated_torque": _coefficients(joint, units.torque_per_permille, "per mille of rated torque"),
        "remarks": list(units.remarks),
    }


def _coefficients(joint: JointCompensation, torque_per_unit: float | None, unit: str) -> Mapping[str, Any] | None:
    """Coefficients divided by what one unit means at the joint; None where that is not known."""
    if torque_per_unit is None:
        return None
    friction = joint.friction
    return {
        "unit": unit,
        "stiction": friction.stiction / torque_per_unit,
        "stribeck": friction.stribeck / torque_per_unit,
        "viscous": friction.viscous / torque_per_unit,
        "offset": friction.offset / torque_per_unit,
    }
