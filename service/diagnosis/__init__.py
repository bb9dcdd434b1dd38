"""What the model leaves out: locate the mismatch, name the missing physics, model it, show the fit improve."""

from service.diagnosis.against import against_model, against_simulation
from service.diagnosis.against_saved import against_saved
from service.diagnosis.diagnosed import ParameterDifference
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
    "against_model",
    "against_saved",
    "against_simulation",
    "diagnose",
    "document",
]
