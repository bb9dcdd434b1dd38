"""What a diagnosis said of a trial, beside what was concealed."""

import math
import time
from dataclasses import dataclass, field

import numpy as np

from concealed.generator.trial import Trial
from concealed.scoring.promises import is_promised, is_shown
from concealed.sealing.truth import Hidden, Truth, label, truth_of
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.documents.document import DiagnosisDocument
from tauscope.diagnosis.documents.result import FindingEntry

UNKNOWN = "unknown"
KINDS = ("link", "axis", "alpha", "p", "k")
"""Parameters that, where they have no interval, say of what the others are: of a frame, an exponent, a wave."""

SAME = 1e-3
"""Relative difference up to which two of those are the same."""

INSIDE = 1.96
"""Standard errors of a 95 % interval."""


@dataclass(frozen=True)
class Parameter:
    """A finding's parameter beside the true value."""

    name: str
    truth: float
    value: float
    std: float

    @property
    def inside(self) -> bool:
        """Whether the 95 % interval holds the truth."""
        return abs(self.value - self.truth) <= INSIDE * self.std


@dataclass(frozen=True)
class Score:
    """One trial's outcome.

    strength : float
        s
    verdict : str
        as told
    detected, claimed : bool
        anything but consistent; an effect named
    located : bool
        a significant mismatch at the joint, and no larger one elsewhere in units of the noise
    placed, named, first : bool
        the joint of a finding right; truth within a finding's equivalents; truth the first choice: of all that is
        concealed
    size : float
        mean number of effects in the sets of the findings that hold the truth
    extra : list of str
        findings that are no truth
    probabilities : list of (float, bool)
        of each finding's first choice, and whether it is there: what comes with an effect is
    parameters : list of Parameter
        of the findings whose first choice is right
    held_out : float
        largest rms after ÷ noise of any joint
    seconds : float
        of the diagnosis
    promised : list of bool
        for each concealed effect that the diagnosis calls detectable at its size, whether it says that something is
        there
    told : list of str
        all findings with their equivalents
    """

    strength: float
    verdict: str
    detected: bool
    claimed: bool
    located: bool
    placed: bool
    named: bool
    first: bool
    size: float
    extra: list[str]
    probabilities: list[tuple[float, bool]]
    parameters: list[Parameter]
    held_out: float
    seconds: float
    promised: list[bool] = field(default_factory=list)
    told: list[str] = field(default_factory=list)


def diagnosed(trial: Trial) -> tuple[DiagnosisDocument, float]:
    """The diagnosis of a trial as a user gets it, and how long it took [s]."""
    begin = time.perf_counter()
    found = document(diagnose(trial.robot, trial.train, trial.held_out))
    return found, time.perf_counter() - begin


def scored(trial: Trial, found: DiagnosisDocument, seconds: float) -> Score:
    """A trial that is at hand."""
    return compared(truth_of(trial), found, seconds)


def compared(truth: Truth, found: DiagnosisDocument, seconds: float) -> Score:
    """What was said beside what was concealed."""
    right = [set(hidden.labels) for hidden in truth.hidden]
    also = {*truth.own, *(each for hidden in truth.hidden for each in hidden.also)}
    findings = [finding for finding in found.findings if finding.effect != UNKNOWN]
    firsts = [label(finding.effect, finding.joint) for finding in findings]
    sets = [{first, *finding.equivalent} for first, finding in zip(firsts, findings, strict=True)]
    hits = [any(labels & members for labels in right) for members in sets]
    sizes = [len(members) for members, hit in zip(sets, hits, strict=True) if hit]
    after = found.fit.held_out.rms_after if found.fit.held_out else []
    return Score(
        strength=truth.strength,
        verdict=found.verdict,
        detected=found.verdict != "consistent",
        claimed=any(first not in truth.own for first in firsts),
        located=all(_located(hidden.joints, found, truth) for hidden in truth.hidden),
        placed=all(any(finding.joint in hidden.joints for finding in findings) for hidden in truth.hidden),
        named=all(any(labels & members for members in sets) for labels in right),
        first=all(any(first in labels for first in firsts) for labels in right),
        size=float(np.mean(sizes)) if sizes else float("nan"),
        extra=[first for first, hit in zip(firsts, hits, strict=True) if not hit and first not in also],
        probabilities=[
            (finding.probability, first in also or any(first in labels for labels in right))
            for first, finding in zip(firsts, findings, strict=True)
        ],
        parameters=_parameters(truth, found),
        held_out=float(max(a / s for a, s in zip(after, truth.torque_std, strict=True))) if after else np.nan,
        seconds=seconds,
        promised=[is_shown(found) for hidden in truth.hidden if is_promised(hidden, found)],
        told=[
            f"{first} {finding.probability:.2f} {{{', '.join(finding.equivalent)}}}"
            for first, finding in zip(firsts, findings, strict=True)
        ],
    )


def _located(joints: list[str | None], found: DiagnosisDocument, truth: Truth) -> bool:
    """Whether the largest significant mismatch is at one of the joints; for the whole arm, whether there is any."""
    significant = {
        each.joint: each.excess_rms / std
        for each, std in zip(found.mismatch, truth.torque_std, strict=True)
        if each.significant
    }
    if not significant or None in joints:
        return bool(significant)
    return max(significant, key=lambda joint: significant[joint]) in joints


def _parameters(truth: Truth, found: DiagnosisDocument) -> list[Parameter]:
    told = []
    for hidden in truth.hidden:
        for finding in found.findings:
            if label(finding.effect, finding.joint) in hidden.labels and not _of_another(hidden, finding):
                told += [
                    Parameter(each.name, hidden.parameters[each.name], each.value, each.std)
                    for each in finding.parameters
                    if each.name in hidden.parameters and each.std > 0.0
                ]
    return told


def _of_another(hidden: Hidden, finding: FindingEntry) -> bool:
    """Whether a finding is of another kind than the truth: its sizes are other quantities then.

    A displacement belongs to its link and axis, the coefficient of a power to that power, of a decay to its exponent.
    """
    return any(
        not math.isclose(each.value, hidden.parameters[each.name], rel_tol=SAME)
        for each in finding.parameters
        if each.name in KINDS and each.name in hidden.parameters and each.std == 0.0
    )
