"""What a result says, in sentences."""

from collections.abc import Iterator

from tauscope.identification import IdentificationDocument
from tauscope.report.quantities import ABSENT, percent, significant

AT_NOISE = 1.1
"""A residual of at most this many times the noise holds nothing but noise."""

ABOVE_NOISE = 2.0
"""A residual of more than this many times the noise is mostly not noise."""

CARRIES_OVER = 1.3
"""A held-out residual of more than this many times that of the model's own recordings is not chance."""

_PERIOD_LEVELS = {
    "noise": "the residual is at the level of the sensor noise: little else is left",
    "above": "the residual is above the sensor noise: something small is missing from the model",
    "well above": "the residual is well above the sensor noise: the model lacks an effect there",
}
_RESIDUAL_LEVELS = {
    "noise": "the residual is hardly correlated over time: little else than noise is left",
    "above": "part of the residual is correlated over time: something small is missing, or the noise is coloured",
    "well above": "most of the residual is correlated over time: an effect is missing, or the noise is coloured",
}
"""Without repeated periods, what is correlated over time and what the sensor does cannot be told apart for certain."""

_CONSTANTS = {
    "stiction": "stiction",
    "stribeck": "Stribeck coefficient",
    "viscous": "viscous coefficient",
    "offset": "offset",
    "k_v": "slope K_v",
    "delta": "slope δ",
}


def fit_sentences(document: IdentificationDocument) -> list[str]:
    """How well the model explains the torque."""
    train, held_out = document.fit.train, document.fit.held_out
    error = f"Relative error, sensor noise included: {percent(train.relative_error)} on the model's own recordings"
    if held_out is None:
        sentences = [f"{error}; hold a recording out to see how the model does on motion that it has not seen."]
    else:
        sentences = [f"{error}, {percent(held_out.relative_error)} on held-out ones."]
    levels: dict[str, list[str]] = {}
    for joint, rms, noise in zip(document.joints, train.rms, document.noise_std, strict=True):
        levels.setdefault(_level(noise_ratio(rms, noise)), []).append(joint)
    words = _PERIOD_LEVELS if document.noise_method == "periods" else _RESIDUAL_LEVELS
    for level, joints in levels.items():
        which = "every joint" if len(joints) == len(document.joints) > 1 else ", ".join(joints)
        sentences.append(f"At {which} {words[level]}.")
    return [*sentences, *_about_held_out(document)]


def cautions(document: IdentificationDocument) -> list[str]:
    """What a reader has to know before using the numbers."""
    return [*_about_parameters(document), *_about_friction(document), *_about_samples(document)]


def noise_words(document: IdentificationDocument) -> str:
    """Where the noise figures come from."""
    if document.noise_method == "periods":
        return "from differences between repeated periods, whatever the model"
    return "from the whitened residual"


def band_words(document: IdentificationDocument) -> str:
    """The band in which torque and model are compared."""
    return "all frequencies" if document.cutoff_hz is None else f"0 – {significant(document.cutoff_hz, 3)} Hz"


def masked_samples(document: IdentificationDocument) -> int:
    """How many samples of all recordings were not used: no position, no torque, or a piece too short to filter."""
    entries = (*document.conditioning, *document.held_out_conditioning)
    return sum(entry.missed_positions + entry.dropped + sum(entry.missed_torques) for entry in entries)


def noise_ratio(rms: float, noise_std: float) -> float:
    """Residual in units of the noise.

    Parameters
    ----------
    rms : float
        root mean square of the residual [Nm or N]
    noise_std : float
        standard deviation of the noise [Nm or N]
    """
    return rms / noise_std if noise_std > 0.0 else float("inf")


def _level(ratio: float) -> str:
    return "noise" if ratio <= AT_NOISE else "above" if ratio <= ABOVE_NOISE else "well above"


def _about_held_out(document: IdentificationDocument) -> Iterator[str]:
    """Joints whose model does not carry over to other motion."""
    if document.fit.held_out is None:
        return
    pairs = zip(document.joints, document.fit.train.rms, document.fit.held_out.rms, strict=True)
    worse = [joint for joint, own, other in pairs if other > CARRIES_OVER * own]
    if worse:
        yield (
            f"On held-out recordings the residual of {_listed(worse)} is larger than on the model's own: the model does"
            " not carry over to that motion; identify from recordings that move the joints in more ways."
        )


def _about_parameters(document: IdentificationDocument) -> Iterator[str]:
    """Constraints, and parameters that the motion does not show."""
    if document.constrained:
        yield "No rigid bodies can have the free estimate; the values are the nearest physically consistent ones."
    if document.undetermined:
        yield f"These recordings say nothing about {_listed(document.undetermined)}: excite the joints more."


def _about_friction(document: IdentificationDocument) -> Iterator[str]:
    """Coefficients that the data cannot tell; δ only where there is a Stribeck term."""
    for name, words in _CONSTANTS.items():
        entries = [entry for entry in document.friction if not entry.identifiable.get(name, True)]
        if name in ("stribeck", "delta"):
            entries = [entry for entry in entries if entry.delta is not None]
        if entries:
            yield f"These data cannot tell the friction's {words} at {_listed([entry.joint for entry in entries])}."


def _about_samples(document: IdentificationDocument) -> Iterator[str]:
    """Samples that were missing, and what was done about it."""
    for entry in (*document.conditioning, *document.held_out_conditioning):
        counts = {
            "without a position": entry.missed_positions,
            "without a torque": sum(entry.missed_torques),
            "in pieces too short to filter": entry.dropped,
        }
        parts = [f"{count} {what}" for what, count in counts.items() if count]
        if parts:
            yield f"{entry.recording}: masked samples: {', '.join(parts)}, of {entry.samples}."
        if entry.gaps:
            yield f"{entry.recording}: split at {entry.gaps} {'gap' if entry.gaps == 1 else 'gaps'} in the clock."


def _listed(names: list[str], most: int = 8) -> str:
    """Names in a sentence, not all of them where there are many."""
    if not names:
        return ABSENT
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
