"""What the model leaves out: locate the mismatch, name the missing physics, model it, show the fit improve."""

from tauscope.diagnosis.against.given_model import against_model, against_simulation, compare_with_saved
from tauscope.diagnosis.diagnosis import Diagnosis, Finding, diagnose
from tauscope.diagnosis.documents.document import document
from tauscope.diagnosis.documents.result import DiagnosisDocument
from tauscope.diagnosis.findings.diagnosed import ParameterDifference
from tauscope.diagnosis.findings.verdict import Verdict

__all__ = [
    "Diagnosis",
    "DiagnosisDocument",
    "Finding",
    "ParameterDifference",
    "Verdict",
    "against_model",
    "against_simulation",
    "compare_with_saved",
    "diagnose",
    "document",
]
