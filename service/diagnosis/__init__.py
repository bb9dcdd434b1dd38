"""What the model leaves out: locate the mismatch, name the missing physics, model it, show the fit improve."""

from service.diagnosis.against import ParameterDifference, differences_from_model, differences_from_simulation
from service.diagnosis.diagnosis import Diagnosis, Finding, diagnose
from service.diagnosis.document import document
from service.diagnosis.result import DiagnosisDocument
from service.diagnosis.verdict import Verdict

__all__ = [
    "Diagnosis",
    "DiagnosisDocument",
    "Finding",
    "ParameterDifference",
    "Verdict",
    "diagnose",
    "differences_from_model",
    "differences_from_simulation",
    "document",
]
