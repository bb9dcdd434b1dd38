"""Compensation of the extended model as code: the friction that identify exports, and the effects beside it.

An effect can stand in a controller where its torque follows from the joint's own position, velocity and load at the
same instant. What needs a state, other joints or the clock is named in the file's heading, and is not in the code.
"""

from collections.abc import Mapping, Sequence
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

TWO_OVER_PI = "0.6366197723675814"

EXPRESSIONS: Mapping[str, str] = {
    "asymmetric_coulomb": "{c0} * fabs(atan({k_v} * v) * " + TWO_OVER_PI + ")",
    "asymmetric_viscous": "{c0} * fabs(v)",
    "nonlinear_viscous": "{c0} * copysign(pow(fabs(v), {s0}), v)",
    "load_dependent_friction": "{c0} * fabs(load) * atan({k_v} * v) * " + TWO_OVER_PI,
    "position_dependent_friction": "({c0} * cos({s0} * q) + {c1} * sin({s0} * q)) * atan({k_v} * v) * " + TWO_OVER_PI,
    "stribeck_friction": "{c0} * atan({k_v} * v) * " + TWO_OVER_PI + " * exp(-pow(fabs(v) / {s0}, {s1}))",
    "cogging": "{c0} * sin({s0} * q) + {c1} * cos({s0} * q)",
    "torque_ripple": "load * ({c0} * sin({s0} * q) + {c1} * cos({s0} * q))",
    "joint_spring": "{c0} * q",
    "cable_force": "{side} * {c0} * pow(fmax({side} * (q - {s0}), 0.0), {s1})",
}
"""Torque by effect, in what C and Python have in common; q, v, load: position, velocity, rigid-body torque."""


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
    included = [term for term in model.terms if term.effect.id in EXPRESSIONS]
    names = [joint.name for joint in diagnosis.robot.joints]
    left_out = [term.effect.name(names) for term in model.terms if term.effect.id not in EXPRESSIONS]
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
    joint = term.effect.joint or 0
    values = {f"c{place}": repr(float(value)) for place, value in enumerate(term.coefficients)}
    values |= {f"s{place}": repr(float(value)) for place, value in enumerate(term.shape)}
    values["k_v"] = repr(float(diagnosis.selection.fit.model.structure.terms[joint].k_v))
    values["side"] = repr(float(getattr(term.effect, "side", 1)))
    return EXPRESSIONS[term.effect.id].format(**values)


def _by_joint(terms: Sequence[Term], diagnosis: Diagnosis) -> list[tuple[int, list[str]]]:
    """Expressions of every joint that has any, joints counted from 1."""
    found: dict[int, list[str]] = {}
    for term in terms:
        found.setdefault((term.effect.joint or 0) + 1, []).append(_expression(term, diagnosis))
    return sorted(found.items())


def _remark(left_out: Sequence[str]) -> str:
    return f"Not in this code, for want of state, other joints or the clock: {', '.join(left_out)}." if left_out else ""


def _python(name: str, terms: Sequence[Term], left_out: Sequence[str], diagnosis: Diagnosis) -> str:
    """Function of the effects in Python."""
    lines = ["", "", f"def {name}_effect_torque(joint, position, velocity, load):"]
    lines.append('    """Torque in Nm (force in N) of what was found beside friction; load: rigid-body torque."""')
    remark = _remark(left_out)
    lines += [f"    # {remark}"] if remark else []
    lines += ["    from math import atan, copysign, cos, exp, fabs, pow, sin", ""]
    lines += ["    fmax = max", "    q, v = position, velocity", "    torque = 0.0"]
    for joint, expressions in _by_joint(terms, diagnosis):
        lines.append(f"    if joint == {joint}:")
        lines += [f"        torque += {expression}" for expression in expressions]
    return "\n".join([*lines, "    return torque", ""])


def _c(name: str, terms: Sequence[Term], left_out: Sequence[str], diagnosis: Diagnosis) -> str:
    """Function of the effects in C."""
    remark = _remark(left_out)
    lines = [f"/* {remark} */"] if remark else []
    lines.append("/* Torque in Nm (force in N) of what was found beside friction; load: rigid-body torque. */")
    lines.append(f"static inline double {name}_effect_torque(int joint, double q, double v, double load)")
    lines += ["{", "    double torque = 0.0;", "    (void)q;", "    (void)v;", "    (void)load;"]
    for joint, expressions in _by_joint(terms, diagnosis):
        lines.append(f"    if (joint == {joint}) {{")
        lines += [f"        torque += {expression};" for expression in expressions]
        lines.append("    }")
    return "\n".join([*lines, "    return torque;", "}", ""])
