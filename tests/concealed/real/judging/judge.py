"""What a diagnosis says of a trial on real recordings, beside the same set untouched."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from concealed.real.judging.found_size import found_size, has_order
from concealed.running.kept import Outcome
from concealed.scoring.harm import worse_joints
from concealed.scoring.score import INSIDE, UNKNOWN
from concealed.sealing.truth import label

CONFIDENT = 0.9

SHOWN = 0.05
"""Least energy concealed in held-out residuals, in plain ones, of which a share is told."""

OF_NO_TORQUE = ("delay_joint", "delay_all", "gravity", "link_length", "sign_joint", "sign_all", "gain_joint")
"""Kinds whose torque goes with the measured one, or that are in the robot file."""


@dataclass(frozen=True)
class Named:
    """One concealed effect, and whether it is found.

    multiple : float or None
        of the plain residual; None for a sign
    found, first : bool
        within the set of a finding; its first choice
    before : bool
        whether the untouched set has it too
    inside : bool or None
        whether the interval of the finding's size holds what the trial holds; None where no first choice has a size
    """

    kind: str
    multiple: float | None
    found: bool
    first: bool
    before: bool
    inside: bool | None

    @property
    def named(self) -> bool:
        """Found and not there before; where it was there before, of the right size now."""
        return self.found and (not self.before or bool(self.inside))


@dataclass(frozen=True)
class Judged:
    """One trial.

    effects : list of Named
        all that is concealed
    wrong : list of (str, float)
        findings that are neither concealed nor in the untouched set, and their probabilities
    claims : list of (float, bool)
        probabilities of all findings that the untouched set has not, and whether their first choice is right
    concealed, removed : float
        held-out energy that is concealed, and how much of it is removed; in plain residuals, summed over joints
    worse : list of str
        joints whose held-out residual the findings make larger
    """

    effects: list[Named]
    wrong: list[tuple[str, float]]
    claims: list[tuple[float, bool]]
    concealed: float
    removed: float
    worse: list[str]
    seconds: float

    @property
    def share(self) -> float | None:
        """Share of the concealed energy that is removed, -1 to 1; None where held-out motion hardly shows any."""
        return float(np.clip(self.removed / self.concealed, -1.0, 1.0)) if self.concealed > SHOWN else None

    @property
    def confident(self) -> list[str]:
        """Wrong names that are sure of themselves."""
        return [name for name, probability in self.wrong if probability > CONFIDENT]


def judge(outcome: Outcome, untouched: Outcome) -> Judged:
    """A trial beside its set without it."""
    findings, earlier = _findings(outcome), _findings(untouched)
    told = outcome["case"]["effects"]
    hidden = outcome["truth"]["hidden"]
    effects = [_named(one, set(each["labels"]), findings, earlier) for one, each in zip(told, hidden, strict=True)]
    right = [(one, set(each["labels"])) for one, each in zip(told, hidden, strict=True)]
    there = {name for finding in earlier for name in _names(finding)}
    new = [each for each in findings if _first(each) not in there or any(_is(each, *one) for one in right)]
    wrong = [(_first(each), float(each["probability"])) for each in new if not any(_is(each, *one) for one in right)]
    claims = [
        (float(each["probability"]), any(_is(each, *one) and _first(each) in one[1] for one in right)) for each in new
    ]
    concealed, removed = energy(outcome, untouched)
    return Judged(effects, wrong, claims, concealed, removed, worse_joints(outcome), float(outcome["seconds"]))


def energy(outcome: Outcome, untouched: Outcome) -> tuple[float, float]:
    """Held-out energy that is concealed, and how much of it the findings remove, in plain residuals summed over joints.

    Removed is what they take off beyond what the findings of the untouched set take off there. Concealed is the known
    torque less the nominal model's share, or what the residual grew by where that is more: where training excites
    little, a torque spoils held-out motion by the parameters that it bends. Time and file effects have no known torque.
    """
    (before, after), (plain, best) = _held_out(outcome), _held_out(untouched)
    unit = np.maximum(plain**2, 1e-300)
    removed = float(np.sum((before**2 - after**2 - plain**2 + best**2) / unit))
    grown = max(float(np.sum((before**2 - plain**2) / unit)), 0.0)
    if all(one["kind"] in OF_NO_TORQUE for one in outcome["case"]["effects"]):
        return grown, removed
    return max(float(np.sum(np.array(outcome["case"]["held_out_rms"]) ** 2 / unit)), grown), removed


def _held_out(outcome: Outcome) -> tuple[np.ndarray, np.ndarray]:
    change = outcome["diagnosis"]["fit"]["held_out"]
    return np.array(change["rms_before"], float), np.array(change["rms_after"], float)


def _findings(outcome: Outcome) -> list[dict[str, Any]]:
    """What is named and not refuted by held-out motion."""
    return [
        each
        for each in outcome["diagnosis"]["findings"]
        if each["effect"] != UNKNOWN and each["confirmed"] is not False
    ]


def _first(finding: dict[str, Any]) -> str:
    return label(finding["effect"], finding["joint"])


def _names(finding: dict[str, Any]) -> set[str]:
    return {_first(finding), *finding["equivalent"]}


def _is(finding: dict[str, Any], concealed: dict[str, Any], labels: set[str]) -> bool:
    """Whether a finding's set holds what is concealed; of waves, one of its orders has to be the right one."""
    if not labels & _names(finding):
        return False
    return _first(finding) not in labels or has_order(finding, concealed)


def _named(
    concealed: dict[str, Any],
    labels: set[str],
    findings: Sequence[dict[str, Any]],
    earlier: Sequence[dict[str, Any]],
) -> Named:
    hits = [each for each in findings if _is(each, concealed, labels)]
    firsts = [each for each in hits if _first(each) in labels]
    sizes = [size for each in firsts if (size := found_size(each, concealed)) is not None]
    inside = any(abs(value - truth) <= INSIDE * std for value, std, truth in sizes) if sizes else None
    before = any(_is(each, concealed, labels) for each in earlier)
    return Named(concealed["kind"], concealed["multiple"], bool(hits), bool(firsts), before, inside)
