"""Where the mismatch is: at which joint, and in which part of its motion.

Without findings it is what the residual's power exceeds the noise's by. Where findings explain it, the noise need not
be known: it is in the residual without them and in that with them, and their difference is free of it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.observations import BoolArray, Observations
from tauscope.effects import Signals
from tauscope.recording.recording import Array

BINS = 12
WINDOW = 3  # neighbouring bins that make a place
CONCENTRATED = 0.45  # share of the excess within `WINDOW` of `BINS` equally full bins from which it has a place
# The variable of effects that follow a recorded temperature: they show at both ends of its range.
THERMAL = "temperature"


@dataclass(frozen=True)
class Place:
    """A range of a variable in which excess residual concentrates."""

    variable: str
    low: float  # [SI]
    high: float
    share: float
    recording: str | None = None


@dataclass(frozen=True)
class JointMismatch:
    """Excess residual of one joint."""

    joint: int  # joint index, from 0
    excess_rms: float  # root of what the residual's power exceeds the noise's by, in the common band [Nm or N]
    explained: float  # what the findings take off the whitened residual's energy [noise variances]
    place: Place | None
    time: Place | None


def locate(nominal: Fit, fit: Fit, observations: Observations, left: Sequence[bool]) -> tuple[JointMismatch, ...]:
    """Excess residual of every joint."""
    before = residual_rows(nominal.model, observations)
    after = residual_rows(fit.model, observations) if fit.model.terms else None
    signals = [nominal.model.signals(piece) for piece in observations]
    terms = fit.model.terms
    found = []
    for joint, pieces in enumerate(before):
        used = np.concatenate([piece.used[joint].ravel() for piece in observations])
        noise: Array | float = observations.noise[joint].model.variance
        if after is not None and not left[joint]:
            noise = np.concatenate([rows[0] for rows in after[joint]])[used] ** 2
        power = np.concatenate([rows[0] for rows in pieces])[used] ** 2 - noise
        thermal = any(term.effect.joint == joint and THERMAL in (term.effect.arguments or ()) for term in terms)
        places = _places(joint, observations, signals, used, power, thermal=thermal)
        best = max((each for each in places if each is not None), key=lambda each: each.share, default=None)
        excess = float(np.sqrt(max(float(power.mean()), 0.0)))
        explained = _energy(nominal, joint) - _energy(fit, joint)
        found.append(JointMismatch(joint, excess, explained, best, _in_time(observations, used, power)))
    return tuple(found)


def _places(
    joint: int, observations: Observations, signals: Sequence[Signals], used: BoolArray, power: Array, *, thermal: bool
) -> Iterator[Place | None]:
    """Places of the excess of one joint, variable by variable."""

    def place(variable: str, values: Callable[[Signals], Array], least: float = CONCENTRATED) -> Place | None:
        rows = [piece.reduced(values(each)[None])[0] for piece, each in zip(observations, signals, strict=True)]
        return _concentration(variable, np.concatenate(rows)[used], power, least)

    known = [each.temperature[joint] for each in signals if each.temperature is not None]
    if thermal and len(known) == len(signals) and all(np.isfinite(each).all() for each in known):
        rows = [piece.reduced(each[None])[0] for piece, each in zip(observations, known, strict=True)]
        yield _concentration(THERMAL, np.concatenate(rows)[used], power, 0.0)
        return
    ratio = observations.robot.joints[joint].gear_ratio
    for variable in ("velocity", "position", "load", "acceleration"):
        yield place(variable, lambda each, name=variable: getattr(each, name)[joint])
    if ratio is not None and abs(ratio) > 1.0:
        yield place("motor_position", lambda each: np.mod(each.position[joint] * ratio, 2.0 * np.pi))


def _energy(fit: Fit, joint: int) -> float:
    """Energy of a joint's whitened residual."""
    residual = fit.projection.residual[joint]
    return float(residual @ residual)


def _concentration(variable: str, values: Array, power: Array, least: float = CONCENTRATED) -> Place | None:
    """The window of neighbouring bins that holds most of the excess, from a `least` share of it."""
    total = float(power.sum())
    edges = np.quantile(values, np.linspace(0.0, 1.0, BINS + 1))
    if total <= 0.0 or edges[0] == edges[-1]:
        return None
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, BINS - 1)
    sums = np.bincount(bins, power, minlength=BINS)
    windows = np.convolve(sums, np.ones(WINDOW), mode="valid")
    best = int(np.argmax(windows))
    share = float(windows[best] / total)
    if share < least:
        return None
    return Place(variable, float(edges[best]), float(edges[best + WINDOW]), min(share, 1.0))


def _in_time(observations: Observations, used: BoolArray, power: Array) -> Place | None:
    """When the excess concentrates, in any one recording."""
    recording = np.concatenate(
        [np.full(piece.repetitions * piece.rows, piece.prepared.recording) for piece in observations]
    )[used]
    instants = np.concatenate([piece.row_times() for piece in observations])[used]
    total = float(power.sum())
    best = None
    for number, name in enumerate(observations.names):
        own = recording == number
        if total <= 0.0 or not own.any() or float(power[own].sum()) < CONCENTRATED * total:
            continue
        place = _concentration("time", instants[own], power[own])
        if place is not None and (best is None or place.share > best.share):
            best = Place("time", place.low, place.high, place.share, name)
    return best
