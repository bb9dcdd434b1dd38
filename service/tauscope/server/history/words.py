"""A change in one sentence, as in "joint3: viscous friction +40 % in 6 weeks"."""

from datetime import timedelta

from tauscope.server.history.drift import Drift

_NOUNS = {
    "stiction": "stiction",
    "stribeck": "Stribeck friction",
    "viscous": "viscous friction",
    "offset": "torque offset",
    "rotor_inertia": "rotor inertia",
}


def drift_words(drift: Drift, elapsed: timedelta) -> str:
    """A change in one sentence."""
    term = drift.name.partition(" ")[0]
    noun = _NOUNS.get(term, drift.name) if drift.name == f"{term} {drift.joint}" else drift.name
    difference = drift.after - drift.before
    # A percentage means something only where the earlier value is what the change was measured by, or near it.
    amount = f" {100 * difference / abs(drift.before):+.0f} %" if abs(drift.before) > 0.5 * _measure(drift) else ""
    figures = f"{drift.before:.3g} → {drift.after:.3g}, {abs(drift.in_std):.0f} standard errors"
    return f"{drift.joint}: {noun}{amount} in {duration_words(elapsed)} ({figures})"


def duration_words(elapsed: timedelta) -> str:
    """A length of time, as people say it."""
    for unit, length, most in (("hour", 3600, 48), ("day", 86400, 14), ("week", 7 * 86400, 9)):
        count = round(elapsed.total_seconds() / length)
        if count < most:
            return f"{count} {unit}{'' if count == 1 else 's'}"
    count = round(elapsed.total_seconds() / (30.44 * 86400))
    return f"{count} months"


def _measure(drift: Drift) -> float:
    """What the change was measured by [SI]."""
    return abs((drift.after - drift.before) / drift.share) if drift.share else 0.0
