"""What has changed from one identification of a robot to another: Δ = φ₂ − φ₁, in its standard error √(σ₁² + σ₂²)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tauscope.server.history.parameters import NamedParameter
from tauscope.server.history.policy import ModelPolicy


@dataclass(frozen=True)
class Drift:
    """The change of one parameter.

    before, after : float
        values [SI]
    std : float
        standard error of the difference [SI]; of two identifications that share no recording
    """

    name: str
    joint: str
    before: float
    after: float
    std: float
    in_std: float
    share: float


def drift_between(before: Sequence[NamedParameter], after: Sequence[NamedParameter]) -> tuple[Drift, ...]:
    """The change of every parameter that both identifications tell."""
    later = {parameter.name: parameter for parameter in after}
    return tuple(_drift(parameter, later[parameter.name]) for parameter in before if parameter.name in later)


def largest_by_joint(drifts: Sequence[Drift]) -> Mapping[str, Drift]:
    """For each joint its most significant change."""
    largest: dict[str, Drift] = {}
    for drift in drifts:
        if drift.joint not in largest or abs(drift.in_std) > abs(largest[drift.joint].in_std):
            largest[drift.joint] = drift
    return largest


def is_beyond(drift: Drift, policy: ModelPolicy) -> bool:
    """Whether a change is both significant and large."""
    return abs(drift.in_std) > policy.drift_std and abs(drift.share) > policy.drift_share


def _drift(before: NamedParameter, after: NamedParameter) -> Drift:
    """The change of one parameter."""
    difference, std = after.value - before.value, math.hypot(before.std, after.std)
    return Drift(before.name, before.joint, before.value, after.value, std, difference / std, difference / before.scale)
