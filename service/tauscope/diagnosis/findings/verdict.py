"""The verdict, computed from tests: none of the five is a default."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What a diagnosis says as a whole."""

    CONSISTENT = "consistent"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True)
class Evidence:
    """What the verdict rests on."""

    findings: int
    misfit_before: bool
    misfit_after: bool
    parameters_hold: bool
    predicts: bool = True


def verdict(evidence: Evidence) -> Verdict:
    """The verdict on some evidence."""
    if evidence.findings:
        return Verdict.PARTLY_EXPLAINED if evidence.misfit_after else Verdict.EXPLAINED
    if evidence.misfit_before:
        return Verdict.UNEXPLAINED
    return Verdict.CONSISTENT if evidence.parameters_hold and evidence.predicts else Verdict.INCONCLUSIVE
