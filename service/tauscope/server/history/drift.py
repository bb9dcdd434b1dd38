"""From model to model: Δ = φ₂ − φ₁ between two, in its standard error √(σ₁² + σ₂²), and the trend of many."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
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
    """All but the shape constants K_v and δ, which describe the same curve as stiction and Stribeck friction.

    A value within three standard errors of zero counts as three standard errors.
    """
    rotors = ((f"rotor_inertia {each.joint}", each.joint, each.value, each.std, 0.0) for each in document.rotor_inertia)
    return tuple(
        NamedParameter(name, joint, value, std, max(abs(value), 3.0 * std, level))
        for name, joint, value, std, level in (*_base(document), *_friction(document), *rotors)
        if std is not None and std > 0.0
    )


_Estimate = tuple[str, str, float, float | None, float]  # name, joint, value, its standard error, least scale


def _base(document: IdentificationDocument) -> Iterator[_Estimate]:
    for each in document.base_parameters:
        match = _LINK.search(next(iter(each.terms), ""))
        link = int(match.group()) if match else 1
        joint = document.joints[min(max(link, 1), len(document.joints)) - 1]
        yield each.name, joint, each.value, each.std, 0.0


def _friction(document: IdentificationDocument) -> Iterator[_Estimate]:
    """Friction terms; those that add to the same torque are measured by the joint's whole dry friction."""
    for each in document.friction:
        level = abs(each.stiction) + abs(each.stribeck)
        for term in FRICTION_TERMS:
            if each.identifiable.get(term, True):
                least = 0.0 if term == "viscous" else level
                yield f"{term} {each.joint}", each.joint, float(getattr(each, term)), each.std.get(term), least


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
    drifts = []
    for old in before:
        if (new := later.get(old.name)) is not None:
            change, std = new.value - old.value, math.hypot(old.std, new.std)
            drifts.append(Drift(old.name, old.joint, old.value, new.value, std, change / std, change / old.scale))
    return tuple(drifts)


def find_largest_by_joint(drifts: Sequence[Drift]) -> Mapping[str, Drift]:
    largest: dict[str, Drift] = {}
    for drift in drifts:
        if drift.joint not in largest or abs(drift.in_std) > abs(largest[drift.joint].in_std):
            largest[drift.joint] = drift
    return largest


def is_beyond(drift: Drift, policy: ModelPolicy) -> bool:
    return abs(drift.in_std) > policy.drift_std and abs(drift.share) > policy.drift_share


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


WEEK_S = 7 * 86400.0


@entry
class TrendPoint:
    time: datetime = Field(description="when its identification was handed in, UTC")
    value: float = Field(description="estimate [SI]")
    std: float = Field(description="its standard error [SI]")
    model: str = Field(default="", description="identifier of the model")


@entry
class Trend:
    count: int = Field(description="number of points")
    slope: float = Field(description="change a week [SI]")
    slope_std: float = Field(description="its standard error, scatter of the points included [SI]")
    scatter: float = Field(description="1 where the points scatter as their standard errors say")
    change: float = Field(description="of the line from the first point to the last [SI]")
    in_std: float = Field(description="slope in its standard errors")


def fit_trend(points: Sequence[TrendPoint]) -> Trend | None:
    """The line by weighted least squares; None where fewer than three points, or all at one time, tell no slope."""
    if len(points) < 3:
        return None
    start = min(point.time for point in points)
    time = np.array([(point.time - start).total_seconds() / WEEK_S for point in points])
    value = np.array([point.value for point in points])
    weight = 1.0 / np.array([point.std for point in points]) ** 2
    centred = time - np.average(time, weights=weight)
    spread = float(np.sum(weight * centred**2))
    if spread <= 0.0:
        return None
    slope = float(np.sum(weight * centred * value)) / spread
    residual = value - np.average(value, weights=weight) - slope * centred
    scatter = math.sqrt(float(np.sum(weight * residual**2)) / (len(points) - 2))
    slope_std = max(1.0, scatter) / math.sqrt(spread)
    return Trend(len(points), slope, slope_std, scatter, slope * float(np.ptp(time)), slope / slope_std)


@entry
class ParameterTrend:
    name: str = Field(description="of the parameter")
    joint: str = Field(description="that it belongs to")
    points: list[TrendPoint] = Field(description="in every model that was ever active, the oldest first")
    line: Trend | None = Field(description="null before there are three points")


def parameter_trends(models: Sequence[tuple[str, datetime, IdentificationDocument]]) -> list[ParameterTrend]:
    """Every parameter of the newest model over all models, the oldest first: identifier, time and document of each."""
    told = [
        (identifier, created, {each.name: each for each in extract_parameters(document)})
        for identifier, created, document in models
    ]
    trends = []
    for name, newest in told[-1][2].items() if told else ():
        points = [
            TrendPoint(created, parameters[name].value, parameters[name].std, identifier)
            for identifier, created, parameters in told
            if name in parameters
        ]
        trends.append(ParameterTrend(name, newest.joint, points, fit_trend(points)))
    return trends
