"""Parameters from recordings: terms, noise, LS and WLS, uncertainty, physical consistency, compensation."""

from service.identification.estimate import Estimator
from service.identification.identification import Identification, Options, identify
from service.identification.result import IdentificationDocument, document

__all__ = ["Estimator", "Identification", "IdentificationDocument", "Options", "document", "identify"]
