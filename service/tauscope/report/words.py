"""What a result says, in sentences, the same on terminal and page."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePath

from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.result import FindingEntry, MismatchEntry
from tauscope.diagnosis.documents.statement import DEVIATIONS, change_text
from tauscope.diagnosis.model.held_out_change import SHOWN
from tauscope.identification import IdentificationDocument
from tauscope.number_text import ABSENT, counted, percent, significant, with_uncertainty
from tauscope.robot import JointType
from tauscope.robot.messages import listed


def state_unit(variable: str, joint_type: JointType) -> str:
    """Unit of a variable that a residual may depend on."""
    position = joint_type.unit
    units = {"velocity": f"{position}/s", "position": position, "acceleration": f"{position}/s²", "time": "s"}
    return {**units, "load": joint_type.torque_unit, "temperature": "°C", "motor_position": "rad"}.get(variable, "")


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


def cautions(document: IdentificationDocument | DiagnosisDocument) -> list[str]:
    """What a reader has to know before acting on it, each with what to do about it."""
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
    """Residual in units of the noise."""
    return rms / noise_std if noise_std > 0.0 else float("inf")


def _level(ratio: float) -> str:
    return "noise" if ratio <= AT_NOISE else "above" if ratio <= ABOVE_NOISE else "well above"


def _about_held_out(document: IdentificationDocument) -> Iterator[str]:
    if document.fit.held_out is None:
        return
    pairs = zip(document.joints, document.fit.train.rms, document.fit.held_out.rms, strict=True)
    worse = [joint for joint, own, other in pairs if other > CARRIES_OVER * own]
    if worse:
        yield (
            f"On held-out recordings the residual of {listed(worse)} is larger than on the model's own: the model does"
            " not carry over to that motion; identify from recordings that move the joints in more ways."
        )


VERDICTS = {
    "consistent": "nothing but noise is left",
    "explained": "the findings bring the residual to the noise",
    "partly_explained": "a significant remainder stays beside the findings",
    "unexplained": "a significant mismatch that no confirmed effect explains",
    "inconclusive": "these recordings cannot decide it",
    "wrong_values": "no physics is missing, but stated values are wrong",
}

AGAINST = {
    "identified": "the best rigid-body and friction model that the data allow",
    "model": "the robot file's model",
    "simulation": "recordings of the simulator",
}

CONFIRMED = {True: "confirmed", False: "not confirmed", None: "not tested: no recording was held out"}

MOST_FINDINGS = 5  # findings shown before a fold
NOTHING_ELSE = "No competing explanation"


def effect_title(effect: str) -> str:
    """An effect's id as a heading."""
    return effect.replace("_", " ").capitalize()


def place_title(joint: str | None) -> str:
    """Where an effect is. `joint`: name of the joint; None for the whole arm."""
    return "of the whole arm" if joint is None else f"at {joint}"


def file_title(name: str) -> str:
    """A recording's name without its folders."""
    return PurePath(name).name or name


def noise_ratios(document: DiagnosisDocument) -> tuple[list[float], list[float], bool]:
    """Residual over noise of every joint, before and after; and whether on held-out motion."""
    fit = document.fit.held_out or document.fit.train
    before, after = (
        [noise_ratio(rms, noise) for rms, noise in zip(own, document.noise_std, strict=True)]
        for own in (fit.rms_before, fit.rms_after)
    )
    return before, after, document.fit.held_out is not None


def summary_sentences(document: DiagnosisDocument) -> Iterator[str]:
    """What was compared, what it comes to, and how unseen motion is predicted, better or worse."""
    yield f"Compared with {AGAINST[document.against]}: {VERDICTS[document.verdict]}."
    yield from (f"{sentence}." for sentence in document.wrong_values)
    before, after, held_out = noise_ratios(document)
    if document.findings and after != before:
        most = max(range(len(before)), key=lambda place: before[place] - after[place])
        motion = "On motion that neither model was made from" if held_out else "On the motion itself"
        yield f"{motion}, {_residual_change(document, most)}."
        worse = [place for place in range(len(before)) if after[place] > (1.0 + SHOWN) * before[place]]
        if held_out and worse:
            yield f"It is predicted worse: {'; '.join(_residual_change(document, place) for place in worse)}."
    if not document.findings:
        yield "No effect is named. The last table says what size each would have needed to show in these recordings."


def _residual_change(document: DiagnosisDocument, joint: int) -> str:
    """How one joint's residual changes. `joint`: joint index, from 0."""
    before, after = (significant(ratios[joint], 3) for ratios in noise_ratios(document)[:2])
    return f"the residual of {document.joints[joint]} goes from {before} to {after} times the sensor noise"


def refutations(document: DiagnosisDocument) -> Iterator[str]:
    """Joints at which a black box predicts what the verdict calls noise."""
    yield from (entry.statement for entry in document.headroom or () if entry.refuted)


def doubts(document: DiagnosisDocument) -> Iterator[str]:
    """What a reader has to know before acting on a diagnosis."""
    yield from cautions(document)
    yield from refutations(document)
    if document.fit.held_out is None:
        yield "No recording was held out: nothing here was tested on motion that the model has not seen."
    for finding in document.findings:
        if finding.equivalent:
            where = f"{effect_title(finding.effect)} {place_title(finding.joint)}"
            yield f"{where}: these data cannot tell it from {', '.join(finding.equivalent)}."
    for move in document.constancy.moved:
        yield (
            f"{move.parameter} is not the same in {file_title(move.between[0])} and {file_title(move.between[1])}:"
            f" {significant(move.shift_in_std, 3)} standard errors apart."
        )
    if document.noise_method == "residual":
        yield "The noise is estimated from the residual itself; recordings with repeated periods would measure it."


def location_sentence(entry: MismatchEntry, joint_type: JointType) -> str:
    """Where one joint's mismatch concentrates."""
    if not entry.significant:
        return f"{entry.joint}: nothing but noise."
    text = f"{entry.joint}: {significant(entry.excess_rms, 3)} {joint_type.torque_unit} rms beyond the noise"
    if entry.where is not None:
        low, high = (significant(value, 2) for value in entry.where.range)
        variable, unit = entry.where.variable, state_unit(entry.where.variable, joint_type)
        text += f", {_share(entry.where.share)} of it at a {variable.replace('_', ' ')} of {low} to {high} {unit}"
    else:
        text += ", in every part of the motion"
    if entry.time is not None:
        low, high = (significant(value, 3) for value in entry.time.range)
        text += f", {_share(entry.time.share)} between {low} and {high} s"
    return f"{text}."


def _share(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def finding_facts(finding: FindingEntry, joints: Sequence[str]) -> list[tuple[str, str]]:
    """What is known of a finding, in the order in which one asks."""
    facts = [
        (each.name, f"{value}{unit}" if reach == ABSENT else f"{value} ± {reach}{unit} (95 %)")
        for each in finding.parameters
        for value, reach in (with_uncertainty(each.value, DEVIATIONS * each.std),)
        for unit in ("" if each.unit == "1" else f" {each.unit}",)
    ]
    facts += [("Torque", finding.equation)] if finding.equation else []
    if finding.share is not None:
        facts.append(("Explains", f"{percent(finding.share)} of the explained energy {place_title(finding.joint)}"))
    others = ", ".join(finding.equivalent) if finding.equivalent else NOTHING_ELSE
    return [*facts, ("Held out", held_out_words(finding, joints)), ("Could also be", others)]


def held_out_words(finding: FindingEntry, joints: Sequence[str]) -> str:
    """Whether held-out motion confirms a finding, and the change at its joint, or where it is largest."""
    change = finding.held_out_change
    if change is None:
        return CONFIRMED[finding.confirmed]
    if finding.joint is None:
        place = max(range(len(joints)), key=lambda joint: abs(change.relative[joint]))
    else:
        place = list(joints).index(finding.joint)
    size = change_text(change.relative[place], change.std[place])
    changes = f"the rms of {joints[place]} changes by {size}"
    return changes if finding.confirmed is None else f"{CONFIRMED[finding.confirmed]}: {changes}"


def constancy_sentence(document: DiagnosisDocument) -> str:
    """Whether the parameters hold from one recording to the next."""
    p_value = document.constancy.p_value
    if document.constancy.moved:
        moved = counted(len(document.constancy.moved), "parameter")
        return f"Parameters do not all hold from one recording to the next ({moved} moved; p = {p_value:.2g})."
    return f"The parameters hold from one recording to the next (p = {p_value:.2g})."
