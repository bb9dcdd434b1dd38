"""What a diagnosis said of a trial, beside what was concealed."""

import time
from dataclasses import dataclass, field

import numpy as np

from concealed.trial import Trial
from service.diagnosis import diagnose, document
from service.diagnosis.document import DiagnosisDocument


@dataclass(frozen=True)
class Score:
    """One trial's outcome.

    strength : float
        s
    verdict : str
        as told
    detected, placed, named, first : bool
        anything named; the joint right; truth within a finding's equivalents; truth the first choice
    size : float
        mean number of effects in the sets of the findings that hold the truth
    extra : list of str
        findings that are no truth
    held_out : float
        largest rms after ÷ noise of any joint
    seconds : float
        of the diagnosis
    told : list of str
        all findings with their equivalents
    """

    strength: float
    verdict: str
    detected: bool
    placed: bool
    named: bool
    first: bool
    size: float
    extra: list[str]
    held_out: float
    seconds: float
    told: list[str] = field(default_factory=list)


def diagnosed(trial: Trial) -> tuple[DiagnosisDocument, float]:
    """The diagnosis of a trial as a user gets it, and how long it took [s]."""
    begin = time.perf_counter()
    found = document(diagnose(trial.robot, trial.train, trial.held_out))
    return found, time.perf_counter() - begin


def scored(trial: Trial, found: DiagnosisDocument, seconds: float) -> Score:
    """Compare."""
    names = [joint.name for joint in trial.robot.joints]
    truths = [
        {name if place is None else f"{name}@{names[place]}" for name in drawn.names for place in drawn.places}
        for drawn in trial.truth
    ]
    joints = [{None if place is None else names[place] for place in drawn.places} for drawn in trial.truth]
    also = {f"{name}@{names[p]}" for d in trial.truth for name in d.also for p in d.places if p is not None}
    sets = [(finding.joint, {_label(finding.effect, finding.joint), *finding.equivalent}) for finding in found.findings]
    firsts = [_label(finding.effect, finding.joint) for finding in found.findings]
    holding = [any(truth & members for _, members in sets) for truth in truths]
    extra = [
        label
        for label, (_, members) in zip(firsts, sets, strict=True)
        if not any(truth & members for truth in truths) and label not in also
    ]
    sizes = [len(members) for _, members in sets if any(truth & members for truth in truths)]
    after = found.fit.held_out.rms_after if found.fit.held_out else []
    return Score(
        strength=trial.strength,
        verdict=str(found.verdict),
        detected=bool(found.findings),
        placed=all(any(joint in own for joint, _ in sets) for own in joints),
        named=all(holding),
        first=all(any(label in truth for label in firsts) for truth in truths),
        size=float(np.mean(sizes)) if sizes else float("nan"),
        extra=extra,
        held_out=float(max(a / s for a, s in zip(after, trial.noise.torque_std, strict=True))) if after else np.nan,
        seconds=seconds,
        told=[f"{label}{{{', '.join(f.equivalent)}}}" for label, f in zip(firsts, found.findings, strict=True)],
    )


def _label(effect: str, joint: str | None) -> str:
    return effect if joint is None else f"{effect}@{joint}"
