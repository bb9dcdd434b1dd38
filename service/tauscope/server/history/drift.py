"""Parameter drift between two identifications: Δ = φ₂ − φ₁, in its standard error √(σ₁² + σ₂²)."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta

from pydantic import Field

from tauscope.identification.result import IdentificationDocument
from tauscope.server.history.gates import ModelPolicy
from tauscope.strict_model import entry

FRICTION_TERMS = ("stiction", "stribeck", "viscous", "offset")
_LINK = re.compile(r"\d+$")


@dataclass(frozen=True)
class NamedParameter:
    """`value` and its standard error `std` [SI]; `scale`: what a change is a part of [SI]."""

    name: str
    joint: str
    value: float
    std: float
    scale: float


def extract_parameters(document: IdentificationDocument) -> tuple[NamedParameter, ...]:
    """All but the shape constants K_v and δ, which describe the same curve as stiction and Stribeck friction."""
    return (*_base(document), *_friction(document), *_rotors(document))


def _base(document: IdentificationDocument) -> Iterator[NamedParameter]:
    """Base parameters; a value within three standard errors of zero counts as three standard errors."""
    for each in document.base_parameters:
        if each.std is None or each.std <= 0.0:
            continue
        match = _LINK.search(next(iter(each.terms), ""))
        link = int(match.group()) if match else 1
        joint = document.joints[min(max(link, 1), len(document.joints)) - 1]
        scale = max(abs(each.value), 3.0 * each.std)
        yield NamedParameter(each.name, joint, each.value, each.std, scale)


def _friction(document: IdentificationDocument) -> Iterator[NamedParameter]:
    """Friction terms; those that add to the same torque are measured by the joint's whole dry friction."""
    for each in document.friction:
        level = abs(each.stiction) + abs(each.stribeck)
        for term in FRICTION_TERMS:
            std = each.std.get(term)
            if std is None or std <= 0.0 or not each.identifiable.get(term, True):
                continue
            value = float(getattr(each, term))
            scale = max(abs(value), 3.0 * std, 0.0 if term == "viscous" else level)
            yield NamedParameter(f"{term} {each.joint}", each.joint, value, std, scale)


def _rotors(document: IdentificationDocument) -> Iterator[NamedParameter]:
    for each in document.rotor_inertia:
        if each.std is not None and each.std > 0.0:
            scale = max(abs(each.value), 3.0 * each.std)
            yield NamedParameter(f"rotor_inertia {each.joint}", each.joint, each.value, each.std, scale)


@entry
class Drift:
    name: str = Field(description="of the parameter", examples=["viscous joint3"])
    joint: str = Field(description="that it belongs to")
    before: float = Field(description="in the model that it is compared with [SI]")
    after: float = Field(description="in this model [SI]")
    std: float = Field(description="standard error of the difference [SI]")
    in_std: float = Field(description="difference in standard errors")
    share: float = Field(description="difference in parts of the earlier value")


def compute_drift(before: Sequence[NamedParameter], after: Sequence[NamedParameter]) -> tuple[Drift, ...]:
    later = {parameter.name: parameter for parameter in after}
    return tuple(_drift(parameter, later[parameter.name]) for parameter in before if parameter.name in later)


def find_largest_by_joint(drifts: Sequence[Drift]) -> Mapping[str, Drift]:
    largest: dict[str, Drift] = {}
    for drift in drifts:
        if drift.joint not in largest or abs(drift.in_std) > abs(largest[drift.joint].in_std):
            largest[drift.joint] = drift
    return largest


def is_beyond(drift: Drift, policy: ModelPolicy) -> bool:
    return abs(drift.in_std) > policy.drift_std and abs(drift.share) > policy.drift_share


def _drift(before: NamedParameter, after: NamedParameter) -> Drift:
    difference, std = after.value - before.value, math.hypot(before.std, after.std)
    return Drift(before.name, before.joint, before.value, after.value, std, difference / std, difference / before.scale)


_NOUNS = {
    "stiction": "stiction",
    "stribeck": "Stribeck friction",
    "viscous": "viscous friction",
    "offset": "torque offset",
    "rotor_inertia": "rotor inertia",
}


def describe_drift(drift: Drift, elapsed: timedelta) -> str:
    term = drift.name.partition(" ")[0]
    noun = _NOUNS.get(term, drift.name) if drift.name == f"{term} {drift.joint}" else drift.name
    difference = drift.after - drift.before
    # A percentage means something only where the earlier value is what the change was measured by, or near it.
    measure = abs(difference / drift.share) if drift.share else 0.0
    amount = f" {100 * difference / abs(drift.before):+.0f} %" if abs(drift.before) > 0.5 * measure else ""
    figures = f"{drift.before:.3g} → {drift.after:.3g}, {abs(drift.in_std):.0f} standard errors"
    return f"{drift.joint}: {noun}{amount} in {duration_words(elapsed)} ({figures})"


def duration_words(elapsed: timedelta) -> str:
    for unit, length, most in (("hour", 3600, 48), ("day", 86400, 14), ("week", 7 * 86400, 9)):
        count = round(elapsed.total_seconds() / length)
        if count < most:
            return f"{count} {unit}{'' if count == 1 else 's'}"
    count = round(elapsed.total_seconds() / (30.44 * 86400))
    return f"{count} months"
