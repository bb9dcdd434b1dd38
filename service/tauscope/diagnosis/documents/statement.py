"""A finding in words: the physics and its size first, then numbers, doubts, held-out motion, and what to do."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding
from tauscope.effects import Effect, Quantity, TimeLocalEffect
from tauscope.number_text import ABSENT, chance, significant, with_uncertainty

# By verdict, where no finding leads.
HEADLINES = {
    "consistent": "Nothing but noise is left: the model explains the recordings.",
    "unexplained": "Something is missing that no effect of the catalogue explains.",
    "inconclusive": "These recordings cannot decide whether anything is missing.",
    "wrong_values": "No physics is missing: the model states wrong values.",
}
DEVIATIONS = 1.96  # standard errors to either side: 95 % of a normal distribution
MOST_NUMBERS = 4
LIKELY = 0.5  # probability from which a finding advises: below, something else is likelier
UNLIKELY = "Something else is likelier: do not act on this alone"
MOST_RIVALS = 2  # equivalents named in a headline; a finding's entry has them all


@dataclass(frozen=True)
class Statement:
    """A finding in sentences."""

    headline: str  # the first of them, without its full stop
    sentences: tuple[str, ...]

    @property
    def text(self) -> str:
        """All of them."""
        return " ".join(f"{sentence}." for sentence in (self.headline, *self.sentences))


def state_finding(
    finding: Finding, quantities: Sequence[Quantity], diagnosis: Diagnosis, *, tentative: bool
) -> Statement:
    """The statement of a finding by its parameters, its first term's first; a tentative one advises nothing."""
    names = [joint.name for joint in diagnosis.robot.joints]
    found = {each.name: each for each in quantities}
    effect = finding.terms[0].effect
    of_first = quantities[: len(quantities) // len(finding.terms)]
    sentences = [numbers_text(of_first)]
    sentences += [_sentence(_held_out(finding, names, tentative=tentative))]
    sentences += _doubts(finding, diagnosis, names)
    if not tentative:
        sentences.append(_sentence(effect.advice(found)) if finding.probability >= LIKELY else UNLIKELY)
    claim = _claim(finding, found, diagnosis, names)
    headline = f"{_sentence(claim)} ({chance(finding.probability)}{_rivals(finding, names)})"
    return Statement(headline, tuple(filter(None, sentences)))


def numbers_text(quantities: Sequence[Quantity]) -> str:
    """The first parameters with 95 % intervals."""
    parts, any_interval = [], False
    known = [each for each in quantities if each.is_known]
    for each in (quantity.in_usual_unit for quantity in known[:MOST_NUMBERS]):
        value, reach = with_uncertainty(each.value, DEVIATIONS * each.std)
        unit = "" if each.unit == "1" else f" {each.unit}"
        parts.append(f"{each.name} = {value}{unit}" if reach == ABSENT else f"{each.name} = {value} ± {reach}{unit}")
        any_interval |= reach != ABSENT
    return ", ".join(parts) + (" (95 %)" if any_interval else "")


def _claim(finding: Finding, found: dict[str, Quantity], diagnosis: Diagnosis, names: Sequence[str]) -> str:
    """What the arm does and the model does not, where, and when."""
    term, several = finding.terms[0], len(finding.terms) - 1
    parts = [term.effect.claim(found, diagnosis.setting), term.effect.place(names)]
    if isinstance(term.effect, TimeLocalEffect):
        recordings = diagnosis.fitter.observations.names
        parts.append(term.effect.when(term.coefficients, term.shape, recordings, diagnosis.setting.durations))
    if several:
        parts.append(f"with {several} more {'order' if several == 1 else 'orders'}")
    return " ".join(filter(None, parts))


def _rivals(finding: Finding, names: Sequence[str]) -> str:
    """What it could also be."""
    own = finding.terms[0].effect
    rivals = list(dict.fromkeys(_noun(rival.term.effect, own, names) for rival in finding.alternatives))
    if finding.formula is not None:
        rivals.insert(0, f"an error in the formula of {_noun(finding.formula, own, names)}")
    if not rivals:
        return ""
    shown, more = rivals[:MOST_RIVALS], len(rivals) - MOST_RIVALS
    return "; or " + " or ".join([*shown, f"{more} more"] if more > 0 else shown)


def _noun(rival: Effect, own: Effect, names: Sequence[str]) -> str:
    """A rival's name, with its place where that is another."""
    words = rival.id.replace("_", " ")
    return words if rival.joint == own.joint else f"{words} {rival.place(names) or 'of the whole arm'}"


def _doubts(finding: Finding, diagnosis: Diagnosis, names: Sequence[str]) -> Iterator[str]:
    """Why it may be something else, beside its rivals."""
    left = diagnosis.misfit_after
    open_joints = [joint for joint in finding.terms[0].effect.touched(len(names)) if left.significant[joint]]
    worst = max(open_joints, key=lambda joint: left.excess[joint], default=None)
    if worst is not None and left.excess[worst] > finding.gain:
        yield f"More than it explains is left at {names[worst]}: unmodelled physics may be causing this"


def _held_out(finding: Finding, names: Sequence[str], *, tentative: bool) -> str:
    """What changes on held-out motion, at the joint that gains most and the one that loses most; empty without any."""
    change = finding.held_out_change
    doubt = "held-out motion does not confirm it" if tentative else ""
    if change is None:
        return doubt
    touched = list(finding.terms[0].effect.touched(len(names)))
    losing = max(change.losing, key=lambda joint: change.relative[joint], default=None)
    best = None if tentative and losing is not None else touched[int(np.argmin(change.relative[touched]))]
    first, *others = (
        f"of {names[joint]} changes by {change_text(change.relative[joint], change.error[joint])}"
        for joint in dict.fromkeys([best, losing])
        if joint is not None
    )
    size = ", that ".join([f"the held-out rms {first}", *others])
    return f"{doubt}: {size}" if doubt else size


def change_text(relative: float, error: float | None) -> str:
    """A relative change with its 95 % interval, as per cent."""
    if error is None or not np.isfinite(error) or error <= 0.0:
        return f"{100.0 * relative:+.1f} %"
    value, reach = with_uncertainty(100.0 * relative, 100.0 * DEVIATIONS * error)
    sign = "+" if relative > 0.0 else ""
    return f"{sign}{value} ± {reach} % (95 %)"


def state_unknown(joint: str, rms: float, unit: str) -> Statement:
    """The statement of a mismatch without a name. `rms`: beyond the noise [Nm or N]."""
    headline = f"A mismatch of {significant(rms, 2)} {unit} rms at {joint} has no known cause ({chance(1.0)})"
    return Statement(headline, ("Look at the residual where it concentrates",))


def _sentence(clause: str) -> str:
    """A clause that begins with a capital."""
    return clause[:1].upper() + clause[1:]
