"""The verdict, computed from tests: none is a default."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What a diagnosis says as a whole."""

    CONSISTENT = "consistent"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"
    INCONCLUSIVE = "inconclusive"
    WRONG_VALUES = "wrong_values"


# Verdicts that leave something to another recording.
OPEN = frozenset({Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED, Verdict.INCONCLUSIVE})


@dataclass(frozen=True)
class Evidence:
    """What the verdict rests on."""

    findings: int
    misfit_before: bool
    misfit_after: bool
    parameters_hold: bool
    predicts: bool = True
    extrapolates: bool = False  # whether held-out motion is beyond what training excites
    undetermined: bool = False  # whether training leaves a part of its torque open
    wrong_values: bool = False  # whether a model that the recordings are compared with states wrong values


def verdict(evidence: Evidence) -> Verdict:
    """The verdict on some evidence.

    Where held-out motion is not predicted, and training leaves its torque open, the error may be physics or parameters:
    no misfit decides that. Where training leaves less open, only names do.
    """
    if evidence.undetermined and not evidence.predicts:
        return Verdict.INCONCLUSIVE
    if evidence.findings:
        return Verdict.PARTLY_EXPLAINED if evidence.misfit_after else Verdict.EXPLAINED
    if evidence.extrapolates and not evidence.predicts:
        return Verdict.INCONCLUSIVE
    if evidence.misfit_before:
        return Verdict.UNEXPLAINED
    if not (evidence.parameters_hold and evidence.predicts):
        return Verdict.INCONCLUSIVE
    return Verdict.WRONG_VALUES if evidence.wrong_values else Verdict.CONSISTENT
