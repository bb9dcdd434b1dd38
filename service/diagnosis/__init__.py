"""What the model leaves out: locate the mismatch, name the missing physics, model it, show the fit improve."""

from service.diagnosis.against.given_model import against_model, against_simulation
from service.diagnosis.against.saved_model import against_saved
from service.diagnosis.diagnosis import Diagnosis, Finding, diagnose
from service.diagnosis.documents.document import document
from service.diagnosis.documents.result import DiagnosisDocument
from service.diagnosis.findings.diagnosed import ParameterDifference
from service.diagnosis.findings.verdict import Verdict

__all__ = [
    "Diagnosis",
    "DiagnosisDocument",
    "Finding",
    "ParameterDifference",
    "Verdict",
    "against_model",
    "against_saved",
    "against_simulation",
    "diagnose",
    "document",
]
