"""The model with its findings as something to keep: saved, read again, written as code, and for the simulated arm."""

from service.diagnosis.extended_model.compensation_code import compensation_code
from service.diagnosis.extended_model.consistent_links import consistent_links
from service.diagnosis.extended_model.saved import MODEL_SCHEMA, ModelDocument, model_document, read_model, restored
from service.diagnosis.extended_model.simulation_files import improved_robot, scenario_text

__all__ = [
    "MODEL_SCHEMA",
    "ModelDocument",
    "compensation_code",
    "consistent_links",
    "improved_robot",
    "model_document",
    "read_model",
    "restored",
    "scenario_text",
]
