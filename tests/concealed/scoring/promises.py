"""Whether a diagnosis sees what it calls detectable: sizes in the unit of `detectable`, the first coefficient's."""

import math
from collections.abc import Mapping

from concealed.sealing.truth import Hidden, label
from tauscope.diagnosis.documents.document import DiagnosisDocument

SIZES: Mapping[str, tuple[str, ...]] = {
    "asymmetric_coulomb": ("a",),
    "asymmetric_viscous": ("b",),
    "nonlinear_viscous": ("c",),
    "stribeck_friction": ("s",),
    "load_dependent_friction": ("mu",),
    "position_dependent_friction": ("a", "b"),
    "friction_coupling": ("f",),
    "cogging": ("amplitude",),
    "torque_ripple": ("amplitude",),
    "joint_elasticity": ("c",),
    "backlash": ("b",),
    "rotor_inertia": ("I_a",),
    "torque_gain_error": ("g",),
    "time_delay": ("d",),
    "joint_spring": ("k",),
    "kinematic_error": ("d",),
    "payload_change": ("m",),
    "external_contact": ("c",),
}
"""Parameters whose length is the size; an effect whose truth has no size in that unit is left out."""

SILENT = ("consistent", "inconclusive")
"""Verdicts that show nothing."""


def size_of(effect: str, hidden: Hidden) -> float | None:
    """The concealed size of an effect; None where the truth does not have it."""
    names = SIZES.get(effect, ())
    if not names or any(name not in hidden.parameters for name in names):
        return None
    return math.hypot(*(hidden.parameters[name] for name in names))


def is_promised(hidden: Hidden, found: DiagnosisDocument) -> bool:
    """Whether the diagnosis says that these data would have shown an effect of the concealed size, where it is."""
    for each in found.detectable:
        if label(each.effect, each.joint) not in hidden.labels or not each.visible or each.minimum is None:
            continue
        size = size_of(each.effect, hidden)
        if size is not None and size > each.minimum:
            return True
    return False


def is_shown(found: DiagnosisDocument) -> bool:
    """Whether a diagnosis says that something is there."""
    return found.verdict not in SILENT
