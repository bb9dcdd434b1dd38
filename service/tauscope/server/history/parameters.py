"""The parameters of an identification by name, so that those of two identifications can be compared."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from tauscope.identification.result import FrictionEntry, IdentificationDocument

FRICTION_TERMS = ("stiction", "stribeck", "viscous", "offset")
_LINK = re.compile(r"\d+$")


@dataclass(frozen=True)
class NamedParameter:
    """An identified parameter.

    value : float
        estimate [SI]
    std : float
        its standard error [SI]
    scale : float
        what a change is a part of [SI]: the value itself, or what is larger where the value is next to nothing
    """

    name: str
    joint: str
    value: float
    std: float
    scale: float


def named_parameters(document: IdentificationDocument) -> tuple[NamedParameter, ...]:
    """The parameters of an identification that its recordings tell.

    Base parameters are those of the free estimate: their standard errors belong to it. The shape constants K_v and δ
    are left out: they describe the same curve as stiction and Stribeck friction, and wander with them.
    """
    return (*_base(document), *_friction(document), *_rotors(document))


def _base(document: IdentificationDocument) -> Iterator[NamedParameter]:
    """Base parameters; a value within three standard errors of zero counts as three standard errors."""
    for entry in document.base_parameters:
        if entry.std is None or entry.std <= 0.0:
            continue
        match = _LINK.search(next(iter(entry.terms), ""))
        link = int(match.group()) if match else 1
        joint = document.joints[min(max(link, 1), len(document.joints)) - 1]
        scale = max(abs(entry.free_value), 3.0 * entry.std)
        yield NamedParameter(entry.name, joint, entry.free_value, entry.std, scale)


def _friction(document: IdentificationDocument) -> Iterator[NamedParameter]:
    """Friction terms; those that add to the same torque are measured by the joint's whole dry friction."""
    for entry in document.friction:
        level = abs(entry.stiction) + abs(entry.stribeck)
        for term in FRICTION_TERMS:
            std = entry.std.get(term)
            if std is None or std <= 0.0 or not entry.identifiable.get(term, True):
                continue
            value = _value(entry, term)
            scale = max(abs(value), 3.0 * std, 0.0 if term == "viscous" else level)
            yield NamedParameter(f"{term} {entry.joint}", entry.joint, value, std, scale)


def _rotors(document: IdentificationDocument) -> Iterator[NamedParameter]:
    """Reflected rotor inertias."""
    for entry in document.rotor_inertia:
        if entry.std is not None and entry.std > 0.0:
            scale = max(abs(entry.value), 3.0 * entry.std)
            yield NamedParameter(f"rotor_inertia {entry.joint}", entry.joint, entry.value, entry.std, scale)


def _value(entry: FrictionEntry, term: str) -> float:
    return float(getattr(entry, term))
