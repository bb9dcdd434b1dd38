"""Compensation of the extended model as code: the friction that identify exports, and the effects beside it.

An effect can stand in a controller where its torque follows from the joint's own position, velocity and load at the
same instant. What needs a state, other joints or the clock is named in the file's heading, and is not in the code.
"""

from collections.abc import Sequence
from datetime import datetime

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.errors import ExportError
from tauscope.export.compensation import (
    CompensationModel,
    JointCompensation,
    JointFriction,
    RecordingSource,
    drive_units,
    to_c_header,
    to_python,
)
from tauscope.export.compensation.identifiers import identifier
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
    """Source code that gives the torque of friction and of the found effects.

    Raises
    ------
    ExportError
        for another suffix, or coefficients that no controller can use
    """
    model = diagnosis.selection.fit.model
    joints = tuple(
        JointCompensation(joint.name, joint.type, _friction(diagnosis, place), drive_units(joint, effort_kind))
        for place, joint in enumerate(diagnosis.robot.joints)
    )
    plain = CompensationModel(diagnosis.robot.name, joints, created, tuple(sources), version)
    included = [term for term in model.terms if term.effect.code]
    names = [joint.name for joint in diagnosis.robot.joints]
    left_out = [
        f"{term.effect.name(names)}: {term.effect.no_code or 'it has no code'}"
        for term in model.terms
        if not term.effect.code
    ]
    if suffix == ".py":
        return to_python(plain) + _python(identifier(plain.robot), included, left_out, diagnosis)
    if suffix == ".h":
        text = to_c_header(plain)
        at = text.rindex("#endif")
        return text[:at] + _c(identifier(plain.robot), included, left_out, diagnosis) + "\n" + text[at:]
    raise ExportError(f"compensation code of an extended model is .py or .h, not {suffix!r}; rename the file")


def _friction(diagnosis: Diagnosis, joint: int) -> JointFriction:
    """Nominal friction of the final model."""
    model = diagnosis.selection.fit.model
    columns = {n: model.structure.coefficient(joint, n) for n in ("stiction", "stribeck", "viscous", "offset")}
    values = {name: 0.0 if at is None else float(model.parameters[at]) for name, at in columns.items()}
    terms = model.structure.terms[joint]
    return JointFriction(**values, k_v=float(terms.k_v), delta=None if terms.delta is None else float(terms.delta))


def _expression(term: Term, diagnosis: Diagnosis) -> str:
    """A term's torque, in the arm's own like the friction beside it."""
    term = on_the_arm(diagnosis.selection.fit.model, term)
    k_v = float(diagnosis.selection.fit.model.structure.terms[term.effect.joint or 0].k_v)
    return term.effect.torque_code(term.coefficients.tolist(), term.shape.tolist(), k_v)


def _by_joint(terms: Sequence[Term], diagnosis: Diagnosis) -> list[tuple[int, list[str]]]:
    """Expressions of every joint that has any, joints counted from 1."""
    found: dict[int, list[str]] = {}
    for term in terms:
        found.setdefault((term.effect.joint or 0) + 1, []).append(_expression(term, diagnosis))
    return sorted(found.items())


def _python(name: str, terms: Sequence[Term], left_out: Sequence[str], diagnosis: Diagnosis) -> str:
    """Function of the effects in Python."""
    lines = ["", "", f"def {name}_effect_torque(joint, position, velocity, load):"]
    lines.append('    """Torque in Nm (force in N) of what was found beside friction; load: rigid-body torque."""')
    lines += [f"    # Not in this code: {each}" for each in left_out]
    lines += ["    from math import atan, copysign, cos, exp, fabs, pow, sin", ""]
    lines += ["    fmax = max", "    q, v = position, velocity", "    torque = 0.0"]
    for joint, expressions in _by_joint(terms, diagnosis):
        lines.append(f"    if joint == {joint}:")
        lines += [f"        torque += {expression}" for expression in expressions]
    return "\n".join([*lines, "    return torque", ""])


def _c(name: str, terms: Sequence[Term], left_out: Sequence[str], diagnosis: Diagnosis) -> str:
    """Function of the effects in C."""
    lines = [f"/* Not in this code: {each} */" for each in left_out]
    lines.append("/* Torque in Nm (force in N) of what was found beside friction; load: rigid-body torque. */")
    lines.append(f"static inline double {name}_effect_torque(int joint, double q, double v, double load)")
    lines += ["{", "    double torque = 0.0;", "    (void)q;", "    (void)v;", "    (void)load;"]
    for joint, expressions in _by_joint(terms, diagnosis):
        lines.append(f"    if (joint == {joint}) {{")
        lines += [f"        torque += {expression};" for expression in expressions]
        lines.append("    }")
    return "\n".join([*lines, "    return torque;", "}", ""])
