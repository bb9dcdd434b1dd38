"""Compensation of the extended model as code: the friction that identify exports, and the effects beside it.

An effect can stand in a controller where its torque follows from the joint's own position, velocity and load at the
same instant. What needs a state, other joints or the clock is named in the file's heading, and is not in the code.
"""

from collections.abc import Sequence
from datetime import datetime

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.errors import ExportError
from tauscope.export.compensation.model import RecordingSource
from tauscope.export.compensation.source_code import identifier, to_c_header, to_python
from tauscope.export.model import ExportModel, FoundEffect, Origin, of_extended_model
from tauscope.recording import EffortKind


def compensation_code(
    diagnosis: Diagnosis,
    suffix: str,
    *,
    sources: Sequence[RecordingSource],
    created: datetime,
    version: str,
    effort_kind: EffortKind,
) -> str:
    """Source code of the torque of friction and found effects. Raises ExportError for another suffix."""
    origin = Origin(tuple(sources), effort_kind, created, version=version)
    return source_code(of_extended_model(diagnosis.selection.fit.model, (), origin), suffix)


def source_code(model: ExportModel, suffix: str) -> str:
    """The same of any model. Raises ExportError for another suffix, or coefficients that no controller can use."""
    plain = model.compensation
    if suffix == ".py":
        return to_python(plain) + (_python(identifier(plain.robot), model) if model.effects else "")
    if suffix == ".h":
        text = to_c_header(plain)
        at = text.rindex("#endif")
        return text[:at] + _c(identifier(plain.robot), model) + "\n" + text[at:] if model.effects else text
    raise ExportError(f"compensation code is .py or .h, not {suffix!r}; rename the file")


def _list_left_out(model: ExportModel) -> list[str]:
    names = [joint.name for joint in model.robot.joints]
    without = [found.effect for found in model.effects if not found.effect.code]
    return [f"{effect.name(names)}: {effect.no_code or 'it has no code'}" for effect in without]


def _expression(found: FoundEffect, model: ExportModel) -> str:
    k_v = model.delivered_friction[found.effect.joint or 0].k_v
    return found.effect.torque_code(found.coefficients.tolist(), found.shape.tolist(), k_v)


def _group_by_joint(model: ExportModel) -> list[tuple[int, list[str]]]:
    found: dict[int, list[str]] = {}
    for each in model.effects:
        if each.effect.code:
            found.setdefault((each.effect.joint or 0) + 1, []).append(_expression(each, model))
    return sorted(found.items())


def _python(name: str, model: ExportModel) -> str:
    lines = ["", "", f"def {name}_effect_torque(joint, position, velocity, load):"]
    lines.append('    """Torque in Nm (force in N) of what was found beside friction; load: rigid-body torque."""')
    lines += [f"    # Not in this code: {each}" for each in _list_left_out(model)]
    lines += ["    from math import atan, copysign, cos, exp, fabs, pow, sin", ""]
    lines += ["    fmax = max", "    q, v = position, velocity", "    torque = 0.0"]
    for joint, expressions in _group_by_joint(model):
        lines.append(f"    if joint == {joint}:")
        lines += [f"        torque += {expression}" for expression in expressions]
    return "\n".join([*lines, "    return torque", ""])


def _c(name: str, model: ExportModel) -> str:
    lines = [f"/* Not in this code: {each} */" for each in _list_left_out(model)]
    lines.append("/* Torque in Nm (force in N) of what was found beside friction; load: rigid-body torque. */")
    lines.append(f"static inline double {name}_effect_torque(int joint, double q, double v, double load)")
    lines += ["{", "    double torque = 0.0;", "    (void)q;", "    (void)v;", "    (void)load;"]
    for joint, expressions in _group_by_joint(model):
        lines.append(f"    if (joint == {joint}) {{")
        lines += [f"        torque += {expression};" for expression in expressions]
        lines.append("    }")
    return "\n".join([*lines, "    return torque;", "}", ""])
