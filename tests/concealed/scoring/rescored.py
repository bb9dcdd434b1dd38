"""Outcomes scored anew from the truth and the diagnosis that they hold: a better score needs no new trial."""

from dataclasses import asdict
from typing import Any

from concealed.running.kept import Outcome
from concealed.scoring.plain import NOT_KEPT
from concealed.scoring.score import compared
from concealed.sealing.truth import Hidden, Truth
from tauscope.diagnosis.documents.document import DiagnosisDocument

NEEDED_TO_READ: dict[str, list[Any]] = {name: [] for name in (*NOT_KEPT, "detectable")}


def rescored(each: Outcome) -> Outcome:
    """The outcome with its scores worked out again; one that failed as it is."""
    if "diagnosis" not in each:
        return each
    truth = truth_in(each)
    told = {**each, "score": _scored(truth, each["diagnosis"], each["seconds"])}
    if "diagnosis_again" in each:
        told["again"] = _scored(truth, each["diagnosis_again"], each["again"]["seconds"])
    return told


def truth_in(each: Outcome) -> Truth:
    """What was concealed."""
    return Truth(**{**each["truth"], "hidden": [Hidden(**hidden) for hidden in each["truth"]["hidden"]]})


def _scored(truth: Truth, diagnosis: dict[str, Any], seconds: float) -> dict[str, Any]:
    found = DiagnosisDocument.model_validate({**NEEDED_TO_READ, **diagnosis}, strict=False)
    return asdict(compared(truth, found, seconds))
