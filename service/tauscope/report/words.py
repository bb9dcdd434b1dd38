"""What a result says, in sentences."""

from collections.abc import Iterable, Iterator

from tauscope.identification import IdentificationDocument
from tauscope.number_text import percent, significant
from tauscope.robot import JointType
from tauscope.robot.messages import listed


def torque_unit(joint_type: JointType) -> str:
    """Unit of what drives a joint."""
    return "N" if joint_type is JointType.PRISMATIC else "Nm"


def velocity_unit(joint_type: JointType) -> str:
    """Unit of a joint's velocity."""
    return "m/s" if joint_type is JointType.PRISMATIC else "rad/s"


def state_unit(variable: str, joint_type: JointType) -> str:
    """Unit of a variable that a residual may depend on."""
    position = "m" if joint_type is JointType.PRISMATIC else "rad"
    units = {"velocity": f"{position}/s", "position": position, "acceleration": f"{position}/s²", "time": "s"}
    return {**units, "load": torque_unit(joint_type), "temperature": "°C", "motor_position": "rad"}.get(variable, "")


def base_parameter_unit(terms: Iterable[str]) -> str:
    """Unit of a combination of standard parameters: that of its first, whose coefficient is one."""
    first = next(iter(terms))
    if first.startswith("I"):
        return "kg m²"
    return "kg m" if first.startswith("ms") else "kg"


AT_NOISE = 1.1  # a residual of at most this many times the noise holds nothing but noise
ABOVE_NOISE = 2.0  # a residual of more than this many times the noise is mostly not noise
CARRIES_OVER = 1.3  # a held-out residual of more than this many times that of the model's own recordings is not chance

_PERIOD_LEVELS = {
    "noise": "the residual is at the level of the sensor noise: little else is left",
    "above": "the residual is above the sensor noise: something small is missing from the model",
    "well above": "the residual is well above the sensor noise: the model lacks an effect there",
}
# Without repeated periods, what is correlated over time and what the sensor does cannot be told apart for certain.
_RESIDUAL_LEVELS = {
    "noise": "the residual is hardly correlated over time: little else than noise is left",
    "above": "part of the residual is correlated over time: something small is missing, or the noise is coloured",
    "well above": "most of the residual is correlated over time: an effect is missing, or the noise is coloured",
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
    """What a reader has to know before using the numbers, each with what to do about it."""
    return [f"{each.sentence}." for each in document.warnings]


def noise_words(method: str) -> str:
    """Where the noise figures come from."""
    if method == "periods":
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

    `rms`: root mean square of the residual [Nm or N]; `noise_std`: standard deviation of the noise [Nm or N].
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
            f"On held-out recordings the residual of {listed(worse)} is larger than on the model's own: the model does"
            " not carry over to that motion; identify from recordings that move the joints in more ways."
        )
